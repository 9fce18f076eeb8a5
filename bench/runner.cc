// SPDX-License-Identifier: Apache-2.0
#include "runner.h"

#include <vector>

#include "bench/baseline/loop.h"

namespace facetwise::bench {
namespace {

// A batch of Columns::batch() as plain pointers.
baseline::Loop loop_of(Operation operation, const Batch& batch) {
  const auto in = [](const Column<float>& column) {
    return baseline::LoopColumn{column.data(), column.one_value() ? std::size_t{0} : 1};
  };
  const OutputDirection& direction = operation == Operation::sample_normal ? batch.out.normal : batch.out.outgoing;
  return {.operation = operation,
          .distribution = batch.model.distribution,
          .masking = batch.model.masking,
          .sampler = batch.sampler,
          .lanes = batch.lanes,
          .ix = in(batch.incident.x),
          .iy = in(batch.incident.y),
          .iz = in(batch.incident.z),
          .alpha_x = in(batch.alpha_x),
          .alpha_y = in(batch.alpha_y),
          .ox = in(batch.outgoing.x),
          .oy = in(batch.outgoing.y),
          .oz = in(batch.outgoing.z),
          .u1 = in(batch.u1),
          .u2 = in(batch.u2),
          .u3 = in(batch.u3),
          .x = direction.x.data(),
          .y = direction.y.data(),
          .z = direction.z.data(),
          .pdf = batch.out.pdf.data(),
          .value = batch.out.value.data(),
          .masking_g1 = batch.out.masking.data()};
}

using LoopFunction = std::uint64_t (*)(const baseline::Loop&);

LoopFunction auto_loops(Target target) {
#if defined(__x86_64__)
  if (target == Target::avx3 && __builtin_cpu_supports("avx512f")) return baseline::run_auto_avx512;
  if (target == Target::avx2 && __builtin_cpu_supports("avx2")) return baseline::run_auto_avx2;
#endif
  (void)target;
  return nullptr;
}

// One batch after another, then the first again.
template <class Run>
Runner in_turn(std::vector<Batch> batches, const Run& run) {
  return [batches = std::move(batches), run, next = std::size_t{0}]() mutable {
    const Batch& batch = batches[next];
    next = next + 1 < batches.size() ? next + 1 : 0;
    return run(batch);
  };
}

}  // namespace

bool has_auto_loops(Target target) { return auto_loops(target) != nullptr; }

Runner make_runner(const Case& which, const Columns& columns, Target target, Engine* remote) {
  const Operation operation = which.operation;
  std::vector<Batch> batches;
  for (std::size_t first = 0; first + which.batch <= which.lanes(); first += which.batch)
    batches.push_back(columns.batch(which, first));

  const bool vectorised = which.implementation == Implementation::auto_vectorised;
  if (vectorised || which.implementation == Implementation::scalar) {
    const LoopFunction run = vectorised ? auto_loops(*resolve(target)) : baseline::run_scalar;
    return in_turn(std::move(batches), [operation, run](const Batch& batch) -> absl::StatusOr<std::uint64_t> {
      return run(loop_of(operation, batch));
    });
  }
  const auto occluded = [](const absl::StatusOr<Statistics>& statistics) -> absl::StatusOr<std::uint64_t> {
    if (!statistics.ok()) return statistics.status();
    return statistics->occluded;
  };
  if (which.implementation == Implementation::remote)
    return in_turn(std::move(batches), [operation, remote, occluded](const Batch& batch) {
      return occluded(remote->run(operation, batch));
    });
  Execution execution;
  execution.target = target;
  execution.one_lane = which.implementation == Implementation::one_lane;
  if (which.implementation != Implementation::simd_threads) execution.threads = Threads::one;
  return in_turn(std::move(batches), [operation, execution, occluded](const Batch& batch) {
    return occluded(run(operation, batch, execution));
  });
}

}  // namespace facetwise::bench
