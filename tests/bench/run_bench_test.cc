// SPDX-License-Identifier: Apache-2.0
// run_bench(): a small run from end to end, its errors, and how it is stopped.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "bench/runner.h"
#include "facetwise/bench.h"

namespace facetwise {
namespace {

BenchOptions small_run(std::string filter) {
  BenchOptions options;
  options.filter = std::move(filter);
  options.min_seconds = 0.01;
  return options;
}

TEST(RunBench, MeasuresWhatItIsAskedFor) {
  const auto engine = local_engine();
  auto options = small_run("^sample_reflection/(cap|exact)/0.8,0.1/4096/[a-z-]+$");
  options.remote = engine.get();
  std::vector<std::size_t> done;
  std::size_t total = 0;
  std::vector<std::string> reported;
  const auto report = run_bench(options, [&](const BenchProgress& progress) {
    total = progress.total;
    if (progress.result != nullptr) {
      EXPECT_EQ(progress.part, "throughput");
      done.push_back(progress.done);
      reported.push_back(progress.result->name());
    }
    return true;
  });
  ASSERT_TRUE(report.ok()) << report.status();
  // `auto` is compiled for some targets.
  const bool has_auto = bench::has_auto_loops(available_targets().front());
  const std::size_t expected = has_auto ? 12 : 10;
  EXPECT_EQ(total, expected);
  ASSERT_EQ(done.size(), expected);
  for (std::size_t k = 0; k < expected; ++k) EXPECT_EQ(done[k], k + 1);
  ASSERT_EQ(report->results.size(), expected);

  std::map<std::string, std::map<std::string, std::uint64_t>> rejected;
  for (std::size_t k = 0; k < report->results.size(); ++k) {
    const BenchResult& r = report->results[k];
    EXPECT_EQ(r.name(), reported[k]);
    EXPECT_EQ(r.batch, 4096u);
    EXPECT_EQ(r.samples, 4096u);
    EXPECT_EQ(r.repetitions, 5);
    // A tenth of a nanosecond to a tenth of a millisecond.
    EXPECT_GT(r.ns_per_sample, 0.05) << r.name();
    EXPECT_LT(r.ns_per_sample, 1e5) << r.name();
    EXPECT_LE(r.ns_per_sample_min, r.ns_per_sample);
    EXPECT_GT(r.ns_per_sample_min, 0);
    EXPECT_EQ(r.share_of_copy > 0, r.implementation != "remote") << r.name();
    EXPECT_EQ(r.share_of_fma > 0, r.implementation != "remote") << r.name();
    rejected[r.sampler][r.implementation] = r.rejected;
  }
  // The same lanes: the same rejections, up to the baseline's rounding.
  auto& cap = rejected["cap"];
  EXPECT_GT(cap["simd"], 400u);
  EXPECT_LT(cap["simd"], 900u);
  for (const char* implementation : {"one-lane", "simd-threads", "remote"}) EXPECT_EQ(cap[implementation], cap["simd"]);
  EXPECT_NEAR(static_cast<double>(cap["scalar"]), static_cast<double>(cap["simd"]), 3);
  if (has_auto) {
    EXPECT_NEAR(static_cast<double>(cap["auto"]), static_cast<double>(cap["simd"]), 3);
  }
  for (const char* implementation : {"one-lane", "simd", "simd-threads", "remote"})
    EXPECT_EQ(rejected["exact"].at(implementation), 0u) << implementation;

  // A filter leaves the other parts out; limits stay, one per width of the columns and number of threads.
  EXPECT_TRUE(report->rejections.empty());
  EXPECT_TRUE(report->targets.empty());
  const std::size_t kinds = report->threads > 1 ? 2 : 1;
  EXPECT_EQ(report->limits.copy.size(), 2 * kinds);
  EXPECT_EQ(report->limits.fma.size(), kinds);
  EXPECT_FALSE(report->machine.cpu.empty());
  EXPECT_EQ(report->machine.target, name(available_targets().front()));
  EXPECT_EQ(report->version, version());
}

TEST(RunBench, EveryOperationAndInputRuns) {
  auto options = small_run("/0.3,0.3/256/(scalar|simd)($|/)");
  options.limits = false;
  options.min_seconds = 0.002;
  const auto report = run_bench(options);
  ASSERT_TRUE(report.ok()) << report.status();
  // 20 operations with their samplers, and five further ways to give the inputs of five samplers; the
  // baseline has no generator.
  EXPECT_EQ(report->results.size(), 2 * (25u + 20u) - 5u);
  EXPECT_TRUE(report->limits.copy.empty());
  std::map<std::string, std::uint64_t> rejected;
  for (const BenchResult& r : report->results) {
    EXPECT_GT(r.ns_per_sample, 0) << r.name();
    EXPECT_EQ(r.share_of_copy, 0);
    rejected[r.name()] = r.rejected;
  }
  for (const auto& [name, count] : rejected) {
    const auto scalar = name.find("/scalar");
    if (scalar == std::string::npos) continue;
    std::string simd = name;
    simd.replace(scalar, 7, "/simd");
    EXPECT_NEAR(static_cast<double>(count), static_cast<double>(rejected[simd]), 3) << name;
  }
}

// The models' baselines run with the columns that the engine's samplers read, and lose about as many samples.
TEST(RunBench, EveryModelsBaselineRuns) {
  auto options = small_run("^sample_reflection/.*/mixed/65536/(scalar|simd)$");
  options.limits = false;
  options.min_seconds = 0.001;
  const auto report = run_bench(options);
  ASSERT_TRUE(report.ok()) << report.status();
  std::map<std::string, double> occluded;
  for (const BenchResult& r : report->results) occluded[r.name()] = r.share_occluded();
  int baselines = 0;
  for (const auto& [name, share] : occluded) {
    const auto scalar = name.find("/scalar");
    if (scalar == std::string::npos) continue;
    ++baselines;
    EXPECT_NEAR(share, occluded.at(name.substr(0, scalar) + "/simd"), 0.1) << name;
  }
  EXPECT_EQ(baselines, 5 + 16);  // GGX's with Smith masking, and all other models' but tables'
}

TEST(RunBench, TargetsAreForced) {
  for (const Target target : available_targets()) {
    auto options = small_run("bounded/0.3,0.3/4096/simd$");
    options.target = target;
    const auto report = run_bench(options);
    ASSERT_TRUE(report.ok()) << report.status();
    EXPECT_EQ(report->machine.target, name(target));
  }
}

TEST(RunBench, OptionsThatMeanNothingAreErrors) {
  const auto code = [](const BenchOptions& options) { return run_bench(options).status().code(); };
  auto options = small_run("bounded/0.3,0.3/256/simd$");
  options.min_seconds = 0;
  EXPECT_EQ(code(options), absl::StatusCode::kInvalidArgument);
  options.min_seconds = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(code(options), absl::StatusCode::kInvalidArgument);
  options.min_seconds = 10.1;
  EXPECT_EQ(code(options), absl::StatusCode::kInvalidArgument);
  options.min_seconds = 0.01;
  options.threads = -1;
  EXPECT_EQ(code(options), absl::StatusCode::kInvalidArgument);
  options.threads = 1;
  EXPECT_EQ(code(options), absl::StatusCode::kOk);
  options.target = available_targets().front() == Target::neon ? Target::avx2 : Target::neon;
  EXPECT_EQ(code(options), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(code(small_run("(")), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(code(small_run("nothing")), absl::StatusCode::kInvalidArgument);
}

TEST(RunBench, TakesGoogleBenchmarksFlags) {
  auto options = small_run("bounded/0.3,0.3/256/simd$");
  options.benchmark_flags = {"--benchmark_repetitions=2"};
  const auto report = run_bench(options);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->results.at(0).repetitions, 2);
  for (const char* flag :
       {"--benchmark_out=file", "--help", "--benchmark_repetitions=many", "--benchmark_repetitions"}) {
    options.benchmark_flags = {flag};
    EXPECT_EQ(run_bench(options).status().code(), absl::StatusCode::kInvalidArgument) << flag;
  }
}

TEST(RunBench, StopsAndRunsAgain) {
  const auto options = small_run("sample_reflection/.*/0.3,0.3/256/simd$");
  int results = 0;
  const auto stopped = run_bench(options, [&](const BenchProgress& p) { return p.result == nullptr || ++results < 2; });
  EXPECT_EQ(stopped.status().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(results, 2);
  const auto report = run_bench(options);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->results.size(), 5u);
}

TEST(RunBench, OneAtATime) {
  const auto options = small_run("bounded/0.3,0.3/256/simd$");
  absl::Status inner;
  const auto report = run_bench(options, [&](const BenchProgress&) {
    inner = run_bench(options).status();
    return true;
  });
  EXPECT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(inner.code(), absl::StatusCode::kFailedPrecondition);
}

class Unavailable final : public Engine {
 public:
  absl::StatusOr<Statistics> run(Operation, const Batch&) override { return absl::UnavailableError("gone"); }
  absl::StatusOr<std::size_t> compact(const Compaction&) override { return absl::UnavailableError("gone"); }
};

TEST(RunBench, RemoteErrorsAreItsOwn) {
  Unavailable engine;
  auto options = small_run("bounded/0.3,0.3/256/remote$");
  options.remote = &engine;
  const auto report = run_bench(options);
  EXPECT_EQ(report.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(report.status().message(), "gone");
}

}  // namespace
}  // namespace facetwise
