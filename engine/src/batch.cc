// SPDX-License-Identifier: Apache-2.0
// run(): check, plan, tiles.
#include <atomic>

#include "absl/strings/str_cat.h"
#include "src/check.h"
#include "src/float_environment.h"
#include "src/parallel.h"
#include "src/plan.h"
#include "src/stage.h"

namespace facetwise {

absl::StatusOr<Statistics> run(Operation operation, const Batch& batch, const Execution& execution) {
  const PresentColumns columns(batch);
  if (auto status = check(operation, batch, columns); !status.ok()) return status;
  const auto target = resolve(execution.target);
  if (!target) {
    const std::string_view wanted = name(execution.target);
    return absl::FailedPreconditionError(
        absl::StrCat("target: this CPU or build has no ", absl::string_view(wanted.data(), wanted.size())));
  }
  Plan plan;
  plan.stop = execution.stop;
  plan.compensated = compensated_output(operation, batch.model, columns);
  std::shared_ptr<const AlbedoTable> albedo;
  if (operation == Operation::albedo || has_lobe(operation, batch.model) || plan.compensated != kOutputs) {
    auto table = albedo_table(batch.model);
    if (!table.ok()) return table.status();
    albedo = *std::move(table);
    plan.constants.albedo = &albedo->view();
  }
  // GGX takes a nanosecond or four a lane, the others around ten.
  const std::size_t positions = batch.active ? batch.active->size() : batch.lanes;
  const Threading threading(positions, batch.model.distribution == Distribution::ggx ? 65536 : 16384, execution);
  make_plan(operation, batch, columns, kernels(*target, execution.one_lane), threading.spreads(), execution, plan);
  const auto run_range = [&](std::size_t begin, std::size_t end) {
    const FloatEnvironment ieee;
    const Statistics statistics = Stage(plan).run(begin, end);
    // What was streamed is seen by whoever is told that the range is done.
    if (plan.streamed != 0) plan.table->finish_streams();
    return statistics;
  };

  Statistics statistics;
  if (!threading.spreads()) {
    statistics = run_range(0, plan.positions);
  } else {
    std::atomic<std::uint64_t> occluded{0}, smooth{0}, invalid{0};
    for_each_range(plan.positions, plan.head, [&](std::size_t begin, std::size_t end) {
      const Statistics some = run_range(begin, end);
      const auto add = [](std::atomic<std::uint64_t>& to, std::uint64_t count) {
        if (count != 0) to.fetch_add(count, std::memory_order_relaxed);
      };
      add(occluded, some.occluded);
      add(smooth, some.smooth);
      add(invalid, some.invalid);
    });
    statistics = {.occluded = occluded, .smooth = smooth, .invalid = invalid};
  }
  if (plan.stop != nullptr && plan.stop->load(std::memory_order_relaxed))
    return absl::CancelledError("stopped before all lanes were done");
  statistics.accepted = plan.positions - statistics.lanes();
  return statistics;
}

std::string_view version() { return FACETWISE_VERSION; }

namespace {

class LocalEngine final : public Engine {
 public:
  explicit LocalEngine(const Execution& execution) : execution_(execution) {}
  absl::StatusOr<Statistics> run(Operation operation, const Batch& batch) override {
    return facetwise::run(operation, batch, execution_);
  }
  absl::StatusOr<std::size_t> compact(const Compaction& compaction) override {
    return facetwise::compact(compaction, execution_);
  }

 private:
  Execution execution_;
};

}  // namespace

std::unique_ptr<Engine> local_engine(const Execution& execution) { return std::make_unique<LocalEngine>(execution); }

}  // namespace facetwise
