// SPDX-License-Identifier: Apache-2.0
// Philox4x32-10 (Salmon, Moraes, Dror, Shaw 2011, section 4.3), written from the paper and checked against
// Random123's known answers (tests/math/philox_test.cc).
#pragma once

#include <array>
#include <cstdint>

namespace facetwise::test {

using Words = std::array<std::uint32_t, 4>;

constexpr Words philox4x32_10(Words counter, std::array<std::uint32_t, 2> key) {
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t a = 0xD2511F53ull * counter[0], b = 0xCD9E8D57ull * counter[2];
    counter = {static_cast<std::uint32_t>(b >> 32) ^ counter[1] ^ key[0], static_cast<std::uint32_t>(b),
               static_cast<std::uint32_t>(a >> 32) ^ counter[3] ^ key[1], static_cast<std::uint32_t>(a)};
    key[0] += 0x9E3779B9u;
    key[1] += 0xBB67AE85u;
  }
  return counter;
}

// The uniform numbers that facetwise::Generator stands for: u1, u2, u3 of a lane.
inline std::array<float, 3> generated(std::uint64_t seed, std::uint32_t dimension, std::uint64_t id) {
  const Words words =
      philox4x32_10({static_cast<std::uint32_t>(id), static_cast<std::uint32_t>(id >> 32), dimension, 0},
                    {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)});
  const auto uniform = [](std::uint32_t word) { return static_cast<float>(word >> 8) * 0x1p-24f; };
  return {uniform(words[0]), uniform(words[1]), uniform(words[2])};
}

}  // namespace facetwise::test
