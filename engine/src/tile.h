// What a kernel sees: pointers to contiguous lanes. Strides, active lists, one-value columns and generated
// numbers are resolved before (batch.cc), so that kernels know nothing of them.
#pragma once

#include <cstddef>
#include <cstdint>

#include "facetwise/batch.h"
#include "facetwise/slope_table.h"
#include "facetwise/target.h"

namespace facetwise {

// Indices of a tile's columns: the order of input_fields(), output_fields() and byte_fields().
enum InputIndex {
  kIx, kIy, kIz, kAlphaX, kAlphaY, kMeanX, kMeanY, kCorrelation, kEta, kF0, kF90, kOx, kOy, kOz, kU1, kU2, kU3, kInputs
};
enum OutputIndex {
  kOutOx, kOutOy, kOutOz, kOutMx, kOutMy, kOutMz, kOutIm, kOutPdf, kOutWeight, kOutValue, kOutMasking,
  kOutArea, kOutShare, kOutBranch, kOutEtaScale, kOutputs
};
enum ByteIndex { kOutStatus, kOutEvent, kByteOutputs };

inline constexpr unsigned kWantsNormal = 1;  // m or i.m
inline constexpr unsigned kWantsPdf = 2;
inline constexpr unsigned kWantsWeight = 4;
inline constexpr unsigned kWantsShare = 8;
inline constexpr unsigned kWantsStatus = 16;
inline constexpr unsigned kWantsValue = 32;

// A batch's columns by these indices.
struct BatchColumns {
  const Column<float>* in[kInputs];
  const OutputColumn<float>* out[kOutputs];
  const OutputColumn<std::uint8_t>* byte_out[kByteOutputs];
  explicit BatchColumns(const Batch& b) {
    Batch& batch = const_cast<Batch&>(b);  // the tables name the columns of batches that are filled in
    for (std::size_t k = 0; k < kInputs; ++k) in[k] = &input_fields()[k].column(batch);
    for (std::size_t k = 0; k < kOutputs; ++k) out[k] = &output_fields()[k].column(batch);
    for (std::size_t k = 0; k < kByteOutputs; ++k) byte_out[k] = &byte_fields()[k].column(batch);
  }
};

// The most lanes that a kernel takes at once: two of the widest vectors. Every buffer of a tile may be read and written up to the next
// multiple of it.
inline constexpr std::size_t kWidest = 32;

struct Tile {
  std::size_t lanes = 0;
  const float* in[kInputs] = {};   // those that the operation reads, the optional ones too
  float* out[kOutputs] = {};       // all that it has; unwanted ones are scratch memory
  std::uint8_t* status = nullptr;  // null unless wanted has kWantsStatus
  std::uint8_t* event = nullptr;   // of scattering; scratch memory if unwanted
  unsigned wanted = 0;             // kWants...: where leaving an output out saves work
  // What is the same for all lanes and too small to compile kernels apart for.
  bool normals_alone = false;      // sample_normal
  bool transmits = false;          // *_transmission, of the kernels that also serve *_scattering
  bool uncorrelated = false;       // Shadowing::uncorrelated
  bool biased = false;             // Normalisation::biased
  bool importance = false;         // Transport::importance
  bool retro = false;
  Interface interface = Interface::conductor;
  const SlopeTableView* table = nullptr;
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
struct SurfaceKernels {
  Kernel sample[6] = {};         // sample_normal, sample_reflection
  Kernel query[6] = {};          // pdf_reflection, evaluate_reflection, evaluate_and_pdf
  Kernel scatter[6] = {};        // sample_transmission, sample_scattering
  Kernel scatter_query[6] = {};  // evaluate_transmission, evaluate_scattering
  Kernel masking = nullptr;
};

// Those of a distribution. `affine` serves mean slopes and correlated roughness.
struct DistributionKernels {
  SurfaceKernels smith, smith_affine, vcavity;
};

struct KernelTable {
  const DistributionKernels* distribution[5];  // indexed by Distribution; null at the end where there are no more
  void (*philox)(const PhiloxTile& tile);
  std::size_t vector_lanes;
};

// The kernels of an available target (target.h), full vectors or one lane wide.
const KernelTable& kernels(Target target, bool one_lane);

// A batch's kernel, null where the composition has none. `affine`: mean slopes or correlations are given.
Kernel find_kernel(const KernelTable& table, Operation operation, const Model& model, Sampler sampler, bool affine);

}  // namespace facetwise
