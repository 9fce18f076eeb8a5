// SPDX-License-Identifier: Apache-2.0
#include "wire/fields.h"

#include <cctype>
#include <stdexcept>
#include <string>
#include <vector>

namespace facetwise::wire {
namespace {

// The place of "incident.x" or "pdf" in a message. A field that the message has not is a mistake in the protocol, which
// every program would stop at.
ColumnPlace place_of(const google::protobuf::Descriptor& message, std::string_view name, std::string_view member) {
  const std::size_t dot = member.find('.');
  const auto* field = message.FindFieldByName(std::string(member.substr(0, dot)));
  if (field == nullptr) throw std::logic_error("the protocol lacks " + std::string(name));
  return {name, field->number(), dot == std::string_view::npos ? 0 : member[dot + 1] - 'x' + 1};
}

template <class Fields>
std::vector<OutputPlace> places_of_outputs(const Fields& fields) {
  std::vector<OutputPlace> places;
  for (const auto& field : fields) {
    const std::string_view member = field.name.substr(std::string_view("out.").size());
    const ColumnPlace place = place_of(*v1::BatchResponse::descriptor(), field.name, member);
    std::string output(member.substr(0, member.find('.')));
    for (char& c : output) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    // These are operations.
    if (output == "MASKING") output = "MASKING_G1";
    if (output == "ALBEDO") output = "DIRECTIONAL_ALBEDO";
    OutputPlace& added = places.emplace_back(OutputPlace{place.name, place.field, place.part, v1::OUTPUT_UNSPECIFIED});
    if (!v1::Output_Parse(output, &added.output)) throw std::logic_error("the protocol lacks the output " + output);
  }
  return places;
}

// The protocol's values are the library's plus one: 0 is "unspecified".
static_assert(v1::SAMPLE_NORMAL == static_cast<int>(Operation::sample_normal) + 1);
static_assert(v1::ALBEDO == static_cast<int>(Operation::albedo) + 1);
static_assert(v1::GGX == static_cast<int>(Distribution::ggx) + 1);
static_assert(v1::TABLE == static_cast<int>(Distribution::table) + 1);
static_assert(v1::SMITH == static_cast<int>(Masking::smith) + 1);
static_assert(v1::VCAVITY == static_cast<int>(Masking::vcavity) + 1);
static_assert(v1::UNCORRELATED == static_cast<int>(Shadowing::uncorrelated) + 1);
static_assert(v1::BIASED == static_cast<int>(Normalisation::biased) + 1);
static_assert(v1::DIELECTRIC == static_cast<int>(Interface::dielectric) + 1);
static_assert(v1::IMPORTANCE == static_cast<int>(Transport::importance) + 1);
static_assert(v1::KELEMEN == static_cast<int>(Compensation::kelemen) + 1);
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

std::span<const ColumnPlace> input_places() {
  static const std::vector<ColumnPlace> places = [] {
    std::vector<ColumnPlace> result;
    for (const InputField& field : input_fields())
      result.push_back(place_of(*v1::BatchRequest::descriptor(), field.name, field.name));
    return result;
  }();
  return places;
}
std::span<const OutputPlace> output_places() {
  static const std::vector<OutputPlace> places = places_of_outputs(output_fields());
  return places;
}
std::span<const OutputPlace> byte_places() {
  static const std::vector<OutputPlace> places = places_of_outputs(byte_fields());
  return places;
}

std::optional<Operation> operation_from(int value) { return from(value, Operation::albedo, {}); }
std::optional<Distribution> distribution_from(int value) {
  return from(value, Distribution::table, std::optional(Distribution::ggx));
}
std::optional<Masking> masking_from(int value) { return from(value, Masking::vcavity, std::optional(Masking::smith)); }
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
std::optional<Compensation> compensation_from(int value) {
  return from(value, Compensation::kelemen, std::optional(Compensation::none));
}
std::optional<Sampler> sampler_from(int value, Sampler unspecified) {
  return from(value, Sampler::visible, std::optional(unspecified));
}

v1::Operation to_proto(Operation value) { return to<v1::Operation>(value); }
v1::Distribution to_proto(Distribution value) { return to<v1::Distribution>(value); }
v1::Masking to_proto(Masking value) { return to<v1::Masking>(value); }
v1::Shadowing to_proto(Shadowing value) { return to<v1::Shadowing>(value); }
v1::Normalisation to_proto(Normalisation value) { return to<v1::Normalisation>(value); }
v1::Interface to_proto(Interface value) { return to<v1::Interface>(value); }
v1::Transport to_proto(Transport value) { return to<v1::Transport>(value); }
v1::Compensation to_proto(Compensation value) { return to<v1::Compensation>(value); }
v1::SamplerKind to_proto(Sampler value) { return to<v1::SamplerKind>(value); }

unsigned outputs_of(Operation operation) {
  unsigned outputs = 0;
  const auto add = [&](const auto& fields, const auto& places) {
    for (std::size_t k = 0; k < places.size(); ++k)
      if (fields[k].operations & bit(operation)) outputs |= 1u << places[k].output;
  };
  add(output_fields(), output_places());
  add(byte_fields(), byte_places());
  return outputs;
}

}  // namespace facetwise::wire
