// run(): check, plan, tiles.
#include <algorithm>
#include <atomic>
#include <cstring>
#include <limits>

#include "absl/strings/str_cat.h"
#include "src/check.h"
#include "src/float_environment.h"
#include "src/parallel.h"
#include "src/tile.h"

namespace facetwise {
namespace {

// Lanes that are copied into a tile's own buffers at a time: small enough for the first-level cache.
constexpr std::size_t kStaged = 256;
static_assert(kStaged % kWidest == 0);

Kernel kernel_for(const KernelTable& table, Operation operation, Sampler sampler) {
  const auto index = static_cast<std::size_t>(sampler);
  switch (operation) {
    case Operation::sample_normal: return table.sample_normal[index];
    case Operation::sample_reflection: return table.sample_reflection[index];
    case Operation::pdf_reflection: return table.pdf_reflection[index];
    case Operation::evaluate_reflection: return table.evaluate_reflection;
    case Operation::evaluate_and_pdf: return table.evaluate_and_pdf[index];
    case Operation::masking: return table.masking;
  }
  return nullptr;
}

// A checked batch and the kernel for it.
struct Plan {
  const KernelTable* table = nullptr;
  Kernel kernel = nullptr;
  Column<float> in[kInputs];
  OutputColumn<float> out[kOutputs];
  OutputColumn<std::uint8_t> status;
  const std::uint32_t* active = nullptr;
  const Generator* generator = nullptr;
  bool uncorrelated = false;
  bool generates_u3 = false;
  bool direct = true;  // every column can be used where it lies
};

Plan make_plan(Operation operation, const Batch& const_batch, const KernelTable& table) {
  Batch batch = const_batch;
  Plan plan;
  plan.table = &table;
  plan.kernel = kernel_for(table, operation, batch.sampler);
  plan.active = batch.active ? batch.active->data() : nullptr;
  plan.generator = const_batch.generator ? &*const_batch.generator : nullptr;
  plan.uncorrelated = batch.model.shadowing == Shadowing::uncorrelated;
  plan.generates_u3 = plan.generator && uses_u3(batch.sampler);
  plan.direct = !plan.active && !plan.generator;
  for (std::size_t k = 0; k < kInputs; ++k) {
    plan.in[k] = input_fields()[k].column(batch);
    if (plan.in[k].present() && !plan.in[k].one_value() && plan.in[k].stride() != sizeof(float)) plan.direct = false;
  }
  for (std::size_t k = 0; k < kOutputs; ++k) {
    plan.out[k] = output_fields()[k].column(batch);
    if (plan.out[k].present() && plan.out[k].stride() != sizeof(float)) plan.direct = false;
  }
  plan.status = batch.out.status;
  if (plan.status.present() && plan.status.stride() != 1) plan.direct = false;
  return plan;
}

// The buffers of a tile whose columns cannot be used where they lie.
class Stage {
 public:
  explicit Stage(const Plan& plan) : plan_(plan) {
    tile_.uncorrelated = plan.uncorrelated;
    for (std::size_t k = 0; k < kInputs; ++k) {
      if (!plan.in[k].one_value()) continue;
      std::fill_n(one_value_[k], kWidest, plan.in[k][0]);
      tile_.in[k] = {one_value_[k], 0};
    }
  }

  // Runs the positions [begin, end) of the batch, or of its active list.
  Statistics run(std::size_t begin, std::size_t end) {
    Statistics statistics;
    while (begin < end) {
      // Whole vectors where they lie, the last few lanes by way of the buffers.
      std::size_t lanes = end - begin;
      const bool whole = lanes >= kWidest;
      if (whole) lanes -= lanes % kWidest;
      if (!plan_.direct || !whole) lanes = std::min(lanes, kStaged);
      load(begin, lanes, whole);
      plan_.kernel(tile_, statistics);
      if (staged_outputs_) store(begin, lanes);
      begin += lanes;
    }
    return statistics;
  }

 private:
  std::size_t lane_at(std::size_t position) const { return plan_.active ? plan_.active[position] : position; }

  void load(std::size_t begin, std::size_t lanes, bool whole) {
    const bool in_place = whole && !plan_.active;
    tile_.lanes = lanes;
    for (std::size_t k = 0; k < kInputs; ++k) {
      const Column<float>& column = plan_.in[k];
      if (!column.present() || column.one_value()) continue;
      if (in_place && column.stride() == sizeof(float)) {
        tile_.in[k] = {column.data() + begin, std::numeric_limits<std::size_t>::max()};
        continue;
      }
      for (std::size_t j = 0; j < lanes; ++j) in_[k][j] = column[lane_at(begin + j)];
      pad(k, lanes);
    }
    if (plan_.generator) generate(begin, lanes);
    staged_outputs_ = false;
    for (std::size_t k = 0; k < kOutputs; ++k) {
      const OutputColumn<float>& column = plan_.out[k];
      if (!column.present()) continue;
      const bool direct = in_place && column.stride() == sizeof(float);
      tile_.out[k] = direct ? column.data() + begin : out_[k];
      staged_outputs_ |= !direct;
    }
    if (plan_.status.present()) {
      const bool direct = in_place && plan_.status.stride() == 1;
      tile_.status = direct ? plan_.status.data() + begin : status_;
      staged_outputs_ |= !direct;
    }
  }

  // Zeros behind the last lane, so that a whole vector can be read.
  void pad(std::size_t k, std::size_t lanes) {
    for (std::size_t j = lanes; j % kWidest != 0; ++j) in_[k][j] = 0.0f;
    tile_.in[k] = {in_[k], std::numeric_limits<std::size_t>::max()};
  }

  void generate(std::size_t begin, std::size_t lanes) {
    const Generator& generator = *plan_.generator;
    PhiloxTile philox{.lanes = lanes, .seed = generator.seed, .dimension = generator.dimension};
    philox.first_id = generator.first_id + begin;
    if (generator.id.present() || plan_.active) {
      for (std::size_t j = 0; j < lanes; ++j) {
        const std::size_t lane = lane_at(begin + j);
        std::uint64_t id = generator.first_id + lane;
        if (generator.id.present())  // 4-byte alignment is enough for a column
          std::memcpy(&id, reinterpret_cast<const char*>(generator.id.data()) + lane * generator.id.lane_stride(), 8);
        id_low_[j] = static_cast<std::uint32_t>(id);
        id_high_[j] = static_cast<std::uint32_t>(id >> 32);
      }
      for (std::size_t j = lanes; j % kWidest != 0; ++j) id_low_[j] = id_high_[j] = 0;
      philox.id_low = id_low_;
      philox.id_high = id_high_;
    }
    philox.u[0] = in_[kU1];
    philox.u[1] = in_[kU2];
    philox.u[2] = plan_.generates_u3 ? in_[kU3] : nullptr;
    plan_.table->philox(philox);
    for (const InputIndex k : {kU1, kU2, kU3}) tile_.in[k] = {in_[k], std::numeric_limits<std::size_t>::max()};
  }

  void store(std::size_t begin, std::size_t lanes) {
    for (std::size_t k = 0; k < kOutputs; ++k) {
      if (tile_.out[k] != out_[k]) continue;
      const OutputColumn<float>& column = plan_.out[k];
      for (std::size_t j = 0; j < lanes; ++j) column[lane_at(begin + j)] = out_[k][j];
    }
    if (tile_.status == status_)
      for (std::size_t j = 0; j < lanes; ++j) plan_.status[lane_at(begin + j)] = status_[j];
  }

  const Plan& plan_;
  Tile tile_;
  bool staged_outputs_ = false;
  alignas(64) float one_value_[kInputs][kWidest];
  alignas(64) float in_[kInputs][kStaged];
  alignas(64) float out_[kOutputs][kStaged];
  alignas(64) std::uint8_t status_[kStaged];
  alignas(64) std::uint32_t id_low_[kStaged];
  alignas(64) std::uint32_t id_high_[kStaged];
};

}  // namespace

absl::StatusOr<Statistics> run(Operation operation, const Batch& batch, const Execution& execution) {
  if (auto status = check(operation, batch); !status.ok()) return status;
  const auto target = resolve(execution.target);
  if (!target) {
    const std::string_view wanted = name(execution.target);
    return absl::FailedPreconditionError(
        absl::StrCat("target: this CPU or build has no ", absl::string_view(wanted.data(), wanted.size())));
  }
  const Plan plan = make_plan(operation, batch, kernels(*target, execution.one_lane));
  const std::size_t positions = batch.active ? batch.active->size() : batch.lanes;

  std::atomic<std::uint64_t> occluded{0}, smooth{0}, invalid{0};
  for_each_range(positions, execution, [&](std::size_t begin, std::size_t end) {
    const FloatEnvironment ieee;
    const Statistics statistics = Stage(plan).run(begin, end);
    occluded.fetch_add(statistics.occluded, std::memory_order_relaxed);
    smooth.fetch_add(statistics.smooth, std::memory_order_relaxed);
    invalid.fetch_add(statistics.invalid, std::memory_order_relaxed);
  });
  Statistics statistics{.occluded = occluded, .smooth = smooth, .invalid = invalid};
  statistics.accepted = positions - statistics.lanes();
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
