// SPDX-License-Identifier: Apache-2.0
// Light probes as lights: drawn directions follow the stated density, which integrates to one.
#include "src/light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "src/numbers.h"

namespace facetwise::render {
namespace {

Environment probe() {
  auto image = std::make_shared<Image>();
  image->width = 64, image->height = 32;
  for (int y = 0; y < image->height; ++y)
    for (int x = 0; x < image->width; ++x) {
      const bool sun = x == 50 && y == 9, black = x < 8;
      const float value = black ? 0.0f : sun ? 400.0f : 0.2f + static_cast<float>(y) / 32;
      for (const float tint : {1.0f, 0.9f, 0.7f}) image->values.push_back(tint * value);
    }
  return {.probe = image, .turn = 0.3f};
}

TEST(Light, DrawnDirectionsHaveTheStatedDensity) {
  for (const Environment& environment : {probe(), Environment{}}) {
    const Light light(environment);
    constexpr std::uint32_t kDraws = 1 << 18;
    double inverse = 0, mean = 0;
    std::uint32_t elsewhere = 0;
    for (std::uint32_t k = 0; k < kDraws; ++k) {
      const auto u = numbers_of(Numbers::sobol, 1, 0, k, 0);
      const auto drawn = light.draw(u[0], u[1]);
      ASSERT_NEAR(dot(drawn.direction, drawn.direction), 1, 1e-5);
      ASSERT_GT(drawn.pdf, 0);
      // On the very border of two pixels rounding may choose the other.
      elsewhere += std::abs(light.pdf(drawn.direction) / drawn.pdf - 1) > 1e-3;
      inverse += 1 / static_cast<double>(drawn.pdf) / kDraws;
      mean += drawn.radiance[0] / static_cast<double>(drawn.pdf) / kDraws;
    }
    EXPECT_LT(elsewhere, kDraws / 1000);
    // The share of the sphere that has light.
    EXPECT_NEAR(inverse / (4 * std::numbers::pi), environment.probe ? 56.0 / 64 : 1.0, 0.01);
    // What the light sends, against a sum over the sphere.
    double sum = 0;
    constexpr int kRows = 512, kColumns = 1024;
    for (int y = 0; y < kRows; ++y)
      for (int x = 0; x < kColumns; ++x) {
        const double theta = std::numbers::pi * (y + 0.5) / kRows, phi = 2 * std::numbers::pi * (x + 0.5) / kColumns;
        const Vector d = {static_cast<float>(std::sin(theta) * std::cos(phi)), static_cast<float>(std::cos(theta)),
                          static_cast<float>(std::sin(theta) * std::sin(phi))};
        sum += light.radiance(d)[0] * std::sin(theta) * (std::numbers::pi / kRows) * (2 * std::numbers::pi / kColumns);
      }
    // Of the probe's black pixels, the edges have light by interpolation that is never drawn.
    EXPECT_NEAR(mean / sum, 1, 0.02);
  }
}

TEST(Numbers, SobolPointsAreEven) {
  // Each of 2^k intervals of each dimension has one of 2^k points, whatever the pixel.
  for (const std::uint32_t pixel : {0u, 17u})
    for (std::size_t d = 0; d < 3; ++d) {
      std::vector<int> count(1024);
      for (std::uint32_t k = 0; k < 1024; ++k)
        ++count[static_cast<std::size_t>(numbers_of(Numbers::sobol, 3, pixel, k, 5)[d] * 1024)];
      for (const int c : count) EXPECT_EQ(c, 1);
    }
  // The first two together: each of 32 x 32 cells has one.
  std::vector<int> cells(1024);
  for (std::uint32_t k = 0; k < 1024; ++k) {
    const auto u = numbers_of(Numbers::sobol, 3, 2, k, 7);
    ++cells[static_cast<std::size_t>(u[0] * 32) * 32 + static_cast<std::size_t>(u[1] * 32)];
  }
  for (const int c : cells) EXPECT_EQ(c, 1);
}

TEST(Numbers, RandomOnesBelongToTheirPlace) {
  const auto a = numbers_of(Numbers::random, 1, 2, 3, 4);
  EXPECT_EQ(a, numbers_of(Numbers::random, 1, 2, 3, 4));
  EXPECT_NE(a, numbers_of(Numbers::random, 2, 2, 3, 4));
  EXPECT_NE(a, numbers_of(Numbers::random, 1, 3, 3, 4));
  EXPECT_NE(a, numbers_of(Numbers::random, 1, 2, 4, 4));
  EXPECT_NE(a, numbers_of(Numbers::random, 1, 2, 3, 5));
}

}  // namespace
}  // namespace facetwise::render
