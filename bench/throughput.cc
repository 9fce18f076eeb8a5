// SPDX-License-Identifier: Apache-2.0
#include "throughput.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "machine_limits.h"
#include "runner.h"

namespace facetwise::bench {
namespace {

bool flag_is_set(const std::vector<std::string>& flags, absl::string_view name) {
  return std::any_of(flags.begin(), flags.end(),
                     [&](const std::string& flag) { return absl::StartsWith(flag, absl::StrCat("--", name, "=")); });
}

// Nanoseconds per iteration of every repetition, by benchmark name.
class Times : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context&) override { return true; }
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration || run.error_occurred || run.iterations == 0) continue;
      times_[run.run_name.function_name].push_back(1e9 * run.real_accumulated_time /
                                                   static_cast<double>(run.iterations));
    }
  }
  // Sorted.
  std::vector<double> of(const std::string& name) {
    std::vector<double>& times = times_[name];
    std::sort(times.begin(), times.end());
    return times;
  }

 private:
  std::map<std::string, std::vector<double>> times_;
};

double median(const std::vector<double>& sorted) {
  const std::size_t half = sorted.size() / 2;
  return sorted.size() % 2 == 1 ? sorted[half] : (sorted[half - 1] + sorted[half]) / 2;
}

// The registered benchmarks of a group.
class Group {
 public:
  Group(const BenchOptions& options, std::size_t batch) : options_(options) {
    // A repetition of the largest batches takes many times its share of min_seconds.
    repetitions_ = batch >= (std::size_t{1} << 24) ? 3 : 5;
    benchmark::ClearRegisteredBenchmarks();
  }
  ~Group() { benchmark::ClearRegisteredBenchmarks(); }
  Group(const Group&) = delete;
  Group& operator=(const Group&) = delete;

  // `once` is timed. Its first error ends its benchmark and is the group's.
  void add(const std::string& name, std::function<absl::Status()> once) {
    auto* registered =
        benchmark::RegisterBenchmark(name.c_str(), [this, once = std::move(once)](benchmark::State& state) {
          for (auto _ : state) {
            if (const absl::Status status = once(); !status.ok()) {
              status_.Update(status);
              state.SkipWithError(std::string(status.message()).c_str());
              break;
            }
          }
        });
    registered->UseRealTime();
    const double repetitions = repetitions_;
    if (!flag_is_set(options_.benchmark_flags, "benchmark_repetitions")) registered->Repetitions(repetitions_);
    if (!flag_is_set(options_.benchmark_flags, "benchmark_min_time"))
      registered->MinTime(options_.min_seconds / repetitions);
  }

  absl::Status run(Times& times) {
    benchmark::RunSpecifiedBenchmarks(&times, ".");
    return status_;
  }

 private:
  const BenchOptions& options_;
  int repetitions_;
  absl::Status status_;
};

// Copying is measured with columns that are placed kindly; of fresh ones, over all of them.
const CopyLimit* find_copy(const BenchLimits& limits, const Case& which, int threads) {
  for (const CopyLimit& copy : limits.copy)
    if (copy.inputs == which.input_columns() && copy.outputs == which.output_columns() && copy.batch == which.lanes() &&
        copy.threads == threads)
      return &copy;
  return nullptr;
}

std::string copy_name(bool all_threads, CopyOrder order) {
  return absl::StrCat("copy/", all_threads ? "threads/" : "thread/", static_cast<int>(order));
}
constexpr CopyOrder kOrders[] = {CopyOrder::one_by_one, CopyOrder::side_by_side, CopyOrder::streaming};
static_assert(std::size(kOrders) == kCopyOrders);

// The fastest order.
double copy_time(Times& times, bool all_threads) {
  double best = 0;
  for (const CopyOrder order : kOrders) {
    const double time = median(times.of(copy_name(all_threads, order)));
    if (best == 0 || time < best) best = time;
  }
  return best;
}

int threads_of(Implementation implementation, int all) {
  switch (implementation) {
    case Implementation::remote: return 0;
    case Implementation::simd_threads: return all;
    default: return 1;
  }
}

// Shares of the limits measured so far.
void compare_with_limits(const Case& which, const BenchLimits& limits, BenchResult& result) {
  if (result.threads == 0) return;
  if (const CopyLimit* copy = find_copy(limits, which, result.threads))
    result.share_of_copy = copy->ns_per_sample / result.ns_per_sample;
  for (const FmaLimit& fma : limits.fma)
    if (fma.threads == result.threads)
      result.share_of_fma = flops(which) * result.samples_per_second() / fma.flops_per_second;
}

}  // namespace

absl::Status set_benchmark_flags(const std::vector<std::string>& flags) {
  constexpr absl::string_view kTaken[] = {"benchmark_repetitions", "benchmark_min_time",
                                          "benchmark_enable_random_interleaving", "v"};
  // Flags are the process's: what an earlier run may have set is set back.
  std::vector<std::string> storage = {"facetwise", "--benchmark_enable_random_interleaving=true", "--v=0"};
  for (const std::string& flag : flags) {
    const bool taken = std::any_of(std::begin(kTaken), std::end(kTaken), [&](absl::string_view name) {
      return absl::StartsWith(flag, absl::StrCat("--", name, "="));
    });
    if (!taken)
      return absl::InvalidArgumentError(absl::StrCat(
          "benchmark flag \"", flag, "\": of Google Benchmark's flags, those that change how a measurement runs ",
          "are taken: --benchmark_repetitions=N, --benchmark_min_time=SECONDS, ",
          "--benchmark_enable_random_interleaving=BOOL, --v=LEVEL"));
    storage.push_back(flag);
  }
  std::vector<char*> argv;
  for (std::string& argument : storage) argv.push_back(argument.data());
  int argc = static_cast<int>(argv.size());
  argv.push_back(nullptr);
  benchmark::Initialize(&argc, argv.data());
  // It leaves what it cannot parse.
  if (argc > 1)
    return absl::InvalidArgumentError(absl::StrCat("benchmark flag \"", argv[1], "\": not a value that fits"));
  return absl::OkStatus();
}

absl::Status measure_throughput(const BenchOptions& options, const std::vector<Case>& cases, Columns& columns,
                                const std::function<bool(const BenchResult&)>& done, BenchReport& report) {
  for (auto first = cases.begin(); first != cases.end();) {
    const auto last = std::find_if_not(first, cases.end(), [&](const Case& which) { return which.comparable(*first); });
    if (const auto status = columns.prepare(*first); !status.ok()) return status;

    Group group(options, first->lanes());
    std::vector<std::optional<std::uint64_t>> rejected(static_cast<std::size_t>(last - first));
    for (auto which = first; which != last; ++which) {
      std::optional<std::uint64_t>& count = rejected[static_cast<std::size_t>(which - first)];
      group.add(std::string(name(which->implementation)),
                [once = make_runner(*which, columns, options.target, options.remote), &count]() -> absl::Status {
                  const auto occluded = once();
                  if (!occluded.ok()) return occluded.status();
                  if (!count) count = *occluded;  // of the first batch, where they differ
                  return absl::OkStatus();
                });
    }
    std::vector<bool> copies;  // of one thread, of all
    if (options.limits) {
      copies.push_back(false);
      if (report.threads > 1) copies.push_back(true);
      std::erase_if(copies,
                    [&](bool all) { return find_copy(report.limits, *first, all ? report.threads : 1) != nullptr; });
    }
    for (const bool all : copies)
      for (const CopyOrder order : kOrders)
        group.add(copy_name(all, order), [copy = make_copy(columns, first->input_columns(), first->output_columns(),
                                                           first->lanes(), options.target, all, order)] {
          copy();
          return absl::OkStatus();
        });

    Times times;
    if (const auto status = group.run(times); !status.ok()) return status;
    const double batch = static_cast<double>(first->batch);
    for (const bool all : copies)
      report.limits.copy.push_back({.inputs = first->input_columns(),
                                    .outputs = first->output_columns(),
                                    .batch = first->lanes(),
                                    .threads = all ? report.threads : 1,
                                    .ns_per_sample = copy_time(times, all) / static_cast<double>(first->lanes())});
    for (auto which = first; which != last; ++which) {
      const auto sorted = times.of(std::string(name(which->implementation)));
      if (sorted.empty()) return absl::InternalError(absl::StrCat(describe(*which).name(), ": not measured"));
      BenchResult result = describe(*which);
      result.threads = threads_of(which->implementation, report.threads);
      result.repetitions = static_cast<int>(sorted.size());
      result.ns_per_sample = median(sorted) / batch;
      result.ns_per_sample_min = sorted.front() / batch;
      result.rejected = *rejected[static_cast<std::size_t>(which - first)];
      compare_with_limits(*which, report.limits, result);
      report.results.push_back(result);
      if (!done(report.results.back())) return absl::CancelledError("the benchmarks were stopped");
    }
    first = last;
  }
  return absl::OkStatus();
}

}  // namespace facetwise::bench
