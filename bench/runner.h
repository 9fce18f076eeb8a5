// What a case does once: a call of the library, of a server, or of the scalar baseline's loop.
#pragma once

#include <functional>

#include "absl/status/statusor.h"
#include "case.h"
#include "columns.h"

namespace facetwise::bench {

// Runs the case's batch once and returns how many lanes were occluded.
using Runner = std::function<absl::StatusOr<std::uint64_t>()>;

// `columns` has the case's roughness set and outlives the runner. `remote` is for remote cases alone.
Runner make_runner(const Case& which, const Columns& columns, Target target, Engine* remote);

// The baseline in a plain loop over the batch's columns: returns how many lanes were occluded. The batch is
// one of Columns::batch().
std::uint64_t run_scalar(Operation operation, const Batch& batch);

}  // namespace facetwise::bench
