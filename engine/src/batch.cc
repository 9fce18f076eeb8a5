// run(): check, plan, tiles.
#include <algorithm>
#include <atomic>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "src/check.h"
#include "src/composition.h"
#include "src/float_environment.h"
#include "src/parallel.h"
#include "src/tile.h"

namespace facetwise {
namespace {

// Lanes of a tile: its buffers stay in the first-level cache.
constexpr std::size_t kStaged = 512;
static_assert(kStaged % kWidest == 0);

// A checked batch and the kernel for it.
struct Plan {
  const KernelTable* table = nullptr;
  Kernel kernel = nullptr;
  const std::uint32_t* active = nullptr;
  const Generator* generator = nullptr;
  bool generates_u3 = false;
  Tile tile;  // what is the same for every tile

  // The columns that there are, by the tile's indices.
  struct Input {
    std::size_t index;
    const Column<float>* column;
  };
  struct OneValue {
    std::size_t index;
    float value;
  };
  struct Output {
    std::size_t index;
    const OutputColumn<float>* column;
  };
  Input per_lane[kInputs];
  OneValue one_value[kInputs];
  Output out[kOutputs];
  std::size_t per_lane_count = 0, one_value_count = 0, out_count = 0;
  OutputColumn<std::uint8_t> bytes[kByteOutputs];
};

unsigned wants(std::size_t output) {
  switch (output) {
    case kOutMx: case kOutMy: case kOutMz: case kOutIm: return kWantsNormal;
    case kOutPdf: return kWantsPdf;
    case kOutWeight: return kWantsWeight;
    case kOutValue: return kWantsValue;
    case kOutShare: return kWantsShare;
    default: return 0;
  }
}

void make_plan(Operation operation, const Batch& batch, const KernelTable& table, Plan& plan) {
  const BatchColumns columns(batch);
  const Model& model = batch.model;
  plan.table = &table;
  const bool affine = is_affine(batch);
  plan.kernel = find_kernel(table, operation, model, batch.sampler, affine);
  plan.active = batch.active ? batch.active->data() : nullptr;
  plan.generator = batch.generator ? &*batch.generator : nullptr;
  plan.generates_u3 = plan.generator && reads_u3(operation, batch);
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
      plan.per_lane[plan.per_lane_count++] = {k, &column};
    }
  }
  for (std::size_t k = 0; k < kOutputs; ++k) {
    const OutputColumn<float>& column = *columns.out[k];
    if (!column.present()) continue;
    plan.out[plan.out_count++] = {k, &column};
    plan.tile.wanted |= wants(k);
  }
  for (std::size_t k = 0; k < kByteOutputs; ++k) plan.bytes[k] = *columns.byte_out[k];
  if (plan.bytes[kOutStatus].present()) plan.tile.wanted |= kWantsStatus;
  plan.tile.normals_alone = operation == Operation::sample_normal;
  plan.tile.transmits = operation == Operation::sample_transmission || operation == Operation::evaluate_transmission;
  plan.tile.uncorrelated = model.shadowing == Shadowing::uncorrelated;
  plan.tile.biased = model.normalisation == Normalisation::biased && operation != Operation::masking;
  plan.tile.importance = model.transport == Transport::importance;
  plan.tile.retro = model.retro;
  // Operations without reflectances do not read its columns.
  if (input_fields()[kEta].operations & bit(operation)) plan.tile.interface = model.interface;
  plan.tile.table = model.table ? &model.table->view() : nullptr;
}

// Runs a range of a plan's lanes, tile by tile. Contiguous columns are used where they lie; the others, and the
// last lanes that do not fill a vector, go by way of buffers.
class Stage {
 public:
  explicit Stage(const Plan& plan) : plan_(plan), tile_(plan.tile) {
    for (std::size_t c = 0; c < plan.one_value_count; ++c) {
      const auto& [k, value] = plan.one_value[c];
      std::fill_n(in_[k], kStaged, value);
      tile_.in[k] = in_[k];
    }
    tile_.event = bytes_[kOutEvent];
    for (float*& out : tile_.out) out = unwanted_;
  }

  // Runs the positions [begin, end) of the batch, or of its active list.
  Statistics run(std::size_t begin, std::size_t end) {
    Statistics statistics;
    while (begin < end) {
      std::size_t lanes = std::min(end - begin, kStaged);
      const bool whole = lanes >= kWidest;
      if (whole) lanes -= lanes % kWidest;
      tile_.lanes = lanes;
      const bool in_place = whole && !plan_.active;
      load(begin, in_place);
      if (plan_.generator) generate(begin);
      const bool staged = point_outputs(begin, in_place);
      plan_.kernel(tile_, statistics);
      if (staged) store(begin);
      begin += lanes;
    }
    return statistics;
  }

 private:
  std::size_t lane_at(std::size_t position) const { return plan_.active ? plan_.active[position] : position; }
  // The buffers are read up to the next whole vector: zeros, which make an invalid lane.
  std::size_t padding() const { return (kWidest - tile_.lanes % kWidest) % kWidest; }

  void load(std::size_t begin, bool in_place) {
    for (std::size_t c = 0; c < plan_.per_lane_count; ++c) {
      const auto& [k, column] = plan_.per_lane[c];
      const bool contiguous = column->stride() == sizeof(float) && !plan_.active;
      if (in_place && contiguous) {
        tile_.in[k] = column->data() + begin;
        continue;
      }
      if (contiguous) {
        std::copy_n(column->data() + begin, tile_.lanes, in_[k]);
      } else {
        for (std::size_t j = 0; j < tile_.lanes; ++j) in_[k][j] = (*column)[lane_at(begin + j)];
      }
      std::fill_n(in_[k] + tile_.lanes, padding(), 0.0f);
      tile_.in[k] = in_[k];
    }
  }

  void generate(std::size_t begin) {
    const Generator& generator = *plan_.generator;
    PhiloxTile philox{.lanes = tile_.lanes,
                      .seed = generator.seed,
                      .dimension = generator.dimension,
                      .first_id = generator.first_id + begin};
    if (generator.id.present() || plan_.active) {
      for (std::size_t j = 0; j < tile_.lanes; ++j) {
        const std::size_t lane = lane_at(begin + j);
        id_[j] = generator.first_id + lane;
        if (generator.id.present())  // 4-byte alignment is enough for a column
          std::memcpy(&id_[j], reinterpret_cast<const char*>(generator.id.data()) + lane * generator.id.lane_stride(),
                      sizeof id_[j]);
      }
      std::fill_n(id_ + tile_.lanes, padding(), 0);
      philox.id = id_;
    }
    philox.u[0] = in_[kU1];
    philox.u[1] = in_[kU2];
    philox.u[2] = plan_.generates_u3 ? in_[kU3] : nullptr;
    plan_.table->philox(philox);
    for (const InputIndex k : {kU1, kU2, kU3}) tile_.in[k] = in_[k];
  }

  // Returns true if an output goes by way of a buffer.
  bool point_outputs(std::size_t begin, bool in_place) {
    bool staged = false;
    for (std::size_t c = 0; c < plan_.out_count; ++c) {
      const auto& [k, column] = plan_.out[c];
      const bool direct = in_place && column->stride() == sizeof(float);
      tile_.out[k] = direct ? column->data() + begin : out_[k];
      staged |= !direct;
    }
    for (std::size_t k = 0; k < kByteOutputs; ++k) {
      if (!plan_.bytes[k].present()) continue;
      const bool direct = in_place && plan_.bytes[k].stride() == 1;
      (k == kOutStatus ? tile_.status : tile_.event) = direct ? plan_.bytes[k].data() + begin : bytes_[k];
      staged |= !direct;
    }
    return staged;
  }

  void store(std::size_t begin) {
    for (std::size_t c = 0; c < plan_.out_count; ++c) {
      const auto& [k, column] = plan_.out[c];
      if (tile_.out[k] != out_[k]) continue;
      if (column->stride() == sizeof(float) && !plan_.active) {
        std::copy_n(out_[k], tile_.lanes, column->data() + begin);
      } else {
        for (std::size_t j = 0; j < tile_.lanes; ++j) (*column)[lane_at(begin + j)] = out_[k][j];
      }
    }
    for (std::size_t k = 0; k < kByteOutputs; ++k) {
      if (!plan_.bytes[k].present() || (k == kOutStatus ? tile_.status : tile_.event) != bytes_[k]) continue;
      for (std::size_t j = 0; j < tile_.lanes; ++j) plan_.bytes[k][lane_at(begin + j)] = bytes_[k][j];
    }
  }

  const Plan& plan_;
  Tile tile_;
  alignas(64) float in_[kInputs][kStaged];
  alignas(64) float out_[kOutputs][kStaged];
  alignas(64) float unwanted_[kStaged];
  alignas(64) std::uint8_t bytes_[kByteOutputs][kStaged];
  alignas(64) std::uint64_t id_[kStaged];
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
  Plan plan;
  make_plan(operation, batch, kernels(*target, execution.one_lane), plan);
  const std::size_t positions = batch.active ? batch.active->size() : batch.lanes;

  std::atomic<std::uint64_t> occluded{0}, smooth{0}, invalid{0};
  for_each_range(positions, execution, [&](std::size_t begin, std::size_t end) {
    const FloatEnvironment ieee;
    const Statistics statistics = Stage(plan).run(begin, end);
    const auto add = [](std::atomic<std::uint64_t>& to, std::uint64_t count) {
      if (count != 0) to.fetch_add(count, std::memory_order_relaxed);
    };
    add(occluded, statistics.occluded);
    add(smooth, statistics.smooth);
    add(invalid, statistics.invalid);
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
