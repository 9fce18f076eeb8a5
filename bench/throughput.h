// SPDX-License-Identifier: Apache-2.0
// Throughput by Google Benchmark.
#pragma once

#include <functional>
#include <vector>

#include "absl/status/status.h"
#include "case.h"
#include "columns.h"
#include "facetwise/bench.h"

namespace facetwise::bench {

// Google Benchmark's flags, checked: InvalidArgument for those that are not taken. Sets them for the process.
absl::Status set_benchmark_flags(const std::vector<std::string>& flags);

// Measures the cases, groups of comparable ones with their repetitions interleaved at random, together with
// the copy of the same columns where `report.limits.copy` has it not yet and options.limits wants it. Appends
// to report.results and report.limits.copy. Stops with Cancelled when `done(result)` returns false.
absl::Status measure_throughput(const BenchOptions& options, const std::vector<Case>& cases, Columns& columns,
                                const std::function<bool(const BenchResult&)>& done, BenchReport& report);

}  // namespace facetwise::bench
