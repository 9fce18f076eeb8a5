// SPDX-License-Identifier: Apache-2.0
#include "app/benchmark_messages.h"

#include <fmt/format.h>
#include <grpcpp/grpcpp.h>

#include <chrono>

#include "facetwise/channel.h"
#include "facetwise/v1/sampler.grpc.pb.h"

namespace facetwise::app {
namespace {

v1::BenchmarkResult to_message(const BenchResult& result) {
  v1::BenchmarkResult message;
  message.set_operation(std::string(name(result.operation)));
  message.set_distribution(result.distribution);
  message.set_masking(result.masking);
  message.set_sampler(result.sampler);
  message.set_alpha_x(result.alpha_x);
  message.set_alpha_y(result.alpha_y);
  message.set_implementation(result.implementation);
  message.set_batch(result.batch);
  message.set_ns_per_sample(result.ns_per_sample);
  message.set_samples_per_second(result.samples_per_second());
  message.set_rejected(result.rejected);
  message.set_samples(result.samples);
  message.set_inputs(result.inputs);
  return message;
}

BenchResult from_message(const v1::BenchmarkResult& message) {
  BenchResult result;
  result.operation = parse_operation(message.operation()).value_or(Operation::sample_reflection);
  result.distribution = message.distribution();
  result.masking = message.masking();
  result.sampler = message.sampler();
  result.alpha_x = message.alpha_x();
  result.alpha_y = message.alpha_y();
  result.implementation = message.implementation();
  result.inputs = message.inputs();
  result.batch = message.batch();
  result.ns_per_sample = message.ns_per_sample();
  result.rejected = message.rejected();
  result.samples = message.samples();
  return result;
}

}  // namespace

BenchmarkRunner benchmark_runner(Target target, int threads) {
  return [target, threads](const v1::BenchmarkRequest& request, const BenchmarkReport& report) -> absl::Status {
    BenchOptions options;
    options.filter = request.filter();
    if (request.min_seconds() > 0) options.min_seconds = request.min_seconds();
    options.threads = threads;
    options.target = target;
    options.limits = options.rejections = options.targets = false;
    const auto result = run_bench(options, [&](const BenchProgress& progress) {
      v1::BenchmarkProgress message;
      message.set_done(static_cast<std::uint32_t>(progress.done));
      message.set_total(static_cast<std::uint32_t>(progress.total));
      if (progress.result != nullptr) *message.mutable_result() = to_message(*progress.result);
      return report(message);
    });
    // Cancelled is what `report` asked for.
    return result.ok() || absl::IsCancelled(result.status()) ? absl::OkStatus() : result.status();
  };
}

absl::StatusOr<BenchReport> benchmark_server(const std::string& address, const ConnectOptions& options,
                                             const std::string& filter, double min_seconds,
                                             const BenchCallback& progress) {
  constexpr std::chrono::seconds kPatience{5};
  const auto failed = [&](const grpc::Status& status) {
    return absl::UnavailableError(fmt::format("server {}: {}", address, status.error_message()));
  };
  const auto channel = open_channel(address, options);
  if (!channel.ok()) return channel.status();
  v1::InfoResponse info;
  if (const auto status = ask_info(*channel, std::chrono::system_clock::now() + kPatience, false, info); !status.ok())
    return failed(status);
  BenchReport report;
  report.version = info.version();
  report.machine = {info.cpu(), info.threads(), info.target()};
  report.threads = static_cast<int>(info.threads());

  grpc::ClientContext context;
  channel->authorise(context);
  v1::BenchmarkRequest request;
  request.set_filter(filter);
  request.set_min_seconds(min_seconds);
  const auto stub = v1::Sampler::NewStub(channel->channel);
  const auto reader = stub->Benchmark(&context, request);
  for (v1::BenchmarkProgress message; reader->Read(&message);) {
    BenchProgress now{.done = message.done(), .total = message.total(), .result = nullptr, .part = "throughput"};
    if (message.has_result()) now.result = &report.results.emplace_back(from_message(message.result()));
    if (progress && !progress(now)) context.TryCancel();
  }
  if (const auto status = reader->Finish(); !status.ok()) return failed(status);
  return report;
}

}  // namespace facetwise::app
