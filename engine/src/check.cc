// The checks of a call, made once before anything is read or written.
#include "src/check.h"

#include <limits>
#include <numeric>
#include <string>

#include "absl/strings/str_cat.h"
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
  const std::size_t alignment = width == 1 ? 1 : 4;
  if (count == 0) return absl::OkStatus();
  if (data == nullptr) return invalid(field, "null pointer");
  if (address(data) % alignment != 0) return invalid(field, "not aligned to 4 bytes");
  if (count > 1 && stride % alignment != 0)
    return invalid(field, absl::StrCat("stride of ", stride, " bytes is not a multiple of 4"));
  if (count > 1 && stride > static_cast<std::size_t>(std::numeric_limits<std::ptrdiff_t>::max()) / (count - 1))
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
  std::uint32_t largest = 0;
  for (const std::uint32_t lane : *active) largest = lane > largest ? lane : largest;
  if (!active->empty() && largest >= lanes)
    return invalid("active", absl::StrCat("index ", largest, " in a batch of ", lanes, " lanes"));
  return absl::OkStatus();
}

namespace {

absl::Status check_choices(Operation operation, const Batch& batch) {
  if (operation > Operation::masking) return invalid("operation", "unknown value");
  if (batch.model.distribution > Distribution::ggx) return invalid("model.distribution", "unknown value");
  if (batch.model.masking > Masking::smith) return invalid("model.masking", "unknown value");
  if (batch.model.shadowing > Shadowing::uncorrelated) return invalid("model.shadowing", "unknown value");
  if (batch.sampler > Sampler::exact) return invalid("sampler", "unknown value");
  if (operation == Operation::sample_normal && !samples_normals(batch.sampler))
    return invalid("sampler", absl::StrCat(view(name(batch.sampler)),
                                           " samples reflections only; sample_normal takes ndf, heitz or cap"));
  return absl::OkStatus();
}

absl::Status check_inputs(Operation operation, Batch& batch) {
  const bool samples = operation == Operation::sample_normal || operation == Operation::sample_reflection;
  const auto& fields = input_fields();
  for (std::size_t k = 0; k < fields.size(); ++k) {
    const absl::string_view field = view(fields[k].name);
    const Column<float>& column = fields[k].column(batch);
    const bool known = fields[k].operations & bit(operation);
    const bool random = k >= kU1;
    if (!column.present()) {
      const bool needed = known && !(random && batch.generator) && !(k == kU3 && !uses_u3(batch.sampler));
      if (!needed) continue;
      return invalid(field, random ? absl::StrCat("missing: ", view(name(batch.sampler)),
                                                  " needs it unless a generator is given")
                                   : absl::StrCat("missing: ", view(name(operation)), " needs it"));
    }
    if (!known) return invalid(field, absl::StrCat(view(name(operation)), " does not read it"));
    if (random && batch.generator) return invalid("generator", absl::StrCat("given together with ", field));
    if (auto status = check_input(field, column, batch.lanes); !status.ok()) return status;
  }
  if (!batch.generator) return absl::OkStatus();
  if (!samples) return invalid("generator", absl::StrCat(view(name(operation)), " takes no random numbers"));
  if (!batch.generator->id.present()) return absl::OkStatus();
  return check_input("generator.id", batch.generator->id, batch.lanes);
}

absl::Status check_overlap(Batch& batch) {
  struct Use {
    absl::string_view field;
    MemoryUse memory;
  };
  Use inputs[kInputs + 2], outputs[kOutputs + 1];
  std::size_t input_count = 0, output_count = 0;
  for (const InputField& field : input_fields())
    if (const auto& column = field.column(batch); column.present())
      inputs[input_count++] = {view(field.name), memory_use(column)};
  if (batch.generator && batch.generator->id.present())
    inputs[input_count++] = {"generator.id", memory_use(batch.generator->id)};
  if (batch.active)
    inputs[input_count++] = {"active", memory_use(batch.active->data(), batch.active->size(), 4, 4)};
  for (const OutputField& field : output_fields())
    if (const auto& column = field.column(batch); column.present())
      outputs[output_count++] = {view(field.name), memory_use(column)};
  if (batch.out.status.present()) outputs[output_count++] = {"out.status", memory_use(batch.out.status)};

  for (std::size_t k = 0; k < output_count; ++k) {
    for (std::size_t j = 0; j < input_count; ++j) {
      const bool same_lanes = outputs[k].memory == inputs[j].memory && inputs[j].field != "active";
      if (!same_lanes && share_memory(outputs[k].memory, inputs[j].memory))
        return invalid(outputs[k].field, absl::StrCat("overlaps ", inputs[j].field, ": an output may be an input's ",
                                                      "own lanes or separate memory"));
    }
    for (std::size_t j = 0; j < k; ++j)
      if (share_memory(outputs[k].memory, outputs[j].memory))
        return invalid(outputs[k].field, absl::StrCat("overlaps ", outputs[j].field));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status check(Operation operation, const Batch& const_batch) {
  Batch batch = const_batch;  // the field tables hand out references to change; nothing is changed
  if (auto status = check_choices(operation, batch); !status.ok()) return status;
  if (auto status = check_active(batch.active, batch.lanes); !status.ok()) return status;
  if (auto status = check_inputs(operation, batch); !status.ok()) return status;
  for (const OutputField& field : output_fields()) {
    const auto& column = field.column(batch);
    if (!column.present()) continue;
    if (!(field.operations & bit(operation)))
      return invalid(view(field.name), absl::StrCat(view(name(operation)), " does not compute it"));
    if (auto status = check_output(view(field.name), column, batch.lanes); !status.ok()) return status;
  }
  if (batch.out.status.present())
    if (auto status = check_output("out.status", batch.out.status, batch.lanes); !status.ok()) return status;
  return check_overlap(batch);
}

}  // namespace facetwise
