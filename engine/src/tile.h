// SPDX-License-Identifier: Apache-2.0
// What a kernel sees: pointers to contiguous lanes. Strides, active lists, one-value columns and generated
// numbers are resolved before (stage.h), so that kernels know nothing of them.
#pragma once

#include <cstddef>
#include <cstdint>

#include "facetwise/albedo_table.h"
#include "facetwise/batch.h"
#include "facetwise/slope_table.h"
#include "facetwise/target.h"
#include "src/fields.h"

namespace facetwise {

// The largest pdf and value: one can be beyond the floats straight below a smooth surface.
inline constexpr float kLargestDensity = 3e38f;

// Floats of a cache line.
inline constexpr std::size_t kLine = 16;

// Bits of Tile::wanted and Tile::streamed.
constexpr unsigned bit(OutputIndex output) { return 1u << output; }
inline constexpr unsigned kWantsDirection = bit(kOutOx) | bit(kOutOy) | bit(kOutOz);
inline constexpr unsigned kWantsNormal = bit(kOutMx) | bit(kOutMy) | bit(kOutMz) | bit(kOutIm);
inline constexpr unsigned kWantsPdf = bit(kOutPdf), kWantsWeight = bit(kOutWeight), kWantsValue = bit(kOutValue),
                          kWantsShare = bit(kOutShare);

// The most lanes that a kernel takes at once: four of the widest vectors. Every buffer of a tile may be read and
// written up to the next multiple of it.
inline constexpr std::size_t kWidest = 64;

// What the kernels of Kelemen's lobe pass on (kernels/kelemen-inl.h).
enum LobeColumn {
  kLobeShare,  // of the lobe in the drawing
  kLobeScale,  // the lobe's value is this (1 - E(o)) o_z
  kLobeTaken,
  kLobeX,  // what it draws
  kLobeY,
  kLobeZ,
  kLobeU1,  // what is left for the model's own sampler
  kLobeU3,
  kLobePdf,  // the model's own of what the lobe has drawn
  kLobeValue,
  kLobeColumns
};

// What is the same for every tile of a call, and too small to compile kernels apart for.
struct TileConstants {
  unsigned wanted = 0;         // bit(OutputIndex): what is computed and stored
  bool normals_alone = false;  // sample_normal
  bool transmits = false;      // *_transmission, of the kernels that also serve *_scattering
  bool uncorrelated = false;   // Shadowing::uncorrelated
  bool biased = false;         // Normalisation::biased
  bool importance = false;     // Transport::importance
  bool retro = false;
  bool draws_lobe = false;  // sample_reflection with Kelemen's lobe
  Interface interface = Interface::conductor;
  const SlopeTableView* table = nullptr;
  const AlbedoTableView* albedo = nullptr;  // where it is read
};

// Pointers that are neither read nor wanted are not set: every call pays for what is.
struct Tile : TileConstants {
  explicit Tile(const TileConstants& constants) : TileConstants(constants) {}
  std::size_t lanes = 0;
  unsigned streamed = 0;                // as `wanted`: stored past the caches; those begin at a cache line
  std::uint8_t* status = nullptr;       // null unless wanted
  std::uint8_t* event = nullptr;        // null unless wanted
  const float* in[kInputs];             // those that the operation reads, the optional ones too
  float* out[kOutputs];                 // the wanted ones
  float* factor = nullptr;              // of compensation: what it computes
  float* lobe[kLobeColumns];            // of compensation by a lobe
  std::size_t ahead_count = 0;          // for kernels that fetch ahead
  const float* const* ahead = nullptr;  // columns, as far ahead as each is fetched
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

// The kernels of a distribution with a masking, indexed by Sampler; entries that do not exist are null.
inline constexpr std::size_t kSamplers = static_cast<std::size_t>(Sampler::visible) + 1;
struct SurfaceKernels {
  Kernel sample[kSamplers] = {};         // sample_normal, sample_reflection
  Kernel sample_ahead[kSamplers] = {};   // the same, fetching ahead
  Kernel query[kSamplers] = {};          // pdf_reflection, evaluate_reflection
  Kernel scatter[kSamplers] = {};        // sample_transmission, sample_scattering
  Kernel scatter_query[kSamplers] = {};  // evaluate_transmission, evaluate_scattering
  Kernel masking = nullptr;
  Kernel albedo = nullptr;
  Kernel compensation = nullptr;
  Kernel lobe = nullptr, with_lobe = nullptr;
};

// Those of a distribution. `affine` serves mean slopes and correlated roughness.
struct DistributionKernels {
  SurfaceKernels smith, smith_affine, vcavity;
};

inline constexpr std::size_t kDistributions = static_cast<std::size_t>(Distribution::table) + 1;
struct TargetKernels {
  const DistributionKernels* distribution[kDistributions];  // indexed by Distribution
  void (*philox)(const PhiloxTile& tile);
  std::size_t vector_lanes;
  bool streams;              // there are streaming stores
  void (*finish_streams)();  // what was streamed is seen by all who are told of it afterwards
};

// The kernels of an available target (target.h), full vectors or one lane wide.
const TargetKernels& kernels(Target target, bool one_lane);

// A batch's kernel, null where the composition has none. `affine`: mean slopes or correlations are given; `ahead`: that
// which fetches ahead, if there is one.
Kernel find_kernel(const TargetKernels& table, Operation operation, const Model& model, Sampler sampler, bool affine,
                   bool ahead = false);
// The kernels of a model with its masking.
const SurfaceKernels& find_surface(const TargetKernels& table, const Model& model, bool affine);

}  // namespace facetwise
