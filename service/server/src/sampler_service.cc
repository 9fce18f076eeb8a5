// SPDX-License-Identifier: Apache-2.0
#include "src/sampler_service.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "facetwise/engine.h"
#include "facetwise/slope_table.h"
#include "grpcpp/impl/codegen/server_callback_handlers.h"
#include "src/machine.h"
#include "wire/fields.h"
#include "wire/status.h"

namespace facetwise {
namespace {

using grpc::ByteBuffer;
using grpc::internal::RpcMethod;
using grpc::internal::RpcServiceMethod;
using wire::to_grpc;

absl::Status cancelled() { return absl::CancelledError("the message did not come in time"); }

absl::Status shuts_down() { return absl::UnavailableError("the server is shutting down"); }

template <class Message>
bool parse(ByteBuffer& bytes, Message& message) {
  return grpc::SerializationTraits<Message>::Deserialize(&bytes, &message).ok();
}

template <class Message>
ByteBuffer serialise(const Message& message) {
  ByteBuffer bytes;
  bool own = false;
  grpc::SerializationTraits<Message>::Serialize(message, &bytes, &own);
  return bytes;
}

void describe(const Tables::Entry& entry, v1::SlopeTableInfo& info) {
  info.set_id(entry.table->id());
  info.set_bytes(entry.table->bytes());
  info.set_radial(entry.table->radial());
  info.set_idle_seconds(entry.idle.count());
}

// Of an UploadTable call that is done.
ByteBuffer description(std::shared_ptr<const SlopeTable> table) {
  v1::SlopeTableInfo info;
  describe({std::move(table), {}}, info);
  return serialise(info);
}

// Of what a client has sent with its call: a short text of visible characters, else empty.
std::string metadata(const grpc::CallbackServerContext& context, const char* name) {
  constexpr std::size_t kLongest = 64;
  const auto found = context.client_metadata().find(name);
  if (found == context.client_metadata().end()) return "";
  const absl::string_view value(found->second.data(), found->second.size());
  const bool good = value.size() <= kLongest && std::all_of(value.begin(), value.end(), absl::ascii_isgraph);
  return good ? std::string(value) : "";
}

std::string random_name() {
  std::random_device random;
  return absl::StrCat(absl::Hex(random(), absl::kZeroPad8));
}

// What clients do wrong is news, no trouble of the server's.
LogLevel level_of(const grpc::Status& status) {
  switch (status.error_code()) {
    case grpc::StatusCode::OK: return LogLevel::debug;
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
    case grpc::StatusCode::INTERNAL:
    case grpc::StatusCode::UNKNOWN: return LogLevel::warning;
    default: return LogLevel::info;
  }
}

}  // namespace

SamplerService::SamplerService(const ServerOptions& options, const Connections& connections,
                               const SharedRegions& regions, Log& log)
    : options_(options),
      connections_(connections),
      regions_(regions),
      log_(log),
      run_(random_name()),
      limits_{options.max_message_bytes},
      admission_({.calls = options.max_calls,
                  .open = options.max_open_calls,
                  .bytes = options.max_bytes_in_flight,
                  .message_bytes = options.max_message_bytes,
                  .patience = options.patience}),
      compute_(options.threads, options.execution),
      tables_(options.max_tables_bytes, options.table_idle_timeout),
      tokens_(options.token_file, log),
      identity_(identify()),
      metrics_(identity_, [this] { return load(); }) {
  const auto one = [this](const Answer& answer) {
    return [this, answer](Call& call) { return answer_one(answer, call); };
  };
  const auto many = [this](const Answer& answer) {
    return [this, answer](Call& call) { return answer_many(answer, call); };
  };
  add("Run", one(with_tools("Run", answer_batch)));
  add("RunStream", many(with_tools("RunStream", answer_batch)));
  add("Compact", one(with_tools("Compact", answer_compact)));
  add("CompactStream", many(with_tools("CompactStream", answer_compact)));
  add("UploadTable", [this](Call& call) { return upload_table(call); });
  add_small("ListTables", &SamplerService::list_tables);
  add_small("DeleteTable", &SamplerService::delete_table);
  add_small("Info", &SamplerService::info);
  add("Benchmark", [this](Call& call) { return benchmark(call); });
}

SamplerService::~SamplerService() {
  if (benchmark_thread_.joinable()) benchmark_thread_.join();
}

void SamplerService::add(const std::string& name, const Call::Course& course) {
  const auto admitted = [this, course](Call& call) -> Task<Call::End> {
    if (auto status = tokens_.check(call.context()); !status.ok()) co_return {to_grpc(status)};
    if (auto status = call.stay().enter(); !status.ok()) co_return {to_grpc(status)};
    auto rest = course(call);
    co_return co_await rest;
  };
  const auto told = [this, admitted, name](Call& call) -> Task<Call::End> {
    const auto begin = std::chrono::steady_clock::now();
    auto rest = admitted(call);
    auto end = co_await rest;
    tell_end(name, call, end.status, std::chrono::steady_clock::now() - begin);
    co_return end;
  };
  methods_.push_back(std::make_unique<std::string>("/facetwise.v1.Sampler/" + name));
  AddMethod(new RpcServiceMethod(methods_.back()->c_str(), RpcMethod::BIDI_STREAMING, nullptr));
  MarkMethodRawCallback(static_cast<int>(methods_.size()) - 1,
                        new grpc::internal::CallbackBidiHandler<ByteBuffer, ByteBuffer>(
                            [this, told](grpc::CallbackServerContext* context) {
                              return new Call(*context, admission_, {options_.write_timeout}, told);
                            }));
}

void SamplerService::tell_end(const std::string& method, Call& call, const grpc::Status& status,
                              std::chrono::duration<double> time) {
  metrics_.call_ended(method, status.error_code());
  const LogLevel level = level_of(status);
  const bool logs = log_.takes(level);
  if (status.ok() && !logs) return;
  // The client's own name of the request, if it has one, so that both ends' logs can be put together.
  std::string id = metadata(call.context(), "x-request-id");
  if (id.empty()) id = absl::StrCat(run_, "-", named_.fetch_add(1, std::memory_order_relaxed));
  if (!status.ok()) call.add_trailer("x-request-id", id);
  if (!logs) return;
  const CallFacts& facts = call.facts();
  nlohmann::ordered_json fields = {
      {"method", method},
      {"code", absl::StatusCodeToString(static_cast<absl::StatusCode>(status.error_code()))},
      {"ms", std::round(time.count() * 1e6) / 1e3},
      {"peer", call.context().peer()},
      {"request_id", id}};
  if (const std::string trace = metadata(call.context(), "traceparent"); !trace.empty()) fields["traceparent"] = trace;
  for (const auto& [name, value] : {std::pair{"operation", facts.operation},
                                    {"distribution", facts.distribution},
                                    {"masking", facts.masking},
                                    {"sampler", facts.sampler}})
    if (!value.empty()) fields[name] = std::string(value);
  for (const auto& [name, value] : {std::pair<const char*, std::uint64_t>{"lanes", facts.lanes},
                                    {"received", facts.received},
                                    {"sent", facts.sent}})
    if (value > 0) fields[name] = value;
  if (!status.ok()) fields["message"] = status.error_message();
  if (status.ok())
    log_.write(level, "call", fields);
  else
    log_.write_some(level, "call", fields);
}

SamplerService::Answer SamplerService::with_tools(const char* method, AnswerColumns answer) {
  return [this, method, answer](ByteBuffer& request, Call& call) -> Task<absl::StatusOr<ByteBuffer>> {
    const auto begin = std::chrono::steady_clock::now();
    const std::size_t received = request.Length();
    call.facts().received += received;
    const CallTools tools{limits_, compute_, tables_, regions_, call.stay(), call.stop(), metrics_, call.facts()};
    auto answering = answer(request, tools);
    auto answered = co_await answering;
    // The request is no more.
    const std::size_t sent = answered.ok() ? answered->Length() : 0;
    call.stay().hold_no_more_than(sent);
    if (answered.ok()) {
      call.facts().sent += sent;
      metrics_.answered(method, std::chrono::steady_clock::now() - begin, received, sent);
    }
    co_return answered;
  };
}

template <class Request, class Response>
void SamplerService::add_small(const std::string& name,
                               absl::Status (SamplerService::*answer)(const Request&, Response&)) {
  const Answer small = [this, answer](ByteBuffer& bytes, Call&) -> Task<absl::StatusOr<ByteBuffer>> {
    Request request;
    Response response;
    if (!parse(bytes, request)) co_return damaged_message();
    if (auto status = (this->*answer)(request, response); !status.ok()) co_return status;
    co_return serialise(response);
  };
  add(name, [this, small](Call& call) { return answer_one(small, call); });
}

Task<absl::StatusOr<ByteBuffer>> SamplerService::read_one(Call& call) {
  auto reading = call.read(options_.read_timeout);
  auto request = co_await reading;
  if (!request) co_return call.cancelled() ? cancelled() : absl::InvalidArgumentError("message: none");
  // A call of one message ends its side with it.
  auto end = call.read(options_.read_timeout);
  const auto another = co_await end;
  call.stay().leave_room();
  if (another) co_return absl::InvalidArgumentError("message: more than one, in a call that takes one");
  if (call.cancelled()) co_return cancelled();
  co_return *std::move(request);
}

Task<Call::End> SamplerService::answer_one(Answer answer, Call& call) {
  auto reading = read_one(call);
  auto request = co_await reading;
  if (!request.ok()) co_return {to_grpc(request.status())};
  auto answering = answer(*request, call);
  auto answered = co_await answering;
  if (!answered.ok()) co_return {to_grpc(answered.status())};
  co_return {grpc::Status::OK, *std::move(answered)};
}

Task<Call::End> SamplerService::answer_many(Answer answer, Call& call) {
  for (;;) {
    auto reading = call.read(options_.stream_idle_timeout);
    auto request = co_await reading;
    call.stay().leave_room();
    if (!request) co_return {call.cancelled() ? to_grpc(cancelled()) : grpc::Status::OK};
    auto answering = answer(*request, call);
    const auto answered = co_await answering;
    if (!answered.ok()) co_return {to_grpc(answered.status())};
    auto writing = call.write(*answered);
    if (!co_await writing) co_return {to_grpc(cancelled())};
    call.stay().release();
    if (admission_.closed()) co_return {to_grpc(shuts_down())};
  }
}

Task<Call::End> SamplerService::upload_table(Call& call) {
  std::optional<v1::TableChunk> first;
  std::string data;
  for (;;) {
    auto reading = call.read(options_.read_timeout);
    auto bytes = co_await reading;
    if (call.cancelled()) co_return {to_grpc(cancelled())};
    if (!bytes && !first) co_return {to_grpc(absl::InvalidArgumentError("message: none"))};
    if (!bytes)
      co_return {
          to_grpc(invalid_field("data", absl::StrCat(data.size(), " of the ", first->bytes(), " bytes announced")))};
    v1::TableChunk chunk;
    if (!parse(*bytes, chunk)) co_return {to_grpc(damaged_message())};
    call.stay().leave_room();
    if (!first) {
      first = chunk;
      if (auto kept = tables_.find(first->id())) co_return {grpc::Status::OK, description(kept)};
      if (first->bytes() > options_.max_table_bytes)
        co_return {to_grpc(invalid_field(
            "bytes", absl::StrCat(first->bytes(), " are above the limit of ", options_.max_table_bytes)))};
      // As received, and as read.
      if (auto status = call.stay().hold(2 * first->bytes()); !status.ok()) co_return {to_grpc(status)};
      data.reserve(first->bytes());
    }
    if (chunk.data().size() > first->bytes() - data.size())
      co_return {
          to_grpc(invalid_field("data", absl::StrCat("more than the ", first->bytes(), " bytes that were announced")))};
    data += chunk.data();
    if (data.size() == first->bytes()) break;
  }
  co_await compute_.turn(true);
  const auto table = SlopeTable::parse(data);
  if (!table.ok())
    co_return {to_grpc(absl::Status(table.status().code(), absl::StrCat("data: ", table.status().message())))};
  if ((*table)->id() != first->id()) co_return {to_grpc(invalid_field("id", "not that of the table"))};
  if (auto status = tables_.put(*table); !status.ok()) co_return {to_grpc(status)};
  co_return {grpc::Status::OK, description(*table)};
}

absl::Status SamplerService::list_tables(const v1::ListTablesRequest&, v1::ListTablesResponse& response) {
  for (const Tables::Entry& entry : tables_.list()) describe(entry, *response.add_tables());
  response.set_max_bytes(tables_.max_bytes());
  response.set_max_idle_seconds(std::chrono::duration<double>(tables_.max_idle()).count());
  return absl::OkStatus();
}

absl::Status SamplerService::delete_table(const v1::DeleteTableRequest& request, v1::DeleteTableResponse&) {
  if (tables_.erase(request.id())) return absl::OkStatus();
  return absl::NotFoundError(absl::StrCat("id: no table ", absl::Hex(request.id(), absl::kZeroPad16), " here"));
}

absl::Status SamplerService::info(const v1::InfoRequest&, v1::InfoResponse& response) {
  response = identity_;
  *response.mutable_load() = load();
  return absl::OkStatus();
}

v1::InfoResponse SamplerService::identify() const {
  v1::InfoResponse info;
  info.set_version(std::string(version()));
  info.set_target(std::string(name(resolve(compute_.execution().target).value_or(Target::best))));
  for (const Target target : available_targets()) info.add_available_targets(std::string(name(target)));
  info.set_threads(compute_.threads());
  info.set_max_message_bytes(options_.max_message_bytes);
  info.set_cpu(cpu_name());
  info.set_benchmark_allowed(options_.allow_benchmark && options_.benchmark);
  v1::ServerLimits& limits = *info.mutable_limits();
  limits.set_calls(options_.max_calls);
  limits.set_open_calls(options_.max_open_calls);
  limits.set_held_bytes(admission_.most_bytes());
  limits.set_connections(connections_.most());
  limits.set_table_bytes(tables_.max_bytes());
  limits.set_lanes(limits_.lanes());
  limits.set_shared_bytes(regions_.max_bytes());
  std::vector<Model> models = all_models();
  for (const Masking masking : {Masking::smith, Masking::vcavity})
    models.push_back({.distribution = Distribution::table, .masking = masking});
  for (const Model& model : models) {
    v1::ModelInfo& its = *info.add_models();
    its.set_distribution(wire::to_proto(model.distribution));
    its.set_masking(wire::to_proto(model.masking));
    for (const Sampler sampler : samplers_for(Operation::sample_reflection, model))
      its.add_samplers(wire::to_proto(sampler));
  }
  return info;
}

v1::ServerLoad SamplerService::load() const {
  v1::ServerLoad load;
  const Admission::Load calls = admission_.load();
  load.set_calls(calls.working);
  load.set_open_calls(calls.open);
  load.set_held_bytes(calls.bytes);
  load.set_connections(connections_.count());
  load.set_table_bytes(tables_.bytes());
  load.set_shared_bytes(regions_.bytes());
  load.set_lanes(metrics_.lanes());
  load.set_serving(serving_);
  load.set_uptime_seconds(std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count());
  return load;
}

Task<Call::End> SamplerService::benchmark(Call& call) {
  auto reading = read_one(call);
  auto bytes = co_await reading;
  if (!bytes.ok()) co_return {to_grpc(bytes.status())};
  v1::BenchmarkRequest request;
  if (!parse(*bytes, request)) co_return {to_grpc(damaged_message())};
  constexpr std::size_t kLongestFilter = 1000;
  if (!options_.allow_benchmark || !options_.benchmark)
    co_return {to_grpc(absl::PermissionDeniedError("benchmarks are off: start the server with --allow-benchmark"))};
  if (request.filter().size() > kLongestFilter)
    co_return {
        to_grpc(invalid_field("filter", absl::StrCat(request.filter().size(), " bytes, at most ", kLongestFilter)))};
  if (const double s = request.min_seconds(); s != 0 && !(s > 0 && s <= 10))
    co_return {to_grpc(invalid_field("min_seconds", absl::StrCat(s, " is not in (0, 10], nor 0")))};
  if (benchmark_runs_.exchange(true))
    co_return {to_grpc(absl::ResourceExhaustedError("another benchmark runs: try again later"))};
  struct Done {
    std::atomic<bool>& runs;
    ~Done() { runs = false; }
  } done{benchmark_runs_};
  // It takes seconds, so it has a thread of its own.
  struct OnOwnThread {
    std::thread& thread;
    std::mutex& mutex;
    bool await_ready() const { return false; }
    void await_suspend(std::coroutine_handle<> call) {
      const std::lock_guard lock(mutex);
      if (thread.joinable()) thread.join();
      thread = std::thread([call] { call.resume(); });
    }
    void await_resume() const {}
  } on_own_thread{benchmark_thread_, benchmark_mutex_};
  co_await on_own_thread;
  const absl::Status status = options_.benchmark(request, [&](const v1::BenchmarkProgress& progress) {
    return !admission_.closed() && !call.cancelled() && wait_for(call.write(serialise(progress)));
  });
  if (!status.ok()) co_return {to_grpc(status)};
  if (call.cancelled()) co_return {to_grpc(cancelled())};
  co_return {admission_.closed() ? to_grpc(shuts_down()) : grpc::Status::OK};
}

}  // namespace facetwise
