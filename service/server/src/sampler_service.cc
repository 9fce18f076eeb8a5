#include "src/sampler_service.h"

#include "absl/strings/str_cat.h"
#include "facetwise/engine.h"
#include "facetwise/slope_table.h"
#include "src/machine.h"
#include "wire/status.h"

namespace facetwise {
namespace {

using grpc::internal::RpcMethod;
using grpc::internal::RpcServiceMethod;
using wire::to_grpc;

grpc::Status error(grpc::StatusCode code, const std::string& message) { return {code, message}; }

void describe(const Tables::Entry& entry, v1::SlopeTableInfo& info) {
  info.set_id(entry.table->id());
  info.set_bytes(entry.table->bytes());
  info.set_radial(entry.table->radial());
  info.set_idle_seconds(entry.idle.count());
}

}  // namespace

SamplerService::SamplerService(const ServerOptions& options)
    : options_(options),
      limits_{options.max_message_bytes},
      admission_(options.max_calls, options.max_bytes_in_flight),
      compute_(options.threads, options.execution),
      tables_(options.max_tables_bytes, options.table_idle_timeout),
      tokens_(options.token_file) {
  add("/facetwise.v1.Sampler/Run", answer_batch, Messages::one);
  add("/facetwise.v1.Sampler/RunStream", answer_batch, Messages::many);
  add("/facetwise.v1.Sampler/Compact", answer_compact, Messages::one);
  add("/facetwise.v1.Sampler/CompactStream", answer_compact, Messages::many);
  AddMethod(new RpcServiceMethod(
      "/facetwise.v1.Sampler/UploadTable", RpcMethod::CLIENT_STREAMING,
      new grpc::internal::ClientStreamingHandler<SamplerService, v1::TableChunk, v1::SlopeTableInfo>(
          [](SamplerService* service, grpc::ServerContext* context, grpc::ServerReader<v1::TableChunk>* reader,
             v1::SlopeTableInfo* response) { return service->upload_table(*context, *reader, *response); },
          this)));
  add_small("/facetwise.v1.Sampler/ListTables", &SamplerService::list_tables);
  add_small("/facetwise.v1.Sampler/DeleteTable", &SamplerService::delete_table);
  add_small("/facetwise.v1.Sampler/Info", &SamplerService::info);
  AddMethod(new RpcServiceMethod(
      "/facetwise.v1.Sampler/Benchmark", RpcMethod::SERVER_STREAMING,
      new grpc::internal::ServerStreamingHandler<SamplerService, v1::BenchmarkRequest, v1::BenchmarkProgress>(
          [](SamplerService* service, grpc::ServerContext* context, const v1::BenchmarkRequest* request,
             grpc::ServerWriter<v1::BenchmarkProgress>* writer) {
            return service->benchmark(*context, *request, *writer);
          },
          this)));
}

template <class Request, class Response>
void SamplerService::add_small(const char* name, grpc::Status (SamplerService::*answer)(const Request&, Response&)) {
  AddMethod(new RpcServiceMethod(
      name, RpcMethod::NORMAL_RPC,
      new grpc::internal::RpcMethodHandler<SamplerService, Request, Response>(
          [answer](SamplerService* service, grpc::ServerContext* context, const Request* request, Response* response) {
            const auto status = service->tokens_.check(*context);
            return status.ok() ? (service->*answer)(*request, *response) : to_grpc(status);
          },
          this)));
}

void SamplerService::add(const char* name, Answer answer, Messages messages) {
  AddMethod(
      new RpcServiceMethod(name, RpcMethod::BIDI_STREAMING,
                           new grpc::internal::BidiStreamingHandler<SamplerService, grpc::ByteBuffer, grpc::ByteBuffer>(
                               [=](SamplerService* service, grpc::ServerContext* context, Stream* stream) {
                                 return messages == Messages::one ? service->answer_one(answer, *context, *stream)
                                                                  : service->answer_many(answer, *context, *stream);
                               },
                               this)));
}

grpc::Status SamplerService::answer_one(Answer answer, grpc::ServerContext& context, Stream& stream) {
  if (auto status = tokens_.check(context); !status.ok()) return to_grpc(status);
  Admission::Ticket ticket(admission_);
  if (!ticket.status().ok()) return to_grpc(ticket.status());
  grpc::ByteBuffer request, another;
  {
    const Watch::Reading reading(watch_, context, options_.read_timeout);
    if (!stream.Read(&request) || context.IsCancelled()) return grpc::Status::CANCELLED;
    // A call of one message ends its side with it.
    if (stream.Read(&another))
      return error(grpc::StatusCode::INVALID_ARGUMENT, "message: more than one, in a call that takes one");
    if (context.IsCancelled()) return grpc::Status::CANCELLED;
  }
  auto answered = answer(request, {limits_, compute_, tables_, ticket, watch_, context});
  if (!answered.ok()) return to_grpc(answered.status());
  stream.WriteLast(*answered, {});
  return grpc::Status::OK;
}

grpc::Status SamplerService::answer_many(Answer answer, grpc::ServerContext& context, Stream& stream) {
  if (auto status = tokens_.check(context); !status.ok()) return to_grpc(status);
  Admission::Ticket ticket(admission_);
  if (!ticket.status().ok()) return to_grpc(ticket.status());
  for (grpc::ByteBuffer request;;) {
    {
      const Watch::Reading reading(watch_, context, options_.stream_idle_timeout);
      if (!stream.Read(&request)) return context.IsCancelled() ? grpc::Status::CANCELLED : grpc::Status::OK;
    }
    if (context.IsCancelled()) return grpc::Status::CANCELLED;
    auto answered = answer(request, {limits_, compute_, tables_, ticket, watch_, context});
    if (!answered.ok()) return to_grpc(answered.status());
    if (!stream.Write(*answered)) return grpc::Status::CANCELLED;  // the client has gone
    ticket.release();
    if (admission_.closed()) return error(grpc::StatusCode::UNAVAILABLE, "the server is shutting down");
  }
}

grpc::Status SamplerService::upload_table(grpc::ServerContext& context, grpc::ServerReader<v1::TableChunk>& reader,
                                          v1::SlopeTableInfo& response) {
  if (auto status = tokens_.check(context); !status.ok()) return to_grpc(status);
  Admission::Ticket ticket(admission_);
  if (!ticket.status().ok()) return to_grpc(ticket.status());
  v1::TableChunk chunk;
  const auto read = [&] {
    const Watch::Reading reading(watch_, context, options_.read_timeout);
    return reader.Read(&chunk) && !context.IsCancelled();
  };
  const auto invalid = [](const std::string& message) { return error(grpc::StatusCode::INVALID_ARGUMENT, message); };
  if (!read()) return context.IsCancelled() ? grpc::Status::CANCELLED : invalid("message: none");
  const std::uint64_t id = chunk.id(), bytes = chunk.bytes();
  if (auto kept = tables_.find(id)) {
    describe({kept, {}}, response);
    return grpc::Status::OK;
  }
  if (bytes > options_.max_table_bytes)
    return invalid(absl::StrCat("bytes: ", bytes, " are above the limit of ", options_.max_table_bytes));
  // As received, and as read.
  if (auto status = ticket.hold(2 * bytes); !status.ok()) return to_grpc(status);
  std::string data;
  data.reserve(bytes);
  do {
    if (chunk.data().size() > bytes - data.size())
      return invalid(absl::StrCat("data: more than the ", bytes, " bytes that were announced"));
    data += chunk.data();
  } while (data.size() < bytes && read());
  if (context.IsCancelled()) return grpc::Status::CANCELLED;
  if (data.size() < bytes) return invalid(absl::StrCat("data: ", data.size(), " of the ", bytes, " bytes announced"));
  const auto table = SlopeTable::parse(data);
  if (!table.ok())
    return to_grpc(absl::Status(table.status().code(), absl::StrCat("data: ", table.status().message())));
  if ((*table)->id() != id) return invalid("id: not that of the table");
  if (auto status = tables_.put(*table); !status.ok()) return to_grpc(status);
  describe({*table, {}}, response);
  return grpc::Status::OK;
}

grpc::Status SamplerService::list_tables(const v1::ListTablesRequest&, v1::ListTablesResponse& response) {
  for (const Tables::Entry& entry : tables_.list()) describe(entry, *response.add_tables());
  response.set_max_bytes(tables_.max_bytes());
  response.set_max_idle_seconds(std::chrono::duration<double>(tables_.max_idle()).count());
  return grpc::Status::OK;
}

grpc::Status SamplerService::delete_table(const v1::DeleteTableRequest& request, v1::DeleteTableResponse&) {
  if (tables_.erase(request.id())) return grpc::Status::OK;
  return error(grpc::StatusCode::NOT_FOUND,
               absl::StrCat("id: no table ", absl::Hex(request.id(), absl::kZeroPad16), " here"));
}

grpc::Status SamplerService::info(const v1::InfoRequest&, v1::InfoResponse& response) {
  const std::string_view release = version();
  response.set_version(std::string(release));
  response.set_target(std::string(name(resolve(compute_.execution().target).value_or(Target::best))));
  for (const Target target : available_targets()) response.add_available_targets(std::string(name(target)));
  response.set_threads(compute_.threads());
  response.set_max_message_bytes(options_.max_message_bytes);
  static const std::string cpu = cpu_name();
  response.set_cpu(cpu);
  response.set_benchmark_allowed(options_.allow_benchmark && options_.benchmark);
  return grpc::Status::OK;
}

grpc::Status SamplerService::benchmark(grpc::ServerContext& context, const v1::BenchmarkRequest& request,
                                       grpc::ServerWriter<v1::BenchmarkProgress>& writer) {
  if (auto status = tokens_.check(context); !status.ok()) return to_grpc(status);
  constexpr std::size_t kLongestFilter = 1000;
  if (!options_.allow_benchmark || !options_.benchmark)
    return error(grpc::StatusCode::PERMISSION_DENIED, "benchmarks are off: start the server with --allow-benchmark");
  if (request.filter().size() > kLongestFilter)
    return error(grpc::StatusCode::INVALID_ARGUMENT,
                 absl::StrCat("filter: ", request.filter().size(), " bytes, at most ", kLongestFilter));
  if (const double s = request.min_seconds(); s != 0 && !(s > 0 && s <= 10))
    return error(grpc::StatusCode::INVALID_ARGUMENT, absl::StrCat("min_seconds: ", s, " is not in (0, 10], nor 0"));
  Admission::Ticket ticket(admission_);
  if (!ticket.status().ok()) return to_grpc(ticket.status());
  if (benchmark_runs_.exchange(true))
    return error(grpc::StatusCode::RESOURCE_EXHAUSTED, "another benchmark runs: try again later");
  struct Done {
    std::atomic<bool>& runs;
    ~Done() { runs = false; }
  } done{benchmark_runs_};
  const absl::Status status = options_.benchmark(request, [&](const v1::BenchmarkProgress& progress) {
    return !admission_.closed() && !context.IsCancelled() && writer.Write(progress);
  });
  if (!status.ok()) return to_grpc(status);
  if (context.IsCancelled()) return grpc::Status::CANCELLED;
  if (admission_.closed()) return error(grpc::StatusCode::UNAVAILABLE, "the server is shutting down");
  return grpc::Status::OK;
}

}  // namespace facetwise
