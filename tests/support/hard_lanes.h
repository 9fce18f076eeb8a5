// SPDX-License-Identifier: Apache-2.0
// More lanes that look for trouble, in blocks of unlike kinds: made, as those of call.h are, of integer
// hashes and of
// only + - * / and square roots, so that every machine has the same bits.
#pragma once

#include <cstddef>
#include <cstdint>

#include "support/call.h"

namespace facetwise::test {

enum class Kind {
  // Lanes that are neither smooth nor invalid. Blocks of 64 lanes differ in what is in them, so that vectors
  // all in front, all isotropic, all below alpha = 1 and mixed ones all occur: straight down and up, grazing,
  // backfacing, not quite unit length, alpha from 1e-4 to 10, u at 0 and at the largest below 1.
  ordinary,
  // Of half the blocks, one lane in eight is made smooth or invalid in one of many ways.
  mixed,
  // Any bit patterns: in every input, in some, or in one of a lane that is ordinary otherwise.
  any_bits,
};

Lanes hard_lanes(Kind kind, std::size_t count, std::uint64_t seed);

}  // namespace facetwise::test
