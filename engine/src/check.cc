// The checks of a call, made once before anything is read or written.
#include "src/check.h"

#include <numeric>
#include <string>

#include "absl/strings/str_cat.h"
#include "src/composition.h"
#include "src/tile.h"

namespace facetwise {
namespace {

absl::Status invalid(absl::string_view field, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat(field, ": ", what));
}

absl::string_view view(std::string_view text) { return {text.data(), text.size()}; }

std::uintptr_t address(const void* pointer) { return reinterpret_cast<std::uintptr_t>(pointer); }

absl::Status check_memory(absl::string_view field, const void* data, std::size_t count, std::size_t stride,
                          std::size_t width) {
  if (count == 0) return absl::OkStatus();
  const std::size_t misaligned = width == 1 ? 0 : 3;
  if (data == nullptr) return invalid(field, "null pointer");
  if (address(data) & misaligned) return invalid(field, "not aligned to 4 bytes");
  if (count == 1) return absl::OkStatus();
  if (stride & misaligned) return invalid(field, absl::StrCat("stride of ", stride, " bytes is not a multiple of 4"));
  std::size_t bytes = 0;
  if (__builtin_mul_overflow(count, stride, &bytes) || address(data) + bytes < address(data))
    return invalid(field, "reaches beyond the address space");
  return absl::OkStatus();
}

std::string count_message(std::size_t count, std::size_t lanes) {
  return absl::StrCat(count, count == 1 ? " value for " : " values for ", lanes, lanes == 1 ? " lane" : " lanes");
}

}  // namespace

bool share_memory(const MemoryUse& a, const MemoryUse& b) {
  if (!ranges_meet(a, b)) return false;
  // The values meet only if they do modulo the strides' common divisor: columns that are members of one array
  // of structures do not.
  const std::size_t step = std::gcd(a.stride, b.stride);
  if (step == 0) return true;
  const std::uintptr_t distance =
      b.begin >= a.begin ? (b.begin - a.begin) % step : (step - (a.begin - b.begin) % step) % step;
  return distance < a.width || step - distance < b.width;
}

template <class T>
absl::Status check_input(absl::string_view field, const Column<T>& column, std::size_t lanes) {
  if (column.count() != lanes && !column.one_value()) return invalid(field, count_message(column.count(), lanes));
  return check_memory(field, column.data(), column.count(), column.lane_stride(), sizeof(T));
}

template <class T>
absl::Status check_output(absl::string_view field, const OutputColumn<T>& column, std::size_t lanes) {
  if (column.count() != lanes) return invalid(field, count_message(column.count(), lanes));
  if (lanes > 1 && column.stride() < sizeof(T))
    return invalid(field, absl::StrCat("stride of ", column.stride(), " bytes makes its own values overlap"));
  return check_memory(field, column.data(), column.count(), column.stride(), sizeof(T));
}

template absl::Status check_input(absl::string_view, const Column<float>&, std::size_t);
template absl::Status check_input(absl::string_view, const Column<std::uint8_t>&, std::size_t);
template absl::Status check_input(absl::string_view, const Column<std::uint64_t>&, std::size_t);
template absl::Status check_output(absl::string_view, const OutputColumn<float>&, std::size_t);
template absl::Status check_output(absl::string_view, const OutputColumn<std::uint8_t>&, std::size_t);
template absl::Status check_output(absl::string_view, const OutputColumn<std::uint32_t>&, std::size_t);

absl::Status check_active(const std::optional<std::span<const std::uint32_t>>& active, std::size_t lanes) {
  if (!active) return absl::OkStatus();
  if (active->size() > lanes)
    return invalid("active", absl::StrCat(active->size(), " indices for ", lanes, " lanes"));
  if (auto status = check_memory("active", active->data(), active->size(), 4, 4); !status.ok()) return status;
  std::uint32_t largest = 0;
  for (const std::uint32_t lane : *active) largest = lane > largest ? lane : largest;
  if (!active->empty() && largest >= lanes)
    return invalid("active", absl::StrCat("index ", largest, " in a batch of ", lanes, " lanes"));
  return absl::OkStatus();
}

namespace {

absl::Status check_inputs(Operation operation, const Batch& batch, const BatchColumns& columns) {
  const InputField* fields = input_fields().data();
  for (std::size_t k = 0; k < kInputs; ++k) {
    const Column<float>& column = *columns.in[k];
    const bool known = fields[k].operations & bit(operation);
    if (!known && !column.present()) continue;
    const absl::string_view field = view(fields[k].name);
    const bool random = k >= kU1;
    if (!column.present()) {
      const bool needed = !fields[k].otherwise && !(random && batch.generator) &&
                          reads(operation, batch.model, batch.sampler, static_cast<InputIndex>(k));
      if (!needed) continue;
      return invalid(field, random ? absl::StrCat("missing: ", view(name(batch.sampler)),
                                                  " needs it unless a generator is given")
                                   : absl::StrCat("missing: ", view(name(operation)), " needs it"));
    }
    if (!known) return invalid(field, absl::StrCat(view(name(operation)), " does not read it"));
    // A u3 that the sampler does not need does no harm.
    if (!random && !reads(operation, batch.model, batch.sampler, static_cast<InputIndex>(k)))
      return invalid(field, absl::StrCat("a ", view(name(batch.model.interface)), " interface does not read it"));
    if (random && batch.generator) return invalid("generator", absl::StrCat("given together with ", field));
    if (auto status = check_input(field, column, batch.lanes); !status.ok()) return status;
  }
  if (!batch.generator) return absl::OkStatus();
  if (!samples(operation)) return invalid("generator", absl::StrCat(view(name(operation)), " takes no random numbers"));
  if (!batch.generator->id.present()) return absl::OkStatus();
  return check_input("generator.id", batch.generator->id, batch.lanes);
}

absl::Status check_outputs(Operation operation, const Batch& batch, const BatchColumns& columns) {
  const OutputField* fields = output_fields().data();
  for (std::size_t k = 0; k < kOutputs; ++k) {
    const OutputColumn<float>& column = *columns.out[k];
    if (!column.present()) continue;
    const absl::string_view field = view(fields[k].name);
    if (!(fields[k].operations & bit(operation)))
      return invalid(field, absl::StrCat(view(name(operation)), " does not compute it"));
    if (!computes(operation, batch.model, static_cast<OutputIndex>(k)))
      return invalid(field, k == kOutShare ? "known in closed form for ggx with smith masking only"
                                           : "depends on the normal with vcavity masking");
    if (auto status = check_output(field, column, batch.lanes); !status.ok()) return status;
  }
  for (std::size_t k = 0; k < kByteOutputs; ++k) {
    const OutputColumn<std::uint8_t>& column = *columns.byte_out[k];
    if (!column.present()) continue;
    const absl::string_view field = view(byte_fields()[k].name);
    if (!(byte_fields()[k].operations & bit(operation)))
      return invalid(field, absl::StrCat(view(name(operation)), " does not compute it"));
    if (auto status = check_output(field, column, batch.lanes); !status.ok()) return status;
  }
  return absl::OkStatus();
}

struct Use {
  const std::string_view* field;
  MemoryUse memory;
};

// Outputs first.
struct Uses {
  static constexpr std::size_t kMost = std::size_t{kOutputs} + kByteOutputs + kInputs + 2;
  Use use[kMost];
  std::size_t outputs = 0, all = 0;
  void add(const std::string_view& field, const MemoryUse& memory) { use[all++] = {&field, memory}; }

  // Nearly always nothing meets, which comparisons without branches find quickest.
  bool any_meet() const {
    bool meet = false;
    for (std::size_t k = 0; k < outputs; ++k)
      for (std::size_t j = k + 1; j < all; ++j) meet |= ranges_meet(use[k].memory, use[j].memory);
    return meet;
  }
};

absl::Status check_overlap(const Batch& batch, const BatchColumns& columns) {
  static constexpr std::string_view kId = "generator.id", kActive = "active";
  Uses uses;
  for (std::size_t k = 0; k < kOutputs; ++k)
    if (columns.out[k]->present()) uses.add(output_fields()[k].name, memory_use(*columns.out[k]));
  for (std::size_t k = 0; k < kByteOutputs; ++k)
    if (columns.byte_out[k]->present()) uses.add(byte_fields()[k].name, memory_use(*columns.byte_out[k]));
  uses.outputs = uses.all;
  for (std::size_t k = 0; k < kInputs; ++k)
    if (columns.in[k]->present()) uses.add(input_fields()[k].name, memory_use(*columns.in[k]));
  if (batch.generator && batch.generator->id.present()) uses.add(kId, memory_use(batch.generator->id));
  if (batch.active) uses.add(kActive, memory_use(batch.active->data(), batch.active->size(), 4, 4));
  if (!uses.any_meet()) return absl::OkStatus();

  for (std::size_t k = 0; k < uses.outputs; ++k) {
    const Use& output = uses.use[k];
    for (std::size_t j = uses.outputs; j < uses.all; ++j) {
      const Use& input = uses.use[j];
      const bool same_lanes = output.memory == input.memory && input.field != &kActive;
      if (!same_lanes && share_memory(output.memory, input.memory))
        return invalid(view(*output.field), absl::StrCat("overlaps ", view(*input.field),
                                                         ": an output may be an input's own lanes or separate memory"));
    }
    for (std::size_t j = 0; j < k; ++j)
      if (share_memory(output.memory, uses.use[j].memory))
        return invalid(view(*output.field), absl::StrCat("overlaps ", view(*uses.use[j].field)));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status check(Operation operation, const Batch& batch) { return check(operation, batch, BatchColumns(batch)); }

absl::Status check(Operation operation, const Batch& batch, const BatchColumns& columns) {
  if (auto status = check_composition(operation, batch); !status.ok()) return status;
  if (auto status = check_active(batch.active, batch.lanes); !status.ok()) return status;
  if (auto status = check_inputs(operation, batch, columns); !status.ok()) return status;
  if (auto status = check_outputs(operation, batch, columns); !status.ok()) return status;
  return check_overlap(batch, columns);
}

}  // namespace facetwise
