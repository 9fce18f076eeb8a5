// SPDX-License-Identifier: Apache-2.0
// Where the batch's columns are in the messages.
#pragma once

#include <array>
#include <bit>
#include <optional>
#include <span>

#include "facetwise/batch.h"
#include "facetwise/v1/sampler.pb.h"

namespace facetwise::wire {

static_assert(std::endian::native == std::endian::little, "columns are sent as they lie in memory");

// A column's place: a field of the message, or part 1, 2, 3 (x, y, z) of a Direction in that field. The messages'
// fields have the names of the batch's.
struct ColumnPlace {
  std::string_view name;
  int field;
  int part;
};
// In the order of input_fields().
std::span<const ColumnPlace> input_places();

struct OutputPlace {
  std::string_view name;
  int field;
  int part;
  v1::Output output;  // what asks for it
};
// In the order of output_fields().
std::span<const OutputPlace> output_places();
// In the order of byte_fields().
std::span<const OutputPlace> byte_places();

// The library's values for the protocol's and back; nothing for a value that is unknown. The unspecified
// ones mean what the protocol says.
std::optional<Operation> operation_from(int value);
std::optional<Distribution> distribution_from(int value);
std::optional<Masking> masking_from(int value);
std::optional<Shadowing> shadowing_from(int value);
std::optional<Normalisation> normalisation_from(int value);
std::optional<Interface> interface_from(int value);
std::optional<Transport> transport_from(int value);
std::optional<Compensation> compensation_from(int value);
std::optional<Sampler> sampler_from(int value, Sampler unspecified);
v1::Operation to_proto(Operation value);
v1::Distribution to_proto(Distribution value);
v1::Masking to_proto(Masking value);
v1::Shadowing to_proto(Shadowing value);
v1::Normalisation to_proto(Normalisation value);
v1::Interface to_proto(Interface value);
v1::Transport to_proto(Transport value);
v1::Compensation to_proto(Compensation value);
v1::SamplerKind to_proto(Sampler value);

// Bit (1 << Output) for each output that the operation has.
unsigned outputs_of(Operation operation);

}  // namespace facetwise::wire
