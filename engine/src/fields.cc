// SPDX-License-Identifier: Apache-2.0
// The batch's columns as public tables, and which calls read and compute them.
#include "src/fields.h"

#include <array>

namespace facetwise {
namespace {

using namespace known_to;

#define FACETWISE_FIELD(Name, member, operations, otherwise)                            \
  {#member, [](Batch& b) -> Column<float>& { return b.member; }, operations, otherwise, \
   (kRandomInputs >> k##Name & 1) != 0},
constexpr InputField kInputFields[] = {FACETWISE_INPUT_FIELDS(FACETWISE_FIELD)};
#undef FACETWISE_FIELD
#define FACETWISE_FIELD(Name, member, operations) \
  {"out." #member, [](Batch& b) -> OutputColumn<float>& { return b.out.member; }, operations},
constexpr OutputField kOutputFields[] = {FACETWISE_OUTPUT_FIELDS(FACETWISE_FIELD)};
#undef FACETWISE_FIELD
#define FACETWISE_FIELD(Name, member, operations) \
  {"out." #member, [](Batch& b) -> OutputColumn<std::uint8_t>& { return b.out.member; }, operations},
constexpr ByteField kByteFields[] = {FACETWISE_BYTE_FIELDS(FACETWISE_FIELD)};
#undef FACETWISE_FIELD

constexpr std::size_t kOperations = static_cast<std::size_t>(Operation::albedo) + 1;

// Bits of the fields that each operation knows.
template <class Field, std::size_t kCount>
constexpr std::array<unsigned, kOperations> known_by_operation(const Field (&fields)[kCount]) {
  std::array<unsigned, kOperations> known{};
  for (std::size_t operation = 0; operation < kOperations; ++operation)
    for (std::size_t k = 0; k < kCount; ++k)
      if (fields[k].operations >> operation & 1) known[operation] |= 1u << k;
  return known;
}
constexpr auto kKnownInputs = known_by_operation(kInputFields);
constexpr auto kKnownOutputs = known_by_operation(kOutputFields);
constexpr auto kKnownBytes = known_by_operation(kByteFields);

constexpr unsigned optional_inputs() {
  unsigned bits = 0;
  for (std::size_t k = 0; k < kInputs; ++k)
    if (kInputFields[k].otherwise) bits |= 1u << k;
  return bits;
}

}  // namespace

constinit const unsigned kOptionalInputs = optional_inputs();

std::span<const InputField> input_fields() { return kInputFields; }
std::span<const OutputField> output_fields() { return kOutputFields; }
std::span<const ByteField> byte_fields() { return kByteFields; }

unsigned inputs_read(Operation operation, const Model& model, Sampler sampler) {
  unsigned bits = kKnownInputs[static_cast<std::size_t>(operation)];
  if (model.interface != Interface::dielectric) bits &= ~(1u << kEta);
  if (model.interface != Interface::schlick) bits &= ~(1u << kF0 | 1u << kF90);
  if (operation != Operation::sample_scattering && !uses_u3(model, sampler)) bits &= ~(1u << kU3);
  return bits;
}

unsigned outputs_computed(Operation operation, const Model& model) {
  unsigned bits = kKnownOutputs[static_cast<std::size_t>(operation)];
  if (model.distribution != Distribution::ggx || model.masking != Masking::smith) bits &= ~(1u << kOutShare);
  if (model.masking != Masking::smith) bits &= ~(1u << kOutMasking);
  if (model.interface != Interface::dielectric) bits &= ~(1u << kOutTransmitted);
  return bits;
}

unsigned byte_outputs_computed(Operation operation) { return kKnownBytes[static_cast<std::size_t>(operation)]; }

bool reads(Operation operation, const Model& model, Sampler sampler, const InputField& field) {
  return inputs_read(operation, model, sampler) >> (&field - kInputFields) & 1;
}
bool computes(Operation operation, const Model& model, const OutputField& field) {
  return outputs_computed(operation, model) >> (&field - kOutputFields) & 1;
}
bool computes(Operation operation, const ByteField& field) {
  return byte_outputs_computed(operation) >> (&field - kByteFields) & 1;
}

Statistics& Statistics::operator+=(const Statistics& other) {
  accepted += other.accepted;
  occluded += other.occluded;
  smooth += other.smooth;
  invalid += other.invalid;
  return *this;
}

}  // namespace facetwise
