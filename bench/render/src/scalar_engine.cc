// SPDX-License-Identifier: Apache-2.0
// The renderer's calls answered by the benchmarks' baseline, one path after another in plain code.
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <atomic>

#include "bench/baseline/baseline.h"
#include "facetwise/albedo_table.h"
#include "facetwise/render.h"

namespace facetwise::render {
namespace {

class ScalarEngine final : public Engine {
 public:
  absl::StatusOr<Statistics> run(Operation operation, const Batch& batch) override {
    if (auto status = check(operation, batch); !status.ok()) return status;
    // What the baseline has no function for: a table look-up, which a renderer would do by other code of its own.
    if (operation == Operation::albedo) return facetwise::run(operation, batch);
    const baseline::Model model{batch.model.distribution, batch.model.masking};
    const bool draws = operation == Operation::sample_reflection;
    if ((!draws && operation != Operation::evaluate_reflection) || batch.model.interface != Interface::conductor ||
        batch.model.retro || batch.generator || !baseline::has_baseline(model, batch.sampler))
      return absl::InvalidArgumentError(
          "the scalar baseline has GGX, Beckmann and Student-t conductors without retro-reflection, by some samplers, "
          "and "
          "needs numbers from sobol");
    const std::size_t lanes = batch.active ? batch.active->size() : batch.lanes;
    std::atomic<std::uint64_t> occluded = 0;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, lanes, 256), [&](const auto& range) {
      std::uint64_t count = 0;
      for (std::size_t k = range.begin(); k < range.end(); ++k) {
        const std::size_t lane = batch.active ? (*batch.active)[k] : k;
        count += one(operation, model, batch, lane) ? 0 : 1;
      }
      occluded += count;
    });
    return Statistics{.accepted = lanes - occluded, .occluded = occluded};
  }
  absl::StatusOr<std::size_t> compact(const Compaction& compaction) override { return facetwise::compact(compaction); }

 private:
  static bool one(Operation operation, baseline::Model model, const Batch& batch, std::size_t lane) {
    const baseline::Vector i = {batch.incident.x[lane], batch.incident.y[lane], batch.incident.z[lane]};
    const float ax = batch.alpha_x[lane], ay = batch.alpha_y[lane];
    if (operation == Operation::evaluate_reflection) {
      const baseline::Vector o = {batch.outgoing.x[lane], batch.outgoing.y[lane], batch.outgoing.z[lane]};
      const bool above = o.z > 0 && i.z > 0;
      batch.out.value[lane] = above ? baseline::evaluate_reflection(model, batch.model.shadowing, i, o, ax, ay) : 0.0f;
      batch.out.pdf[lane] = above ? baseline::pdf_reflection(model, batch.sampler, i, o, ax, ay) : 0.0f;
      return above;
    }
    const auto s = baseline::sample_reflection(model, batch.sampler, batch.model.shadowing, i, ax, ay, batch.u1[lane],
                                               batch.u2[lane], batch.u3.present() ? batch.u3[lane] : 0.5f);
    batch.out.outgoing.x[lane] = s.o.x;
    batch.out.outgoing.y[lane] = s.o.y;
    batch.out.outgoing.z[lane] = s.o.z;
    batch.out.incident_dot_normal[lane] = s.incident_dot_normal;
    batch.out.pdf[lane] = s.pdf;
    batch.out.weight[lane] = s.weight;
    batch.out.status[lane] = static_cast<std::uint8_t>(s.accepted ? LaneStatus::accepted : LaneStatus::occluded);
    return s.accepted;
  }
};

}  // namespace

std::unique_ptr<Engine> scalar_engine() { return std::make_unique<ScalarEngine>(); }

}  // namespace facetwise::render
