// SPDX-License-Identifier: Apache-2.0
// run_bench(): checks the options and runs the parts one after another.
#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <new>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "case.h"
#include "columns.h"
#include "facetwise/bench.h"
#include "machine.h"
#include "machine_limits.h"
#include "rejection.h"
#include "targets.h"
#include "throughput.h"

namespace facetwise {
namespace {

using namespace bench;

absl::Status check_options(const BenchOptions& options) {
  if (!(options.min_seconds > 0 && options.min_seconds <= 10))
    return absl::InvalidArgumentError(absl::StrCat("min_seconds: ", options.min_seconds, " is not in (0, 10]"));
  if (options.threads < 0 || options.threads > 4096)
    return absl::InvalidArgumentError(absl::StrCat("threads: ", options.threads, " is not in [0, 4096]"));
  if (!resolve(options.target)) {
    const std::string_view wanted = name(options.target);
    return absl::FailedPreconditionError(
        absl::StrCat("target: this CPU or build has no ", absl::string_view(wanted.data(), wanted.size())));
  }
  return absl::OkStatus();
}

absl::Status run_parts(const BenchOptions& options, const std::vector<Case>& cases, const BenchCallback& progress,
                       BenchReport& report) {
  BenchProgress now{.done = 0, .total = cases.size(), .result = nullptr, .part = "limits"};
  const std::function<bool()> step = [&] { return !progress || progress(now); };
  const auto stopped = [] { return absl::CancelledError("the benchmarks were stopped"); };
  const bool whole = options.filter.empty();
  const bool targets = options.targets && whole, rejections = options.rejections && whole;

  if (options.limits) {
    if (!step()) return stopped();
    report.limits.fma.push_back(measure_fma(*resolve(options.target), 1));
    if (report.threads > 1) report.limits.fma.push_back(measure_fma(*resolve(options.target), report.threads));
  }

  std::size_t lanes = 0, malloc_lanes = 0;
  for (const Case& which : cases) {
    lanes = std::max(lanes, which.lanes());
    if (which.inputs == Inputs::malloc_placed) malloc_lanes = std::max(malloc_lanes, which.batch);
  }
  const std::size_t target_lanes = targets ? kTargetLanes : 0;
  auto columns = Columns::make(std::max(lanes, target_lanes), std::max(malloc_lanes, target_lanes));
  if (absl::IsResourceExhausted(columns.status()) && targets) columns = Columns::make(lanes, malloc_lanes);
  if (!columns.ok()) return columns.status();

  now.part = "throughput";
  const auto done = [&](const BenchResult& result) {
    ++now.done;
    now.result = &result;
    const bool go_on = step();
    now.result = nullptr;
    return go_on;
  };
  if (const auto status = measure_throughput(options, cases, *columns, done, report); !status.ok()) return status;

  if (targets) {
    now.part = "targets";
    if (const auto status = measure_targets(options, *columns, step, report); !status.ok()) return status;
  }
  if (rejections) {
    now.part = "rejections";
    const std::size_t samples = options.suite == BenchSuite::quick  ? 1'000'000
                                : options.suite == BenchSuite::full ? 10'000'000
                                                                    : 4'000'000;
    if (const auto status = count_rejections(samples, options.target, step, report.rejections); !status.ok())
      return status;
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<BenchReport> run_bench(const BenchOptions& options, const BenchCallback& progress) {
  static std::mutex one_run;
  const std::unique_lock lock(one_run, std::try_to_lock);
  if (!lock) return absl::FailedPreconditionError("another benchmark is under way in this process: try again later");
  if (const auto status = check_options(options); !status.ok()) return status;
  const auto cases = choose_cases(options);
  if (!cases.ok()) return cases.status();
  if (const auto status = set_benchmark_flags(options.benchmark_flags); !status.ok()) return status;

  BenchReport report;
  report.version = std::string(version());
  report.threads = options.threads > 0 ? options.threads : static_cast<int>(usable_cores());
  report.machine = {cpu_model(), usable_cores(), std::string(name(*resolve(options.target)))};

  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(report.threads));
  tbb::task_arena arena(report.threads);
  absl::Status status;
  try {
    arena.execute([&] { status = run_parts(options, *cases, progress, report); });
  } catch (const std::bad_alloc&) {
    status = absl::ResourceExhaustedError("batch: no memory for the columns; filter for smaller batches");
  }
  if (!status.ok()) return status;
  return report;
}

double BenchResult::ns_per_accepted() const {
  if (rejected == samples) return std::numeric_limits<double>::infinity();
  return ns_per_sample * static_cast<double>(samples) / static_cast<double>(samples - rejected);
}

std::string BenchResult::name() const {
  return fmt::format("{}/{}/{}/{}/{}{}", facetwise::name(operation), bench_name(distribution, masking, sampler),
                     alpha_text(alpha_x, alpha_y, ","), batch, implementation, inputs == "columns" ? "" : "/" + inputs);
}

std::string alpha_text(double alpha_x, double alpha_y, std::string_view between) {
  if (alpha_x == 0 && alpha_y == 0) return "mixed";
  return fmt::format("{:g}{}{:g}", alpha_x, between, alpha_y);
}

std::string model_name(std::string_view distribution, std::string_view masking) {
  if (distribution == "ggx" && masking == "smith") return {};
  return fmt::format("{}-{}", distribution, masking);
}

std::string bench_name(std::string_view distribution, std::string_view masking, std::string_view sampler) {
  const std::string model = model_name(distribution, masking);
  return model.empty() ? std::string(sampler) : fmt::format("{}/{}", model, sampler);
}

double RejectionResult::deviations() const {
  const double n = static_cast<double>(samples);
  const double difference = static_cast<double>(rejected) - n * predicted_share;
  if (difference == 0) return 0;
  return difference / std::sqrt(n * predicted_share * (1 - predicted_share));
}

std::optional<bool> TargetResult::met() const {
  if (!measured) return std::nullopt;
  return at_least ? *measured >= required : *measured <= required;
}

}  // namespace facetwise
