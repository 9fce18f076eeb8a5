#include "wire/fields.h"

#include <algorithm>

namespace facetwise::wire {
namespace {

using Request = v1::BatchRequest;
using Response = v1::BatchResponse;

constexpr std::array<ColumnPlace, 17> kInputPlaces = {{
    {"incident.x", Request::kIncidentFieldNumber, 1},
    {"incident.y", Request::kIncidentFieldNumber, 2},
    {"incident.z", Request::kIncidentFieldNumber, 3},
    {"alpha_x", Request::kAlphaXFieldNumber, 0},
    {"alpha_y", Request::kAlphaYFieldNumber, 0},
    {"mean_slope_x", Request::kMeanSlopeXFieldNumber, 0},
    {"mean_slope_y", Request::kMeanSlopeYFieldNumber, 0},
    {"slope_correlation", Request::kSlopeCorrelationFieldNumber, 0},
    {"eta", Request::kEtaFieldNumber, 0},
    {"f0", Request::kF0FieldNumber, 0},
    {"f90", Request::kF90FieldNumber, 0},
    {"outgoing.x", Request::kOutgoingFieldNumber, 1},
    {"outgoing.y", Request::kOutgoingFieldNumber, 2},
    {"outgoing.z", Request::kOutgoingFieldNumber, 3},
    {"u1", Request::kU1FieldNumber, 0},
    {"u2", Request::kU2FieldNumber, 0},
    {"u3", Request::kU3FieldNumber, 0},
}};

constexpr std::array<OutputPlace, 15> kOutputPlaces = {{
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
    {"out.branch_probability", Response::kBranchProbabilityFieldNumber, 0, v1::BRANCH_PROBABILITY},
    {"out.eta_scale", Response::kEtaScaleFieldNumber, 0, v1::ETA_SCALE},
}};

constexpr std::array<OutputPlace, 2> kBytePlaces = {{
    {"out.status", Response::kStatusFieldNumber, 0, v1::STATUS},
    {"out.event", Response::kEventFieldNumber, 0, v1::EVENT},
}};

// The protocol's values are the library's plus one: 0 is "unspecified".
static_assert(v1::SAMPLE_NORMAL == static_cast<int>(Operation::sample_normal) + 1);
static_assert(v1::EVALUATE_SCATTERING == static_cast<int>(Operation::evaluate_scattering) + 1);
static_assert(v1::GGX == static_cast<int>(Distribution::ggx) + 1);
static_assert(v1::TABLE == static_cast<int>(Distribution::table) + 1);
static_assert(v1::SMITH == static_cast<int>(Masking::smith) + 1);
static_assert(v1::VCAVITY == static_cast<int>(Masking::vcavity) + 1);
static_assert(v1::UNCORRELATED == static_cast<int>(Shadowing::uncorrelated) + 1);
static_assert(v1::BIASED == static_cast<int>(Normalisation::biased) + 1);
static_assert(v1::DIELECTRIC == static_cast<int>(Interface::dielectric) + 1);
static_assert(v1::IMPORTANCE == static_cast<int>(Transport::importance) + 1);
static_assert(v1::NDF == static_cast<int>(Sampler::ndf) + 1);
static_assert(v1::VISIBLE == static_cast<int>(Sampler::visible) + 1);
// Those of a lane are the library's own.
static_assert(v1::INVALID == static_cast<int>(LaneStatus::invalid));
static_assert(v1::TRANSMISSION == static_cast<int>(Event::transmission));

template <class T>
std::optional<T> from(int value, T last, std::optional<T> unspecified) {
  if (value == 0) return unspecified;
  if (value < 0 || value > static_cast<int>(last) + 1) return std::nullopt;
  return static_cast<T>(value - 1);
}

template <class P, class T>
P to(T value) {
  return static_cast<P>(static_cast<int>(value) + 1);
}

}  // namespace

std::span<const ColumnPlace> input_places() { return kInputPlaces; }
std::span<const OutputPlace> output_places() { return kOutputPlaces; }
std::span<const OutputPlace> byte_places() { return kBytePlaces; }

std::optional<Operation> operation_from(int value) { return from(value, Operation::evaluate_scattering, {}); }
std::optional<Distribution> distribution_from(int value) {
  return from(value, Distribution::table, std::optional(Distribution::ggx));
}
std::optional<Masking> masking_from(int value) {
  return from(value, Masking::vcavity, std::optional(Masking::smith));
}
std::optional<Shadowing> shadowing_from(int value) {
  return from(value, Shadowing::uncorrelated, std::optional(Shadowing::correlated));
}
std::optional<Normalisation> normalisation_from(int value) {
  return from(value, Normalisation::biased, std::optional(Normalisation::unbiased));
}
std::optional<Interface> interface_from(int value) {
  return from(value, Interface::dielectric, std::optional(Interface::conductor));
}
std::optional<Transport> transport_from(int value) {
  return from(value, Transport::importance, std::optional(Transport::radiance));
}
std::optional<Sampler> sampler_from(int value, Operation operation, const Model& model) {
  return from(value, Sampler::visible, std::optional(default_sampler(operation, model)));
}

v1::Operation to_proto(Operation value) { return to<v1::Operation>(value); }
v1::Distribution to_proto(Distribution value) { return to<v1::Distribution>(value); }
v1::Masking to_proto(Masking value) { return to<v1::Masking>(value); }
v1::Shadowing to_proto(Shadowing value) { return to<v1::Shadowing>(value); }
v1::Normalisation to_proto(Normalisation value) { return to<v1::Normalisation>(value); }
v1::Interface to_proto(Interface value) { return to<v1::Interface>(value); }
v1::Transport to_proto(Transport value) { return to<v1::Transport>(value); }
v1::SamplerKind to_proto(Sampler value) { return to<v1::SamplerKind>(value); }

Sampler default_sampler(Operation operation, const Model& model) {
  const auto samplers = samplers_for(operation, model);
  const bool exact = std::find(samplers.begin(), samplers.end(), Sampler::exact) != samplers.end();
  return exact ? Sampler::exact : Sampler::visible;
}

unsigned outputs_of(Operation operation) {
  unsigned outputs = 0;
  for (std::size_t k = 0; k < kOutputPlaces.size(); ++k)
    if (output_fields()[k].operations & bit(operation)) outputs |= 1u << kOutputPlaces[k].output;
  for (std::size_t k = 0; k < kBytePlaces.size(); ++k)
    if (byte_fields()[k].operations & bit(operation)) outputs |= 1u << kBytePlaces[k].output;
  return outputs;
}

}  // namespace facetwise::wire
