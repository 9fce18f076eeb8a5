#include "src/plan.h"

#include <algorithm>

#if defined(__linux__)
#include <unistd.h>
#endif

#include "src/composition.h"
#include "src/parallel.h"

namespace facetwise {
namespace {

// Below this many lanes a head costs more than it saves.
constexpr std::size_t kLanesWorthHead = 512;

// Bytes of columns beyond which results do not stay in the caches. What the system says of the last level is an upper
// bound: others share it, and virtual machines overstate it.
std::size_t cache_bytes() {
  static const std::size_t bytes = [] {
    constexpr std::size_t kLargest = std::size_t{32} << 20;
#if defined(_SC_LEVEL3_CACHE_SIZE)
    if (const long last_level = sysconf(_SC_LEVEL3_CACHE_SIZE); last_level > 0)
      return std::min(kLargest, static_cast<std::size_t>(last_level));
#endif
    return kLargest;
  }();
  return bytes;
}

// Lanes from `data` to the next cache line.
std::size_t lanes_to_line(const void* data) {
  return -(reinterpret_cast<std::uintptr_t>(data) / sizeof(float)) % kLine;
}

// The head that brings most columns onto lines; a store that straddles two lines costs more than such a load.
std::size_t best_head(const Plan& plan) {
  constexpr unsigned kInputWeight = 1, kOutputWeight = 3;
  unsigned votes[kLine] = {};
  for (std::size_t c = 0; c < plan.per_lane_count; ++c)
    if (plan.per_lane[c].contiguous) votes[lanes_to_line(plan.per_lane[c].column->data())] += kInputWeight;
  for (std::size_t c = 0; c < plan.out_count; ++c)
    if (plan.out[c].contiguous) votes[lanes_to_line(plan.out[c].column->data())] += kOutputWeight;
  return static_cast<std::size_t>(std::max_element(votes, votes + kLine) - votes);
}

bool streams(const Plan& plan, const Execution& execution) {
  if (!plan.table->streams || execution.stores == Stores::cached) return false;
  if (execution.stores == Stores::streaming) return true;
  // Vectors of half a line stream too slowly to gain before several threads share the memory.
  if (plan.table->vector_lanes < kLine && stays_on_thread(plan.positions, execution)) return false;
  return plan.positions * sizeof(float) * (plan.per_lane_count + plan.out_count) > cache_bytes();
}

}  // namespace

void make_plan(Operation operation, const Batch& batch, const BatchColumns& columns, const KernelTable& table,
               const Execution& execution, Plan& plan) {
  const Model& model = batch.model;
  plan.table = &table;
  const bool affine = is_affine(batch);
  plan.kernel = find_kernel(table, operation, model, batch.sampler, affine);
  plan.active = batch.active ? batch.active->data() : nullptr;
  plan.positions = batch.active ? batch.active->size() : batch.lanes;
  plan.generator = batch.generator ? &*batch.generator : nullptr;
  plan.generates_u3 = plan.generator && reads(operation, model, batch.sampler, kU3);
  plan.buffers = plan.active || plan.generator;
  for (std::size_t k = 0; k < kInputs; ++k) {
    const Column<float>& column = *columns.in[k];
    if (!column.present()) {
      const bool needed = k == kF90 ? model.interface == Interface::schlick
                                    : affine || model.distribution == Distribution::table;
      if (const auto otherwise = input_fields()[k].otherwise; otherwise && needed)
        plan.one_value[plan.one_value_count++] = {k, *otherwise};
    } else if (column.one_value()) {
      plan.one_value[plan.one_value_count++] = {k, *column.data()};
    } else {
      const bool contiguous = column.stride() == sizeof(float) && !plan.active;
      plan.per_lane[plan.per_lane_count++] = {k, &column, contiguous};
      plan.buffers |= !contiguous;
    }
  }
  plan.buffers |= plan.one_value_count > 0;
  for (std::size_t k = 0; k < kOutputs; ++k) {
    const OutputColumn<float>& column = *columns.out[k];
    if (!column.present()) continue;
    const bool contiguous = column.stride() == sizeof(float) && !plan.active;
    plan.out[plan.out_count++] = {k, &column, contiguous};
    plan.buffers |= !contiguous;
    plan.tile.wanted |= bit(static_cast<OutputIndex>(k));
  }
  for (std::size_t k = 0; k < kByteOutputs; ++k) {
    plan.bytes[k] = columns.byte_out[k];
    plan.buffers |= plan.bytes[k]->present() && plan.bytes[k]->stride() != 1;
  }
  plan.tile.normals_alone = operation == Operation::sample_normal;
  plan.tile.transmits = operation == Operation::sample_transmission || operation == Operation::evaluate_transmission;
  plan.tile.uncorrelated = model.shadowing == Shadowing::uncorrelated;
  plan.tile.biased = model.normalisation == Normalisation::biased && operation != Operation::masking;
  plan.tile.importance = model.transport == Transport::importance;
  plan.tile.retro = model.retro;
  // Operations without reflectances do not read its columns.
  if (known_to::kDielectric & bit(operation)) plan.tile.interface = model.interface;
  plan.tile.table = model.table ? &model.table->view() : nullptr;

  if (plan.active || plan.positions < kLanesWorthHead) return;
  plan.head = best_head(plan);
  if (!streams(plan, execution)) return;
  for (std::size_t c = 0; c < plan.out_count; ++c) {
    const auto& [k, column, contiguous] = plan.out[c];
    if (contiguous && lanes_to_line(column->data()) == plan.head) plan.streamed |= bit(static_cast<OutputIndex>(k));
  }
}

}  // namespace facetwise
