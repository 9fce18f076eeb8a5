// SPDX-License-Identifier: Apache-2.0
// The performance that facetwise sets itself to reach, measured.
#pragma once

#include <functional>
#include <vector>

#include "absl/status/status.h"
#include "columns.h"
#include "facetwise/bench.h"

namespace facetwise::bench {

// Lanes that `columns` should have, of either placement: 16 M for batches that do not fit into a cache.
inline constexpr std::size_t kTargetLanes = kFreshLanes;

// Measures each and appends to report.targets. Stops with Cancelled when `step()` returns false.
absl::Status measure_targets(const BenchOptions& options, Columns& columns, const std::function<bool()>& step,
                             BenchReport& report);

}  // namespace facetwise::bench
