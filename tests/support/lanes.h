// SPDX-License-Identifier: Apache-2.0
// Lanes to compare implementations on: random ones, and adversarial ones.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace facetwise::test {

// Inputs by name; a lane is one value of each.
enum Input { kIx, kIy, kIz, kAlphaX, kAlphaY, kU1, kU2, kU3, kOx, kOy, kOz, kInputs };
using Lane = std::array<double, kInputs>;

struct LaneColumns {
  std::vector<float> column[kInputs];
  std::size_t count() const { return column[0].size(); }
  Lane lane(std::size_t n) const;
};

// Half of the lanes are random: i over the sphere, alpha logarithmic in [1e-4, 10], half of them isotropic.
// The others are, in turn: grazing, |i_z| down to 1e-8; u1, u2, u3 at their ends and at quarters; alpha at
// its ends, at 1 and next to it; i straight up, nearly so, and nearly straight down. o is, in turn, anywhere
// above the surface, a reflection by a visible normal, the mirror direction (behind: i seen from above), and
// grazing.
LaneColumns make_lanes(std::size_t count, std::uint64_t seed);

}  // namespace facetwise::test
