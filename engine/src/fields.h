// SPDX-License-Identifier: Apache-2.0
// Every column of a batch, declared once. The public tables (batch.h), the indices of a tile's columns and the
// batch's columns by these indices are made from the lists here.
#pragma once

#include <cstddef>
#include <optional>

#include "facetwise/batch.h"

namespace facetwise {

// Sets of operations.
namespace known_to {
using enum Operation;
inline constexpr unsigned kReflected = bit(sample_reflection);
inline constexpr unsigned kScattered = bit(sample_transmission) | bit(sample_scattering);
inline constexpr unsigned kSample = bit(sample_normal) | kReflected | kScattered;
inline constexpr unsigned kSides = bit(evaluate_transmission) | bit(evaluate_scattering);
inline constexpr unsigned kQuery = bit(pdf_reflection) | bit(evaluate_reflection) | kSides;
inline constexpr unsigned kMasking = bit(masking);
inline constexpr unsigned kAlbedo = bit(albedo);
inline constexpr unsigned kEvery = kSample | kQuery | kMasking | kAlbedo;
inline constexpr unsigned kReflectance = kReflected | bit(evaluate_reflection);
inline constexpr unsigned kDielectric = kReflectance | kScattered | kSides | kAlbedo;
inline constexpr unsigned kDirection = kReflected | kScattered;
inline constexpr unsigned kDensity = kSample | kQuery;
inline constexpr unsigned kValue = bit(evaluate_reflection) | kSides;
inline constexpr unsigned kEvent = bit(sample_scattering);
inline constexpr unsigned kBranch = bit(sample_scattering) | bit(evaluate_scattering);
}  // namespace known_to

// X(index, member of Batch, operations that know it, what a missing column means)
#define FACETWISE_INPUT_FIELDS(X)                 \
  X(Ix, incident.x, kEvery, std::nullopt)         \
  X(Iy, incident.y, kEvery, std::nullopt)         \
  X(Iz, incident.z, kEvery, std::nullopt)         \
  X(AlphaX, alpha_x, kEvery, std::nullopt)        \
  X(AlphaY, alpha_y, kEvery, std::nullopt)        \
  X(MeanX, mean_slope_x, kEvery, 0.0f)            \
  X(MeanY, mean_slope_y, kEvery, 0.0f)            \
  X(Correlation, slope_correlation, kEvery, 0.0f) \
  X(Eta, eta, kDielectric, std::nullopt)          \
  X(F0, f0, kReflectance, std::nullopt)           \
  X(F90, f90, kReflectance, 1.0f)                 \
  X(Ox, outgoing.x, kQuery, std::nullopt)         \
  X(Oy, outgoing.y, kQuery, std::nullopt)         \
  X(Oz, outgoing.z, kQuery, std::nullopt)         \
  X(U1, u1, kSample, std::nullopt)                \
  X(U2, u2, kSample, std::nullopt)                \
  X(U3, u3, kSample, std::nullopt)

// X(index, member of Batch::out, operations that know it)
#define FACETWISE_OUTPUT_FIELDS(X)       \
  X(Ox, outgoing.x, kDirection)          \
  X(Oy, outgoing.y, kDirection)          \
  X(Oz, outgoing.z, kDirection)          \
  X(Mx, normal.x, kSample)               \
  X(My, normal.y, kSample)               \
  X(Mz, normal.z, kSample)               \
  X(Im, incident_dot_normal, kSample)    \
  X(Pdf, pdf, kDensity)                  \
  X(Weight, weight, kDirection)          \
  X(Value, value, kValue)                \
  X(Masking, masking, kMasking)          \
  X(Area, projected_area, kMasking)      \
  X(Share, share_unoccluded, kMasking)   \
  X(Branch, branch_probability, kBranch) \
  X(EtaScale, eta_scale, kScattered)     \
  X(Albedo, albedo, kAlbedo)             \
  X(MeanAlbedo, mean_albedo, kAlbedo)    \
  X(Transmitted, transmitted, kAlbedo)

#define FACETWISE_BYTE_FIELDS(X) \
  X(Status, status, kEvery)      \
  X(Event, event, kEvent)

// kIx, ...; kOutOx, ...; kOutStatus, ...
#define FACETWISE_INDEX(Name, ...) k##Name,
enum InputIndex { FACETWISE_INPUT_FIELDS(FACETWISE_INDEX) kInputs };
#undef FACETWISE_INDEX
#define FACETWISE_INDEX(Name, ...) kOut##Name,
enum OutputIndex { FACETWISE_OUTPUT_FIELDS(FACETWISE_INDEX) kOutputs };
enum ByteIndex { FACETWISE_BYTE_FIELDS(FACETWISE_INDEX) kByteOutputs };
#undef FACETWISE_INDEX

// A batch's columns by these indices.
struct BatchColumns {
#define FACETWISE_COLUMN(Name, member, ...) &b.member,
#define FACETWISE_OUTPUT_COLUMN(Name, member, ...) &b.out.member,
  explicit BatchColumns(const Batch& b)
      : in{FACETWISE_INPUT_FIELDS(FACETWISE_COLUMN)},
        out{FACETWISE_OUTPUT_FIELDS(FACETWISE_OUTPUT_COLUMN)},
        byte_out{FACETWISE_BYTE_FIELDS(FACETWISE_OUTPUT_COLUMN)} {}
#undef FACETWISE_COLUMN
#undef FACETWISE_OUTPUT_COLUMN
  const Column<float>* in[kInputs];
  const OutputColumn<float>* out[kOutputs];
  const OutputColumn<std::uint8_t>* byte_out[kByteOutputs];
};

// Those that are present, and as bits (1 << index).
struct PresentColumns {
  explicit PresentColumns(const Batch& b) {
    const auto add = [](const auto& column, auto index, auto* list, unsigned& count, unsigned& bits) {
      if (!column.present()) return;
      list[count++] = {index, &column};
      bits |= 1u << index;
    };
    // In locals, which stay in registers.
    unsigned count = 0, bits = 0;
#define FACETWISE_ADD(Name, member, ...) add(b.member, k##Name, in, count, bits);
    FACETWISE_INPUT_FIELDS(FACETWISE_ADD)
#undef FACETWISE_ADD
    in_count = count, in_bits = bits, count = bits = 0;
#define FACETWISE_ADD(Name, member, ...) add(b.out.member, kOut##Name, out, count, bits);
    FACETWISE_OUTPUT_FIELDS(FACETWISE_ADD)
#undef FACETWISE_ADD
    out_count = count, out_bits = bits, count = bits = 0;
#define FACETWISE_ADD(Name, member, ...) add(b.out.member, kOut##Name, byte_out, count, bits);
    FACETWISE_BYTE_FIELDS(FACETWISE_ADD)
#undef FACETWISE_ADD
    byte_out_count = count, byte_out_bits = bits;
  }
  template <class Column, class Index>
  struct Present {
    Index index;
    const Column* column;
  };
  Present<Column<float>, InputIndex> in[kInputs];
  Present<OutputColumn<float>, OutputIndex> out[kOutputs];
  Present<OutputColumn<std::uint8_t>, ByteIndex> byte_out[kByteOutputs];
  unsigned in_count, out_count, byte_out_count;
  unsigned in_bits, out_bits, byte_out_bits;
};

// Which columns a call reads, and which it can compute, as bits (1 << index). Those in kOptionalInputs may be missing.
unsigned inputs_read(Operation operation, const Model& model, Sampler sampler);
unsigned outputs_computed(Operation operation, const Model& model);
unsigned byte_outputs_computed(Operation operation);
extern const unsigned kOptionalInputs;
inline constexpr unsigned kRandomInputs = 1u << kU1 | 1u << kU2 | 1u << kU3;

}  // namespace facetwise
