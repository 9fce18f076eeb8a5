// SPDX-License-Identifier: Apache-2.0
// Loops without branches, so that compilers vectorise them.
#include "wire/compact_columns.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace facetwise::wire {
namespace {

constexpr int kMost = 32767, kZero = -32768;  // of a coordinate; what stands for the zero vector

int rounded(float value) { return static_cast<int>(value + (value < 0 ? -0.5f : 0.5f)); }

std::uint32_t pack_direction(float x, float y, float z) {
  const float sum = std::fabs(x) + std::fabs(y) + std::fabs(z);
  const float scale = sum > 0 ? 1 / sum : 0.0f;
  float u = std::fabs(x) * scale, v = std::fabs(y) * scale;
  // The lower half is folded over the upper one's edges.
  const float folded_u = 1 - v, folded_v = 1 - u;
  u = z < 0 ? folded_u : u;
  v = z < 0 ? folded_v : v;
  int a = rounded(kMost * u), b = rounded(kMost * v);
  // What is above stays above, and what is below, below: |u| + |v| < 1 means z > 0.
  const int over = z > 0                     ? (a + b >= kMost ? a + b - (kMost - 1) : 0)
                   : z < 0 && a + b <= kMost ? a + b - (kMost + 1)
                                             : 0;
  const bool of_a = (a > b) == (over > 0);  // the larger one is made smaller, the smaller one larger
  a -= of_a ? over : 0;
  b -= of_a ? 0 : over;
  a = std::signbit(x) ? -a : a;
  b = std::signbit(y) ? -b : b;
  a = sum > 0 ? a : kZero;
  return static_cast<std::uint16_t>(a) | static_cast<std::uint32_t>(static_cast<std::uint16_t>(b)) << 16;
}

void unpack_direction(std::uint32_t packed, float& x, float& y, float& z) {
  const int a = static_cast<std::int16_t>(packed), b = static_cast<std::int16_t>(packed >> 16);
  const int size_a = a < 0 ? -a : a, size_b = b < 0 ? -b : b;
  const int c = kMost - size_a - size_b;
  const int along_a = c < 0 ? kMost - size_b : size_a, along_b = c < 0 ? kMost - size_a : size_b;
  const float u = static_cast<float>(a < 0 ? -along_a : along_a), v = static_cast<float>(b < 0 ? -along_b : along_b);
  const float w = static_cast<float>(c);
  const float scale = a == kZero ? 0.0f : 1 / std::sqrt(u * u + v * v + w * w);
  x = u * scale;
  y = v * scale;
  z = w * scale;
}

std::uint16_t pack_weight(float weight) {
  // Below half's smallest normal number the step is fixed: adding a large one rounds to it.
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(weight < 65504.0f ? weight : 65504.0f);
  const std::uint32_t normal = (bits + 0xfff + ((bits >> 13) & 1) - (112u << 23)) >> 13;
  const std::uint32_t small = std::bit_cast<std::uint32_t>(weight + 0.5f) - std::bit_cast<std::uint32_t>(0.5f);
  return static_cast<std::uint16_t>(bits < (113u << 23) ? small : normal);
}

float unpack_weight(std::uint16_t packed) {
  // The exponent is put right by a product, which also normalises.
  return std::bit_cast<float>(static_cast<std::uint32_t>(packed) << 13) * std::bit_cast<float>((127u + 112u) << 23);
}

}  // namespace

void pack_directions(const float* x, const float* y, const float* z, std::size_t count, char* to) {
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t packed = pack_direction(x[k], y[k], z[k]);
    std::memcpy(to + k * kDirectionBytes, &packed, sizeof packed);
  }
}

void unpack_directions(const char* from, std::size_t count, float* x, float* y, float* z) {
  for (std::size_t k = 0; k < count; ++k) {
    std::uint32_t packed;
    std::memcpy(&packed, from + k * kDirectionBytes, sizeof packed);
    unpack_direction(packed, x[k], y[k], z[k]);
  }
}

void pack_weights(const float* weight, std::size_t count, char* to) {
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint16_t packed = pack_weight(weight[k]);
    std::memcpy(to + k * kWeightBytes, &packed, sizeof packed);
  }
}

void unpack_weights(const char* from, std::size_t count, float* weight) {
  for (std::size_t k = 0; k < count; ++k) {
    std::uint16_t packed;
    std::memcpy(&packed, from + k * kWeightBytes, sizeof packed);
    weight[k] = unpack_weight(packed);
  }
}

}  // namespace facetwise::wire
