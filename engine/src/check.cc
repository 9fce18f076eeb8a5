// SPDX-License-Identifier: Apache-2.0
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
  if (active->size() > lanes) return invalid("active", absl::StrCat(active->size(), " indices for ", lanes, " lanes"));
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
  const unsigned read_bits = inputs_read(operation, batch.model, batch.sampler);
  for (std::size_t k = 0; k < kInputs; ++k) {
    const Column<float>& column = *columns.in[k];
    const bool known = fields[k].operations & bit(operation);
    if (!known && !column.present()) continue;
    const absl::string_view field = view(fields[k].name);
    const bool random = fields[k].random, read = read_bits >> k & 1;
    if (!column.present()) {
      const bool needed = read && !fields[k].otherwise && !(random && batch.generator);
      if (!needed) continue;
      return invalid(
          field, random ? absl::StrCat("missing: ", view(name(batch.sampler)), " needs it unless a generator is given")
                        : absl::StrCat("missing: ", view(name(operation)), " needs it"));
    }
    if (!known) return invalid(field, absl::StrCat(view(name(operation)), " does not read it"));
    // A u3 that the sampler does not need does no harm.
    if (!random && !read)
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
    if (!computes(operation, batch.model, fields[k]))
      return invalid(field, k == kOutShare         ? "known in closed form for ggx with smith masking only"
                            : k == kOutTransmitted ? "needs a dielectric interface"
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

absl::Status check_overlap(const Batch& batch, const BatchColumns& columns) {
  static constexpr std::string_view kId = "generator.id", kActive = "active";
  Use outputs[std::size_t{kOutputs} + kByteOutputs], inputs[kInputs + 2];
  std::size_t output_count = 0, input_count = 0;
  for (std::size_t k = 0; k < kOutputs; ++k)
    if (columns.out[k]->present()) outputs[output_count++] = {&output_fields()[k].name, memory_use(*columns.out[k])};
  for (std::size_t k = 0; k < kByteOutputs; ++k)
    if (columns.byte_out[k]->present())
      outputs[output_count++] = {&byte_fields()[k].name, memory_use(*columns.byte_out[k])};
  for (std::size_t k = 0; k < kInputs; ++k)
    if (columns.in[k]->present()) inputs[input_count++] = {&input_fields()[k].name, memory_use(*columns.in[k])};
  if (batch.generator && batch.generator->id.present()) inputs[input_count++] = {&kId, memory_use(batch.generator->id)};
  if (batch.active) inputs[input_count++] = {&kActive, memory_use(batch.active->data(), batch.active->size(), 4, 4)};

  for (std::size_t k = 0; k < output_count; ++k) {
    const Use& output = outputs[k];
    for (const Use& input : std::span(inputs, input_count)) {
      const bool same_lanes = output.memory == input.memory && input.field != &kActive;
      if (!same_lanes && share_memory(output.memory, input.memory))
        return invalid(view(*output.field), absl::StrCat("overlaps ", view(*input.field),
                                                         ": an output may be an input's own lanes or separate memory"));
    }
    for (const Use& other : std::span(outputs, k))
      if (share_memory(output.memory, other.memory))
        return invalid(view(*output.field), absl::StrCat("overlaps ", view(*other.field)));
  }
  return absl::OkStatus();
}

// True of nearly all calls, and then nothing is wrong with the columns: all are contiguous, of one value per lane
// (inputs perhaps of one value for all), known to the call, aligned and apart. Decided with few branches, since every
// call pays for it; where it is false the checks above find out what is wrong, if anything is.
bool plainly_right(Operation operation, const Batch& batch, const PresentColumns& columns) {
  if (batch.active || batch.lanes == 0 || (batch.generator && (!samples(operation) || batch.generator->id.present())))
    return false;
  unsigned read = inputs_read(operation, batch.model, batch.sampler);
  if (batch.generator) read &= ~kRandomInputs;
  if ((columns.in_bits & ~read) | (read & ~(columns.in_bits | kOptionalInputs)) |
      (columns.out_bits & ~outputs_computed(operation, batch.model)) |
      (columns.byte_out_bits & ~byte_outputs_computed(operation)))
    return false;

  const std::size_t lanes = batch.lanes, bytes = lanes * sizeof(float);
  if (lanes > PTRDIFF_MAX / sizeof(float)) return false;
  std::uintptr_t low[std::size_t{kInputs} + kOutputs + kByteOutputs], out[std::size_t{kOutputs} + kByteOutputs],
      wrong = 0;
  std::size_t low_count = 0, out_count = 0;
  const auto fits = [&](const auto& column, std::size_t width) -> std::uintptr_t {
    const std::uintptr_t data = address(column.data());
    wrong |= (column.count() ^ lanes) | (column.stride() ^ width) | (data & (width - 1)) |
             std::uintptr_t{data - 1 > UINTPTR_MAX - 1 - bytes};
    return data;
  };
  for (const auto& [index, column] : std::span(columns.in, columns.in_count)) {
    if (column->one_value()) {
      wrong |= address(column->data()) & (sizeof(float) - 1);
      wrong |= std::uintptr_t{column->data() == nullptr};
      low[low_count++] = address(column->data()) - (bytes - 1);
    } else {
      low[low_count++] = fits(*column, sizeof(float)) - (bytes - 1);
    }
  }
  for (const auto& [index, column] : std::span(columns.out, columns.out_count))
    out[out_count++] = fits(*column, sizeof(float));
  for (const auto& [index, column] : std::span(columns.byte_out, columns.byte_out_count))
    out[out_count++] = fits(*column, 1);

  // Two columns meet if their distance is less than their length, as if byte columns and single values were as long as
  // the others. `low` is where a column begins that ends with another's first byte.
  std::size_t meetings = 0;
  for (std::size_t k = 0; k < out_count; ++k) {
#pragma GCC unroll 4
    for (std::size_t j = 0; j < low_count; ++j) meetings += out[k] - low[j] < 2 * bytes - 1;
    low[low_count++] = out[k] - (bytes - 1);
  }
  return wrong == 0 && meetings == 0;
}

}  // namespace

absl::Status check(Operation operation, const Batch& batch) { return check(operation, batch, PresentColumns(batch)); }

absl::Status check(Operation operation, const Batch& batch, const PresentColumns& present) {
  if (auto status = check_composition(operation, batch); !status.ok()) return status;
  if (plainly_right(operation, batch, present)) return absl::OkStatus();
  if (auto status = check_active(batch.active, batch.lanes); !status.ok()) return status;
  const BatchColumns columns(batch);
  if (auto status = check_inputs(operation, batch, columns); !status.ok()) return status;
  if (auto status = check_outputs(operation, batch, columns); !status.ok()) return status;
  return check_overlap(batch, columns);
}

}  // namespace facetwise
