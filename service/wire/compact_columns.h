// SPDX-License-Identifier: Apache-2.0
// Columns in half their bytes, for networks: directions in 32 bits, weights in 16.
#pragma once

#include <cstddef>

namespace facetwise::wire {

// A unit vector as a point of the octahedron (Cigolle et al. 2014, "oct32"): two signed 16-bit numbers, little-endian. The vector
// that comes back has unit length, is at most 8e-5 rad off, and z has the sign it had. Zero, which invalid lanes have, stays zero.
inline constexpr std::size_t kDirectionBytes = 4;
void pack_directions(const float* x, const float* y, const float* z, std::size_t count, char* to);
void unpack_directions(const char* from, std::size_t count, float* x, float* y, float* z);

// IEEE's half precision, rounded to nearest, even: at most 2^-11 off, relative, from 6.1e-5 to 65504, above which it is 65504. No
// value is NaN or negative.
inline constexpr std::size_t kWeightBytes = 2;
void pack_weights(const float* weight, std::size_t count, char* to);
void unpack_weights(const char* from, std::size_t count, float* weight);

}  // namespace facetwise::wire
