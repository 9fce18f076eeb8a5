// The batch's columns as public tables, and which calls read and compute them.
#include "src/fields.h"

#include "src/composition.h"

namespace facetwise {
namespace {

using namespace known_to;

#define FACETWISE_FIELD(Name, member, operations, otherwise) \
  {#member, [](Batch& b) -> Column<float>& { return b.member; }, operations, otherwise},
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

}  // namespace

std::span<const InputField> input_fields() { return kInputFields; }
std::span<const OutputField> output_fields() { return kOutputFields; }
std::span<const ByteField> byte_fields() { return kByteFields; }

bool reads(Operation operation, const Model& model, Sampler sampler, InputIndex input) {
  if (!(kInputFields[input].operations & bit(operation))) return false;
  switch (input) {
    case kEta: return model.interface == Interface::dielectric;
    case kF0:
    case kF90: return model.interface == Interface::schlick;
    case kU3: return operation == Operation::sample_scattering || uses_u3(model, sampler);
    default: return true;
  }
}

bool reads(Operation operation, const Model& model, Sampler sampler, const InputField& field) {
  return reads(operation, model, sampler, static_cast<InputIndex>(&field - kInputFields));
}

bool computes(Operation operation, const Model& model, OutputIndex output) {
  if (!(kOutputFields[output].operations & bit(operation))) return false;
  if (output == kOutShare) return model.distribution == Distribution::ggx && model.masking == Masking::smith;
  if (output == kOutMasking) return model.masking == Masking::smith;
  return true;
}

bool computes(Operation operation, const Model& model, const OutputField& field) {
  return computes(operation, model, static_cast<OutputIndex>(&field - kOutputFields));
}

Statistics& Statistics::operator+=(const Statistics& other) {
  accepted += other.accepted;
  occluded += other.occluded;
  smooth += other.smooth;
  invalid += other.invalid;
  return *this;
}

}  // namespace facetwise
