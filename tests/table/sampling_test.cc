// SPDX-License-Identifier: Apache-2.0
// The drawn slopes: they follow the density that is returned with them, always; the visible slopes' density,
// if the table is not too small.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "gtest/gtest.h"
#include "support/counts.h"
#include "support/philox.h"
#include "table/cells.h"
#include "table/densities.h"

namespace facetwise::test {
namespace {

const std::uint64_t kSamples = kQuick ? 20'000 : 200'000;

std::vector<std::uint64_t> counts(const SlopeTable& table, double theta, double phi, const Cells& cells) {
  std::vector<std::uint64_t> counts(static_cast<std::size_t>(cells.count()));
  for (std::uint64_t k = 0; k < kSamples; ++k) {
    const auto u = generated(11, 0, k);
    const auto drawn = table.draw(theta, phi, u[0], u[1]);
    const int cell = cells.of(drawn.x, drawn.y);
    EXPECT_GE(cell, 0) << drawn.x << " " << drawn.y;
    if (cell >= 0) ++counts[static_cast<std::size_t>(cell)];
  }
  return counts;
}

// Of the samples against cells' shares, which are scaled to their sum.
double p_value(const std::vector<std::uint64_t>& counts, std::vector<double> shares) {
  const double sum = std::accumulate(shares.begin(), shares.end(), 0.0);
  for (double& share : shares) share *= static_cast<double>(kSamples) / sum;
  return chi_square(counts, shares).p_value;
}

struct Tested {
  double own = 1, exact = 1;  // the least p-values
};
constexpr double kIncidence[][2] = {{0, 0}, {0.7, 2.1}, {1.4, 3.9}, {2.0, 5.6}};

Tested test(const SlopeTable& table, const SlopeDensity& p22) {
  Tested tested;
  for (const auto& incidence : kIncidence) {
    const double theta = incidence[0], phi = incidence[1];
    SCOPED_TRACE(testing::Message() << "theta " << theta << ", phi " << phi);
    const Cells cells(theta, phi);
    const auto own =
        cells.integrals([&](double x, double y) { return table.drawn_density(theta, phi, x, y); }, kQuick ? 32 : 48);
    // Midpoints: the density has jumps.
    EXPECT_NEAR(std::accumulate(own.begin(), own.end(), 0.0), 1, 3e-3);
    const auto drawn = counts(table, theta, phi, cells);
    tested.own = std::min(tested.own, p_value(drawn, own));
    tested.exact = std::min(tested.exact, p_value(drawn, cells.visible(p22, 24)));
  }
  return tested;
}

constexpr double kPasses = 1e-3, kFails = 1e-9;

TEST(Sampling, DefaultGgx) {
  const Tested tested = test(ggx_table(), ggx);
  EXPECT_GT(tested.own, kPasses);
  EXPECT_GT(tested.exact, kPasses);
}
TEST(Sampling, DefaultBeckmann) {
  const Tested tested = test(beckmann_table(), beckmann);
  EXPECT_GT(tested.own, kPasses);
  EXPECT_GT(tested.exact, kPasses);
}
TEST(Sampling, DefaultSkewed) {
  const Tested tested = test(skewed_table(), skewed);
  EXPECT_GT(tested.own, kPasses);
  EXPECT_GT(tested.exact, kPasses);
}
TEST(Sampling, SmallTablesFollowTheirOwnDensityAlone) {
  const SlopeTable::Options radial{.radial = true, .incidence = 16, .slopes = 16, .uniforms = 16};
  const SlopeTable::Options full{.incidence = 16, .slopes = 16, .uniforms = 16, .azimuths = 16};
  for (const auto& [name, p22, options] : {std::tuple{"beckmann", &beckmann, radial}, {"skewed", &skewed, full}}) {
    SCOPED_TRACE(name);
    const Tested tested = test(*build(p22, options), p22);
    EXPECT_GT(tested.own, kPasses);
    EXPECT_LT(tested.exact, kFails);
  }
}

// From in front to behind, and where directions are degenerate.
constexpr double kThetas[] = {0, 1e-4, 0.5, 1.2, 1.5707, 1.5709, 2.2, 3.0, 3.1415};

TEST(Sampling, DensityIntegratesToOne) {
  for (const SlopeTable* table : {&ggx_table(), &beckmann_table(), &skewed_table()})
    for (const double theta : kThetas)
      for (const double phi : {0.0, 0.8, 3.1416, 4.0}) {
        if (table->radial() && phi != 0) continue;
        const auto shares = Cells(theta, phi, 1)
                                .integrals([&](double x, double y) { return table->drawn_density(theta, phi, x, y); },
                                           kQuick ? 200 : 400);
        EXPECT_NEAR(shares[0], 1, kQuick ? 2e-2 : 4e-3) << theta << " " << phi;
      }
}

// Except where rounding puts a slope into the next cell.
TEST(Sampling, DrawnDensityIsTheQueried) {
  for (const SlopeTable* table : {&ggx_table(), &beckmann_table(), &skewed_table()}) {
    int apart = 0, all = 0;
    for (const double theta : kThetas)
      for (std::uint64_t k = 0; k < 1000; ++k) {
        const auto u = generated(3, 0, k);
        const double phi = 6.28 * u[2];
        const auto drawn = table->draw(theta, phi, u[0], u[1]);
        ASSERT_TRUE(std::isfinite(drawn.x) && std::isfinite(drawn.y) && drawn.density > 0) << theta;
        ++all;
        if (!(std::abs(table->drawn_density(theta, phi, drawn.x, drawn.y) / drawn.density - 1) < 1e-6)) ++apart;
      }
    EXPECT_LE(apart, all / 1000) << table->description();
  }
}

TEST(Sampling, EndsAreDrawn) {
  for (const SlopeTable* table : {&ggx_table(), &skewed_table()})
    for (const double theta : kThetas)
      for (const double u1 : {0.0, 1.0})
        for (const double u2 : {0.0, 1.0}) {
          const auto drawn = table->draw(theta, 1, u1, u2);
          EXPECT_TRUE(std::isfinite(drawn.x) && std::isfinite(drawn.y) && std::isfinite(drawn.density)) << theta;
        }
}

}  // namespace
}  // namespace facetwise::test
