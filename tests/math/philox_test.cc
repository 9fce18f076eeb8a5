// SPDX-License-Identifier: Apache-2.0
// Philox4x32-10: the tests' own against Random123's known answers, and every target's kernel against that.
#include "support/philox.h"

#include <cstring>

#include "gtest/gtest.h"
#include "src/tile.h"
#include "support/call.h"
#include "support/counts.h"

namespace facetwise::test {
namespace {

// kat_vectors of Random123.
TEST(Philox, KnownAnswers) {
  constexpr std::uint32_t kOnes = 0xFFFFFFFFu;
  EXPECT_EQ(philox4x32_10({0, 0, 0, 0}, {0, 0}), (Words{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  EXPECT_EQ(philox4x32_10({kOnes, kOnes, kOnes, kOnes}, {kOnes, kOnes}),
            (Words{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(philox4x32_10({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
            (Words{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

// The kernel writes whole vectors; past the lanes there is room and no meaning.
struct Drawn3 {
  std::vector<float> u[3];
};
Drawn3 draw3(PhiloxTile tile, Target target, bool one_lane) {
  Drawn3 drawn;
  for (int k = 0; k < 3; ++k) {
    drawn.u[k].assign(tile.lanes + kWidest, -1.0f);
    tile.u[k] = drawn.u[k].data();
  }
  kernels(target, one_lane).philox(tile);
  return drawn;
}

void expect_words(const PhiloxTile& tile) {
  for (const Target target : available_targets())
    for (const bool one_lane : {false, true}) {
      SCOPED_TRACE(std::string(name(target)) + (one_lane ? ", one lane" : ""));
      const Drawn3 drawn = draw3(tile, target, one_lane);
      for (std::size_t lane = 0; lane < tile.lanes; ++lane) {
        const std::uint64_t id = tile.id != nullptr ? tile.id[lane] : tile.first_id + lane;
        const auto expected = generated(tile.seed, tile.dimension, id);
        for (std::size_t k = 0; k < 3; ++k)
          ASSERT_EQ(drawn.u[k][lane], expected[k]) << "u" << k + 1 << " of id " << id << ", lane " << lane;
      }
    }
}

TEST(PhiloxKernel, KnownAnswerOfTheZeroCounter) {
  for (const Target target : available_targets()) {
    const Drawn3 drawn = draw3({.lanes = 1}, target, false);
    EXPECT_EQ(drawn.u[0][0], 0x6627e8p-24f);
    EXPECT_EQ(drawn.u[1][0], 0xe169c5p-24f);
    EXPECT_EQ(drawn.u[2][0], 0xbc57acp-24f);
  }
}

TEST(PhiloxKernel, SeedsDimensionsAndFirstIds) {
  const std::uint64_t firsts[] = {
      0, 1, 0xFFFFFFFFu, 0xFFFFFFFFu - 7, 0x1'0000'0000u, 0x7FFF'FFFF'FFFF'FFF0u, ~std::uint64_t{0} - 20};
  const std::uint64_t seeds[] = {0, 1, 0xFFFFFFFFu, 0x1'0000'0000u, 0x0123'4567'89AB'CDEFu, ~std::uint64_t{0}};
  for (const std::uint64_t seed : seeds)
    for (const std::uint64_t first : firsts)
      for (const std::uint32_t dimension : {0u, 1u, 0x8000'0000u, ~0u})
        expect_words({.lanes = 67, .seed = seed, .dimension = dimension, .first_id = first});
}

TEST(PhiloxKernel, AnyIds) {
  const std::size_t lanes = kQuick ? 1'000 : 100'000;
  std::vector<std::uint64_t> ids(lanes + kWidest);
  for (std::size_t lane = 0; lane < ids.size(); ++lane) ids[lane] = hash(1, lane) >> (hash(2, lane) % 64);
  expect_words({.lanes = lanes, .seed = 77, .dimension = 5, .first_id = 123, .id = ids.data()});
}

// Only what is asked for is written.
TEST(PhiloxKernel, NumbersLeftOut) {
  for (const Target target : available_targets())
    for (int only = 0; only < 3; ++only) {
      std::vector<float> u(64 + kWidest);
      PhiloxTile tile{.lanes = 64, .seed = 3};
      tile.u[only] = u.data();
      kernels(target, false).philox(tile);
      for (std::size_t lane = 0; lane < 64; ++lane)
        EXPECT_EQ(u[lane], generated(3, 0, lane)[static_cast<std::size_t>(only)]);
    }
}

}  // namespace
}  // namespace facetwise::test
