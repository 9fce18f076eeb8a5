// SPDX-License-Identifier: Apache-2.0
#include "app/transport.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>

#include "facetwise/channel.h"
#include "facetwise/column_memory.h"
#include "facetwise/engine.h"
#include "facetwise/shared_memory.h"
#include "facetwise/v1/sampler.pb.h"
#include "grpcpp/generic/generic_stub.h"
#include "grpcpp/grpcpp.h"
#include "wire/status.h"

namespace facetwise::app {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kWindow = 4, kRounds = 5, kDelays = 2000, kDelayLanes = 64;
constexpr std::size_t kRateLanes[] = {std::size_t{1} << 16, std::size_t{1} << 18};
constexpr std::size_t kCostLanes[] = {std::size_t{1} << 16, std::size_t{1} << 20};

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

// Of a lane at t in (0, 1): i, roughness, u1, u2.
std::array<float, 7> inputs_at(std::size_t lane, std::size_t lanes) {
  const float t = (static_cast<float>(lane) + 0.5f) / static_cast<float>(lanes);
  return {std::sqrt(1 - t * t),   0, t, 0.1f + 0.8f * t, 0.9f - 0.8f * t, std::fmod(97 * t, 1.0f),
          std::fmod(31 * t, 1.0f)};
}

// sample_reflection by `bounded`: every input a column, direction, pdf, weight and status back.
grpc::ByteBuffer request_of(std::size_t lanes) {
  v1::BatchRequest request;
  request.set_operation(v1::SAMPLE_REFLECTION);
  request.set_sampler(v1::BOUNDED);
  request.set_lanes(lanes);
  for (const v1::Output output : {v1::OUTGOING, v1::PDF, v1::WEIGHT, v1::STATUS}) request.add_outputs(output);
  std::vector<float> column(lanes);
  const auto filled = [&](std::size_t k) {
    for (std::size_t lane = 0; lane < lanes; ++lane) column[lane] = inputs_at(lane, lanes)[k];
    return std::string(reinterpret_cast<const char*>(column.data()), 4 * lanes);
  };
  request.mutable_incident()->set_x(filled(0));
  request.mutable_incident()->set_y(filled(1));
  request.mutable_incident()->set_z(filled(2));
  request.set_alpha_x(filled(3));
  request.set_alpha_y(filled(4));
  request.set_u1(filled(5));
  request.set_u2(filled(6));
  const grpc::Slice slice(request.SerializeAsString());
  return grpc::ByteBuffer(&slice, 1);
}

// Raw calls of one method, some at a time.
class Caller {
 public:
  Caller(const Channel& channel, std::string method)
      : channel_(channel), stub_(channel.channel), method_(std::move(method)) {}

  // One call; the answer's bytes.
  absl::StatusOr<std::size_t> once(const grpc::ByteBuffer& request) {
    Call call;
    start(call, request);
    wait();
    if (!call.status.ok()) return wire::from_grpc(call.status, channel_.address);
    return call.answer.Length();
  }

  // Answers a second.
  absl::StatusOr<double> rate(const grpc::ByteBuffer& request, bool streams, double seconds) {
    return streams ? stream_rate(request, seconds) : unary_rate(request, seconds);
  }

 private:
  struct Call {
    std::optional<grpc::ClientContext> context;
    std::unique_ptr<grpc::ClientAsyncResponseReader<grpc::ByteBuffer>> reader;
    std::unique_ptr<grpc::GenericClientAsyncReaderWriter> stream;
    grpc::ByteBuffer answer;
    grpc::Status status;
    bool writes = false;
  };

  void start(Call& call, const grpc::ByteBuffer& request) {
    call.context.emplace();
    channel_.authorise(*call.context);
    call.answer.Clear();
    call.reader = stub_.PrepareUnaryCall(&*call.context, method_, request, &queue_);
    call.reader->StartCall();
    call.reader->Finish(&call.answer, &call.status, &call);
  }
  // The next call that got further. Null: it failed.
  Call* wait() {
    void* tag = nullptr;
    bool good = false;
    return queue_.Next(&tag, &good) && good ? static_cast<Call*>(tag) : nullptr;
  }

  absl::StatusOr<double> unary_rate(const grpc::ByteBuffer& request, double seconds) {
    std::vector<Call> calls(kWindow);
    const auto begin = Clock::now();
    for (Call& call : calls) start(call, request);
    std::size_t answers = 0;
    grpc::Status status;
    for (int in_flight = kWindow; in_flight > 0;) {
      Call* call = wait();
      if (call == nullptr || !call->status.ok()) {
        if (call != nullptr) status = call->status;
        --in_flight;
        continue;
      }
      ++answers;
      if (seconds_since(begin) < seconds && status.ok())
        start(*call, request);
      else
        --in_flight;
    }
    if (!status.ok()) return wire::from_grpc(status, channel_.address);
    return static_cast<double>(answers) / seconds_since(begin);
  }

  absl::StatusOr<double> stream_rate(const grpc::ByteBuffer& request, double seconds) {
    std::vector<Call> calls(kWindow);
    for (Call& call : calls) {
      call.context.emplace();
      channel_.authorise(*call.context);
      call.stream = stub_.PrepareCall(&*call.context, method_, &queue_);
      call.stream->StartCall(&call);
    }
    for (int n = 0; n < kWindow; ++n) wait();
    const auto write = [&](Call& call) {
      call.writes = true;
      call.stream->Write(request, &call);
    };
    const auto begin = Clock::now();
    for (Call& call : calls) write(call);
    std::size_t answers = 0;
    bool failed = false;
    for (int open = kWindow; open > 0;) {
      Call* call = wait();
      if (call == nullptr) {
        failed = true;
        --open;
        continue;
      }
      if (call->writes) {
        call->writes = false;
        call->answer.Clear();
        call->stream->Read(&call->answer, call);
        continue;
      }
      ++answers;
      if (seconds_since(begin) < seconds)
        write(*call);
      else
        --open;
    }
    const double rate = static_cast<double>(answers) / seconds_since(begin);
    for (Call& call : calls) {
      call.context->TryCancel();
      call.stream->Finish(&call.status, &call);
    }
    for (int n = 0; n < kWindow; ++n) wait();
    for (const Call& call : calls)
      if (failed && !call.status.ok()) return wire::from_grpc(call.status, channel_.address);
    return rate;
  }

  const Channel& channel_;
  grpc::GenericStub stub_;
  const std::string method_;
  grpc::CompletionQueue queue_;
};

class Measurement {
 public:
  Measurement(const TransportOptions& options, const std::function<void(double)>& progress)
      : options_(options), progress_(progress) {
    steps_ =
        options.pairs.size() * (2 * std::size(kRateLanes) + 1) + std::size(kCostLanes) * (3 + 3 * options.pairs.size());
  }

  absl::StatusOr<TransportResult> run() {
    for (const TransportPair& pair : options_.pairs)
      if (auto status = measure(pair); !status.ok()) return status;
    for (const std::size_t lanes : kCostLanes)
      if (auto status = costs(lanes); !status.ok()) return status;
    return result_;
  }

 private:
  void step() { progress_(static_cast<double>(++done_) / static_cast<double>(steps_)); }

  absl::Status measure(const TransportPair& pair) {
    const auto echo = open_channel(pair.echo, pair.connection),
               facetwise = open_channel(pair.facetwise, pair.connection);
    if (!echo.ok()) return echo.status();
    if (!facetwise.ok()) return facetwise.status();
    for (const Channel* channel : {&*echo, &*facetwise})
      if (!channel->channel->WaitForConnected(std::chrono::system_clock::now() + std::chrono::seconds(5)))
        return absl::UnavailableError("server " + channel->address + ": no answer within 5 s");
    for (const std::size_t lanes : kRateLanes) {
      const grpc::ByteBuffer request = request_of(lanes);
      const auto answer = Caller(*facetwise, "/facetwise.v1.Sampler/Run").once(request);
      if (!answer.ok()) return answer.status();
      for (const bool streams : {false, true}) {
        Caller empty(*echo, "/echo/" + std::to_string(*answer));
        Caller full(*facetwise, streams ? "/facetwise.v1.Sampler/RunStream" : "/facetwise.v1.Sampler/Run");
        std::vector<double> of_echo, of_facetwise, ratios;
        for (int round = 0; round < kRounds; ++round) {
          const auto a = empty.rate(request, streams, options_.seconds),
                     b = full.rate(request, streams, options_.seconds);
          if (!a.ok()) return a.status();
          if (!b.ok()) return b.status();
          of_echo.push_back(*a * static_cast<double>(lanes) * 1e-6);
          of_facetwise.push_back(*b * static_cast<double>(lanes) * 1e-6);
          ratios.push_back(*b / *a);
        }
        result_.rates.push_back({pair.name, streams, lanes, median(of_echo), median(of_facetwise), median(ratios)});
        step();
      }
    }
    return delays(pair, *echo, *facetwise);
  }

  absl::Status delays(const TransportPair& pair, const Channel& echo, const Channel& facetwise) {
    const grpc::ByteBuffer request = request_of(kDelayLanes);
    Caller full(facetwise, "/facetwise.v1.Sampler/Run");
    const auto bytes = full.once(request);
    if (!bytes.ok()) return bytes.status();
    Caller empty(echo, "/echo/" + std::to_string(*bytes));
    std::vector<double> times[2];
    // In turn, so that both meet what else the machine does.
    for (int n = 0; n < kDelays; ++n)
      for (int k = 0; k < 2; ++k) {
        const auto begin = Clock::now();
        if (const auto answer = (k == 0 ? empty : full).once(request); !answer.ok()) return answer.status();
        times[k].push_back(1e6 * seconds_since(begin));
      }
    for (auto& sorted : times) std::sort(sorted.begin(), sorted.end());
    const auto at = [&](int k, double p) { return times[k][static_cast<std::size_t>(p * kDelays)]; };
    result_.delays.push_back({pair.name, at(0, 0.5), at(0, 0.99), at(1, 0.5), at(1, 0.99)});
    step();
    return absl::OkStatus();
  }

  // In the columns given: as request_of(), or with one roughness and the library's numbers.
  static Batch batch_in(const ColumnMemory& columns, bool small) {
    const std::size_t lanes = columns.lanes();
    const auto column = [&](std::size_t k) { return std::span(columns[k], lanes); };
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      const std::array<float, 7> values = inputs_at(lane, lanes);
      for (std::size_t k = 0; k < std::size(values); ++k) columns[k][lane] = values[k];
    }
    Batch batch;
    batch.lanes = lanes;
    batch.sampler = Sampler::bounded;
    batch.incident = {column(0), column(1), column(2)};
    if (small) {
      batch.alpha_x = batch.alpha_y = 0.3f;
      batch.generator = {.seed = 1};
    } else {
      batch.alpha_x = column(3), batch.alpha_y = column(4);
      batch.u1 = column(5), batch.u2 = column(6);
    }
    batch.out.outgoing = {column(7), column(8), column(9)};
    batch.out.pdf = column(10), batch.out.weight = column(11);
    batch.out.status = {reinterpret_cast<std::uint8_t*>(columns[12]), lanes};
    return batch;
  }

  absl::Status cost(const std::string& way, Engine& engine, const Batch& batch) {
    std::vector<double> times;
    for (int round = 0; round < kRounds; ++round) {
      const auto begin = Clock::now();
      std::size_t calls = 0;
      for (; calls == 0 || seconds_since(begin) < options_.seconds / 2; ++calls)
        if (const auto status = engine.sample_reflection(batch).status(); !status.ok()) return status;
      times.push_back(1e9 * seconds_since(begin) / static_cast<double>(calls * batch.lanes));
    }
    result_.costs.push_back({way, batch.lanes, median(times)});
    step();
    return absl::OkStatus();
  }

  absl::Status costs(std::size_t lanes) {
    constexpr std::size_t kColumns = 13;
    const ColumnMemory columns(kColumns, lanes);
    const Batch batch = batch_in(columns, false), small = batch_in(columns, true);
    if (auto status = cost("here, one thread", *local_engine({.threads = Threads::one}), batch); !status.ok())
      return status;
    if (auto status = cost("here", *local_engine(), batch); !status.ok()) return status;
    for (const TransportPair& pair : options_.pairs) {
      const auto engine = connect(std::span(&pair.facetwise, 1), pair.connection);
      if (!engine.ok()) return engine.status();
      if (auto status = cost(pair.name, **engine, batch); !status.ok()) return status;
      if (auto status = cost(pair.name + ", one roughness, library's numbers", **engine, small); !status.ok())
        return status;
      ConnectOptions compact = pair.connection;
      compact.compact_answers = true;
      const auto compact_engine = connect(std::span(&pair.facetwise, 1), compact);
      if (!compact_engine.ok()) return compact_engine.status();
      if (auto status = cost(pair.name + ", the same, compact answers", **compact_engine, small); !status.ok())
        return status;
    }
    if (options_.shared.empty()) return absl::OkStatus();
    auto memory = SharedMemory::make(ColumnMemory::bytes(kColumns, lanes));
    if (!memory.ok()) return memory.status();
    const auto engine = connect(std::span(&options_.shared, 1), {.shared_memory = *memory});
    if (!engine.ok()) return engine.status();
    return cost("shared memory", **engine, batch_in(ColumnMemory((*memory)->data(), kColumns, lanes), false));
  }

  const TransportOptions& options_;
  const std::function<void(double)>& progress_;
  std::size_t steps_, done_ = 0;
  TransportResult result_;
};

}  // namespace

absl::StatusOr<TransportResult> measure_transport(const TransportOptions& options,
                                                  const std::function<void(double)>& progress) {
  return Measurement(options, progress).run();
}

}  // namespace facetwise::app
