// SPDX-License-Identifier: Apache-2.0
// What a case does once: a call of the library, of a server, or of the baseline's loop.
#pragma once

#include <functional>

#include "absl/status/statusor.h"
#include "case.h"
#include "columns.h"

namespace facetwise::bench {

// Runs the case's batch once and returns how many lanes were occluded.
using Runner = std::function<absl::StatusOr<std::uint64_t>()>;

// `columns` has the case's roughness set and outlives the runner. Only remote cases need `remote`.
Runner make_runner(const Case& which, const Columns& columns, Target target, Engine* remote);

// Whether this build and CPU have the baseline's loops vectorised by the compiler for a target.
bool has_auto_loops(Target target);

}  // namespace facetwise::bench
