#include "wire/fields.h"

namespace facetwise::wire {
namespace {

using Request = v1::BatchRequest;
using Response = v1::BatchResponse;

constexpr std::array<ColumnPlace, 11> kInputPlaces = {{
    {"incident.x", Request::kIncidentFieldNumber, 1},
    {"incident.y", Request::kIncidentFieldNumber, 2},
    {"incident.z", Request::kIncidentFieldNumber, 3},
    {"alpha_x", Request::kAlphaXFieldNumber, 0},
    {"alpha_y", Request::kAlphaYFieldNumber, 0},
    {"outgoing.x", Request::kOutgoingFieldNumber, 1},
    {"outgoing.y", Request::kOutgoingFieldNumber, 2},
    {"outgoing.z", Request::kOutgoingFieldNumber, 3},
    {"u1", Request::kU1FieldNumber, 0},
    {"u2", Request::kU2FieldNumber, 0},
    {"u3", Request::kU3FieldNumber, 0},
}};

constexpr std::array<OutputPlace, 13> kOutputPlaces = {{
    {"out.outgoing.x", Response::kOutgoingFieldNumber, 1, v1::OUTGOING},
    {"out.outgoing.y", Response::kOutgoingFieldNumber, 2, v1::OUTGOING},
    {"out.outgoing.z", Response::kOutgoingFieldNumber, 3, v1::OUTGOING},
    {"out.normal.x", Response::kNormalFieldNumber, 1, v1::NORMAL},
    {"out.normal.y", Response::kNormalFieldNumber, 2, v1::NORMAL},
    {"out.normal.z", Response::kNormalFieldNumber, 3, v1::NORMAL},
    {"out.incident_dot_normal", Response::kIncidentDotNormalFieldNumber, 0, v1::INCIDENT_DOT_NORMAL},
    {"out.pdf", Response::kPdfFieldNumber, 0, v1::PDF},
    {"out.weight", Response::kWeightFieldNumber, 0, v1::WEIGHT},
    {"out.value", Response::kValueFieldNumber, 0, v1::VALUE},
    {"out.masking", Response::kMaskingFieldNumber, 0, v1::MASKING_G1},
    {"out.projected_area", Response::kProjectedAreaFieldNumber, 0, v1::PROJECTED_AREA},
    {"out.share_unoccluded", Response::kShareUnoccludedFieldNumber, 0, v1::SHARE_UNOCCLUDED},
}};

// The protocol's values are the library's plus one: 0 is "unspecified".
static_assert(v1::SAMPLE_NORMAL == static_cast<int>(Operation::sample_normal) + 1);
static_assert(v1::MASKING == static_cast<int>(Operation::masking) + 1);
static_assert(v1::GGX == static_cast<int>(Distribution::ggx) + 1);
static_assert(v1::SMITH == static_cast<int>(Masking::smith) + 1);
static_assert(v1::UNCORRELATED == static_cast<int>(Shadowing::uncorrelated) + 1);
static_assert(v1::NDF == static_cast<int>(Sampler::ndf) + 1);
static_assert(v1::EXACT == static_cast<int>(Sampler::exact) + 1);

template <class T>
std::optional<T> from(int value, T last, std::optional<T> unspecified) {
  if (value == 0) return unspecified;
  if (value < 0 || value > static_cast<int>(last) + 1) return std::nullopt;
  return static_cast<T>(value - 1);
}

}  // namespace

std::span<const ColumnPlace> input_places() { return kInputPlaces; }
std::span<const OutputPlace> output_places() { return kOutputPlaces; }

std::optional<Operation> operation_from(int value) { return from(value, Operation::masking, {}); }
std::optional<Distribution> distribution_from(int value) {
  return from(value, Distribution::ggx, std::optional(Distribution::ggx));
}
std::optional<Masking> masking_from(int value) {
  return from(value, Masking::smith, std::optional(Masking::smith));
}
std::optional<Shadowing> shadowing_from(int value) {
  return from(value, Shadowing::uncorrelated, std::optional(Shadowing::correlated));
}
std::optional<Sampler> sampler_from(int value, Operation operation) {
  const Sampler unspecified = operation == Operation::sample_normal ? Sampler::cap : Sampler::exact;
  return from(value, Sampler::exact, std::optional(unspecified));
}

v1::Operation to_proto(Operation value) { return static_cast<v1::Operation>(static_cast<int>(value) + 1); }
v1::Distribution to_proto(Distribution value) {
  return static_cast<v1::Distribution>(static_cast<int>(value) + 1);
}
v1::Masking to_proto(Masking value) { return static_cast<v1::Masking>(static_cast<int>(value) + 1); }
v1::Shadowing to_proto(Shadowing value) { return static_cast<v1::Shadowing>(static_cast<int>(value) + 1); }
v1::SamplerKind to_proto(Sampler value) { return static_cast<v1::SamplerKind>(static_cast<int>(value) + 1); }

unsigned outputs_of(Operation operation) {
  unsigned outputs = 1u << v1::STATUS;
  for (std::size_t k = 0; k < kOutputPlaces.size(); ++k)
    if (output_fields()[k].operations & bit(operation)) outputs |= 1u << kOutputPlaces[k].output;
  return outputs;
}

}  // namespace facetwise::wire
