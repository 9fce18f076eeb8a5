// SPDX-License-Identifier: Apache-2.0
#include "src/plan.h"

#include <algorithm>
#include <bit>
#include <span>

#if defined(__linux__)
#include <unistd.h>
#endif

#include "src/composition.h"

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

// Calls body(address, whether it is an output) for each contiguous column.
template <class Body>
void for_each_contiguous(const Plan& plan, const Body& body) {
  for (std::size_t c = 0; c < plan.per_lane_count; ++c)
    if (plan.per_lane[c].contiguous) body(plan.per_lane[c].column->data(), false);
  for (std::size_t c = 0; c < plan.out_count; ++c)
    if (plan.out[c].contiguous) body(plan.out[c].column->data(), true);
}

// The head that brings most columns onto lines; a store that straddles two lines costs more than such a load.
std::size_t best_head(const Plan& plan) {
  constexpr unsigned kInputWeight = 1, kOutputWeight = 3;
  unsigned votes[kLine] = {};
  for_each_contiguous(plan, [&](const void* data, bool output) {
    votes[lanes_to_line(data)] += output ? kOutputWeight : kInputWeight;
  });
  return static_cast<std::size_t>(std::max_element(votes, votes + kLine) - votes);
}

// Whether more columns lie at one place of their pages, and so in one set of the first-level cache, than it can well
// serve. Measured with 8 ways: docs/performance.md, "Fetching ahead".
bool share_a_set(const Plan& plan) {
  constexpr unsigned kLinesOfPage = 4096 / sizeof(float) / kLine, kMany = 4;
  unsigned columns[kLinesOfPage] = {}, most = 0;
  for_each_contiguous(plan, [&](const void* data, bool) {
    most = std::max(most, ++columns[reinterpret_cast<std::uintptr_t>(data) / (kLine * sizeof(float)) % kLinesOfPage]);
  });
  return most > kMany;
}

bool larger_than_caches(const Plan& plan) {
  return plan.positions * sizeof(float) * (plan.per_lane_count + plan.out_count) > cache_bytes();
}

bool streams(const Plan& plan, bool spreads, const Execution& execution) {
  if (!plan.table->streams || execution.stores == Stores::cached) return false;
  if (execution.stores == Stores::streaming) return true;
  // Vectors of half a line stream too slowly to gain before several threads share the memory.
  if (plan.table->vector_lanes < kLine && !spreads) return false;
  return larger_than_caches(plan);
}

}  // namespace

OutputIndex compensated_output(Operation operation, const Model& model, const PresentColumns& columns) {
  if (model.compensation != Compensation::turquin || !reads_albedo(operation, model)) return kOutputs;
  if (operation == Operation::albedo) return kOutputs;
  const OutputIndex index = samples(operation) ? kOutWeight : kOutValue;
  return columns.out_bits >> index & 1 ? index : kOutputs;
}

void make_plan(Operation operation, const Batch& batch, const PresentColumns& columns, const TargetKernels& table,
               bool spreads, const Execution& execution, Plan& plan) {
  const Model& model = batch.model;
  plan.table = &table;
  const bool affine = is_affine(batch);
  plan.kernel = find_kernel(table, operation, model, sampler_of(operation, batch), affine);
  plan.active = batch.active ? batch.active->data() : nullptr;
  plan.positions = batch.active ? batch.active->size() : batch.lanes;
  plan.generator = batch.generator ? &*batch.generator : nullptr;
  const unsigned read = inputs_read(operation, model, batch.sampler);
  plan.generates_u3 = plan.generator && (read >> kU3 & 1);
  plan.buffers = plan.active || plan.generator;
  for (const auto& [index, column] : std::span(columns.in, columns.in_count)) {
    if (column->one_value()) {
      plan.one_value[plan.one_value_count++] = {index, *column->data()};
      continue;
    }
    const bool contiguous = column->stride() == sizeof(float) && !plan.active;
    plan.per_lane[plan.per_lane_count++] = {index, column, contiguous};
    plan.buffers |= !contiguous;
  }
  // Kernels of affine surfaces, and tables', read all of these.
  constexpr unsigned kAffineInputs = 1u << kMeanX | 1u << kMeanY | 1u << kCorrelation;
  unsigned missing = read & kOptionalInputs & ~columns.in_bits;
  if (!affine && model.distribution != Distribution::table) missing &= ~kAffineInputs;
  for (; missing != 0; missing &= missing - 1) {
    const auto index = static_cast<unsigned>(std::countr_zero(missing));
    plan.one_value[plan.one_value_count++] = {index, *input_fields()[index].otherwise};
  }
  plan.buffers |= plan.one_value_count > 0;
  for (const auto& [index, column] : std::span(columns.out, columns.out_count)) {
    const bool contiguous = column->stride() == sizeof(float) && !plan.active;
    plan.out[plan.out_count++] = {index, column, contiguous};
    plan.buffers |= !contiguous;
  }
  plan.constants.wanted = columns.out_bits;
  for (const auto& [index, column] : std::span(columns.byte_out, columns.byte_out_count)) {
    plan.bytes[index] = column;
    plan.buffers |= column->stride() != 1;
  }
  plan.constants.normals_alone = operation == Operation::sample_normal;
  plan.constants.transmits =
      operation == Operation::sample_transmission || operation == Operation::evaluate_transmission;
  plan.constants.uncorrelated = model.shadowing == Shadowing::uncorrelated;
  plan.constants.biased = model.normalisation == Normalisation::biased && operation != Operation::masking;
  plan.constants.importance = model.transport == Transport::importance;
  plan.constants.retro = model.retro;
  // Operations without reflectances do not read its columns.
  if ((known_to::kDielectric & bit(operation)) &&
      (operation != Operation::albedo || model.interface == Interface::dielectric))
    plan.constants.interface = model.interface;
  plan.constants.table = model.table ? &model.table->view() : nullptr;
  if (plan.compensated != kOutputs) {
    plan.compensation = find_surface(table, model, affine).compensation;
    plan.buffers = true;
  }
  if (has_lobe(operation, model)) {
    const SurfaceKernels& surface = find_surface(table, model, affine);
    plan.lobe = surface.lobe;
    plan.with_lobe = surface.with_lobe;
    plan.buffers = true;
    if (operation == Operation::sample_reflection) {
      plan.lobe_query = find_kernel(table, Operation::evaluate_reflection, model, batch.sampler, affine);
      plan.constants.draws_lobe = true;
      plan.constants.wanted |= kWantsDirection | kWantsPdf | kWantsWeight;
    }
  }

  if (plan.active || plan.lobe || plan.positions < kLanesWorthHead) return;
  plan.head = best_head(plan);
  if ((execution.stores == Stores::streaming || larger_than_caches(plan)) && share_a_set(plan)) {
    const Kernel ahead = find_kernel(table, operation, model, sampler_of(operation, batch), affine, true);
    plan.ahead = ahead != plan.kernel;
    plan.kernel = ahead;
  }
  if (!streams(plan, spreads, execution)) return;
  for (std::size_t c = 0; c < plan.out_count; ++c) {
    const auto& [index, column, contiguous] = plan.out[c];
    // What is compensated is read again.
    if (contiguous && index != plan.compensated && lanes_to_line(column->data()) == plan.head)
      plan.streamed |= 1u << index;
  }
}

}  // namespace facetwise
