// What a kernel sees: pointers to contiguous lanes. Strides, active lists, one-value columns and generated
// numbers are resolved before (batch.cc), so that kernels know nothing of them.
#pragma once

#include <cstddef>
#include <cstdint>

#include "facetwise/batch.h"
#include "facetwise/target.h"

namespace facetwise {

// Indices of a tile's columns: the order of input_fields() and output_fields().
enum InputIndex { kIx, kIy, kIz, kAlphaX, kAlphaY, kOx, kOy, kOz, kU1, kU2, kU3, kInputs };
enum OutputIndex {
  kOutOx, kOutOy, kOutOz, kOutMx, kOutMy, kOutMz, kOutIm, kOutPdf, kOutWeight, kOutValue, kOutMasking,
  kOutArea, kOutShare, kOutputs
};

inline constexpr unsigned kWantsNormal = 1;  // m or i.m
inline constexpr unsigned kWantsPdf = 2;
inline constexpr unsigned kWantsWeight = 4;
inline constexpr unsigned kWantsShare = 8;
inline constexpr unsigned kWantsStatus = 16;

// A batch's columns by these indices.
struct BatchColumns {
  const Column<float>* in[kInputs];
  const OutputColumn<float>* out[kOutputs];
  explicit BatchColumns(const Batch& b)
      : in{&b.incident.x, &b.incident.y, &b.incident.z, &b.alpha_x, &b.alpha_y, &b.outgoing.x,
           &b.outgoing.y, &b.outgoing.z, &b.u1,         &b.u2,      &b.u3},
        out{&b.out.outgoing.x, &b.out.outgoing.y, &b.out.outgoing.z, &b.out.normal.x,
            &b.out.normal.y,   &b.out.normal.z,   &b.out.incident_dot_normal, &b.out.pdf,
            &b.out.weight,     &b.out.value,      &b.out.masking, &b.out.projected_area,
            &b.out.share_unoccluded} {}
};

// The most lanes that a kernel takes at once: two of the widest vectors. Every buffer of a tile may be read and written up to the next
// multiple of it.
inline constexpr std::size_t kWidest = 32;

struct Tile {
  std::size_t lanes = 0;
  const float* in[kInputs] = {};   // those that the operation reads
  float* out[kOutputs] = {};       // all that it has; unwanted ones are scratch memory
  std::uint8_t* status = nullptr;  // null unless wanted has kWantsStatus
  unsigned wanted = 0;             // kWants...: where leaving an output out saves work
  bool uncorrelated = false;       // Shadowing::uncorrelated
};

// Adds the tile's lanes that are not accepted to the statistics.
using Kernel = void (*)(const Tile& tile, Statistics& statistics);

// Philox words of `lanes` lanes as uniform numbers; u[k] may be null. Ids are first_id + lane, or those of
// id where it is given.
struct PhiloxTile {
  std::size_t lanes = 0;
  std::uint64_t seed = 0;
  std::uint32_t dimension = 0;
  std::uint64_t first_id = 0;
  const std::uint64_t* id = nullptr;
  float* u[3] = {};
};

// One target's kernels. Samplers are indexed by Sampler; entries that do not exist are null.
struct KernelTable {
  Kernel sample_normal[5];
  Kernel sample_reflection[5];
  Kernel pdf_reflection[5];
  Kernel evaluate_reflection;
  Kernel evaluate_and_pdf[5];
  Kernel masking;
  void (*philox)(const PhiloxTile& tile);
  std::size_t vector_lanes;
};

// The kernels of an available target (target.h), full vectors or one lane wide.
const KernelTable& kernels(Target target, bool one_lane);

}  // namespace facetwise
