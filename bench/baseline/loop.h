// SPDX-License-Identifier: Apache-2.0
// The baseline in plain loops over columns, compiled as scalar code and for auto-vectorisation.
#pragma once

#include <cstddef>
#include <cstdint>

#include "facetwise/batch.h"

namespace facetwise::baseline {

// A column as a plain pointer: one value per lane (step 1), or one for all (step 0).
struct LoopColumn {
  const float* data = nullptr;
  std::size_t step = 1;
};

struct Loop {
  Operation operation{};
  Distribution distribution{};
  Masking masking{};
  Sampler sampler{};
  std::size_t lanes = 0;
  LoopColumn ix, iy, iz, alpha_x, alpha_y, ox, oy, oz, u1, u2, u3;  // those that are read
  float *x = nullptr, *y = nullptr, *z = nullptr;                   // the direction that is sampled
  float *pdf = nullptr, *value = nullptr, *masking_g1 = nullptr;    // null where they are not wanted
};

// Each runs the loop and returns how many lanes were occluded.
std::uint64_t run_scalar(const Loop& loop);
// -O3 -ffast-math with vector functions: what a careful user gets of the same source. GGX with Smith masking, every
// column one value per lane. The CPU has the instructions.
#if defined(__x86_64__)
std::uint64_t run_auto_avx2(const Loop& loop);
std::uint64_t run_auto_avx512(const Loop& loop);
#endif

}  // namespace facetwise::baseline
