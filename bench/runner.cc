#include "runner.h"

namespace facetwise::bench {

Runner make_runner(const Case& which, const Columns& columns, Target target, Engine* remote) {
  const Operation operation = which.operation;
  const Batch batch = columns.batch(which);
  const auto occluded = [](const absl::StatusOr<Statistics>& statistics) -> absl::StatusOr<std::uint64_t> {
    if (!statistics.ok()) return statistics.status();
    return statistics->occluded;
  };
  if (which.implementation == Implementation::scalar)
    return [operation, batch]() -> absl::StatusOr<std::uint64_t> { return run_scalar(operation, batch); };
  if (which.implementation == Implementation::remote)
    return [operation, batch, remote, occluded] { return occluded(remote->run(operation, batch)); };
  Execution execution;
  execution.target = target;
  execution.one_lane = which.implementation == Implementation::one_lane;
  execution.single_thread = which.implementation != Implementation::simd_threads;
  return [operation, batch, execution, occluded] { return occluded(run(operation, batch, execution)); };
}

}  // namespace facetwise::bench
