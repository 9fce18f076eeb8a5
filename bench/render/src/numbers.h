// SPDX-License-Identifier: Apache-2.0
// Random and low-discrepancy numbers of paths: each belongs to a pixel, a sample and a dimension, whatever the order of
// work.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "facetwise/render.h"

namespace facetwise::render {

inline std::uint32_t mix(std::uint32_t h) {
  h = (h ^ h >> 16) * 0x7feb352du;
  h = (h ^ h >> 15) * 0x846ca68bu;
  return h ^ h >> 16;
}
inline std::uint32_t mix(std::uint32_t a, std::uint32_t b) { return mix(a ^ (mix(b + 0x9e3779b9u) + (a << 6))); }

inline std::uint32_t reverse_bits(std::uint32_t x) {
  x = __builtin_bswap32(x);
  x = (x & 0x0f0f0f0fu) << 4 | (x >> 4 & 0x0f0f0f0fu);
  x = (x & 0x33333333u) << 2 | (x >> 2 & 0x33333333u);
  return (x & 0x55555555u) << 1 | (x >> 1 & 0x55555555u);
}

// Owen's scrambling of all bits below each bit, as a hash: Burley 2020, "Practical Hash-based Owen Scrambling",
// section 3, with the constants of Vegdahl 2021.
inline std::uint32_t scramble(std::uint32_t x, std::uint32_t seed) {
  x = reverse_bits(x);
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return reverse_bits(x);
}

// The second and third dimensions of Sobol's sequence (the first is the bits reversed); primitive polynomials x + 1 and
// x^2 + x + 1 with initial numbers 1 and 1, 3 (Joe & Kuo 2008).
struct SobolMatrices {
  std::array<std::uint32_t, 32> second{}, third{};
  constexpr SobolMatrices() {
    second[0] = third[0] = 1u << 31;
    third[1] = 3u << 30;
    for (unsigned k = 1; k < 32; ++k) second[k] = second[k - 1] ^ second[k - 1] >> 1;
    for (unsigned k = 2; k < 32; ++k) third[k] = third[k - 1] ^ third[k - 2] ^ third[k - 2] >> 2;
  }
};
inline constexpr SobolMatrices kSobol;

inline std::uint32_t sobol(const std::array<std::uint32_t, 32>& matrix, std::uint32_t index) {
  std::uint32_t x = 0;
  for (; index != 0; index &= index - 1) x ^= matrix[static_cast<unsigned>(std::countr_zero(index))];
  return x;
}

inline float to_unit(std::uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; }

// Three numbers of a decision (`dimension`) on the path of one sample of one pixel.
inline std::array<float, 3> numbers_of(Numbers kind, std::uint64_t seed, std::uint32_t pixel, std::uint32_t sample,
                                       std::uint32_t dimension) {
  const std::uint32_t key =
      mix(mix(mix(static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)), pixel), dimension);
  if (kind == Numbers::random) {
    const std::uint32_t h = mix(key, sample);
    return {to_unit(h), to_unit(mix(h, 1)), to_unit(mix(h, 2))};
  }
  const std::uint32_t index = scramble(sample, mix(key, 3));
  return {to_unit(scramble(reverse_bits(index), mix(key, 4))),
          to_unit(scramble(sobol(kSobol.second, index), mix(key, 5))),
          to_unit(scramble(sobol(kSobol.third, index), mix(key, 6)))};
}

}  // namespace facetwise::render
