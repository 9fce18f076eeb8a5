// SPDX-License-Identifier: Apache-2.0
// The integral of a density over o is the share of samples that are accepted: every sampler of every family.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "models/compositions.h"
#include "support/counts.h"

namespace facetwise::test {
namespace {

const int kSide = kQuick ? 96 : 320;
const std::size_t kCount = kQuick ? 10'000 : 200'000;

class ModelIntegrals : public testing::TestWithParam<Family> {};

double share_accepted(const Composition& c, const Point& point, std::uint64_t seed) {
  Statistics statistics;
  draw(Operation::sample_reflection, c, point, kCount, seed, &statistics);
  return static_cast<double>(statistics.accepted) / static_cast<double>(statistics.lanes());
}

// 5 deviations of a share of the samples, and what the grid leaves.
double tolerance(double share, const Integral& integral) {
  return 5 * std::sqrt(share * (1 - share) / static_cast<double>(kCount)) + integral.error + (kQuick ? 5e-3 : 5e-4);
}

TEST_P(ModelIntegrals, DensityIsTheShareAccepted) {
  for (const Sampler sampler : samplers_of(GetParam(), Operation::sample_reflection))
    for (const bool retro : {false, true}) {
      Composition c = plain(GetParam(), sampler);
      c.model.retro = retro;
      std::uint64_t seed = 1;
      for (const Point& point : calm_points(c)) {
        const Integral integral = integrate(Operation::evaluate_reflection, c, point, kSide);
        const double share = share_accepted(c, point, ++seed);
        EXPECT_LE(integral.error, kQuick ? 0.05 : 0.01) << describe(c) << describe(point);
        EXPECT_NEAR(integral.pdf, share, tolerance(share, integral)) << describe(c) << describe(point);
        // All of what visible normals reflect is above, from behind.
        if (point.iz <= 0 && sampler != Sampler::ndf) {
          EXPECT_EQ(share, 1) << describe(c);
        }
        if (point.iz > 0 && sampler == Sampler::exact) {
          EXPECT_EQ(share, 1) << describe(c);
        }
      }
    }
}

// The older practice divides by the area of |i_z|, and its densities integrate to less than one behind. The
// samples are the same.
TEST_P(ModelIntegrals, BiasedNormalisationLosesBehind) {
  for (const Sampler sampler : samplers_of(GetParam(), Operation::sample_reflection)) {
    // Uncorrelated: then values have the densities' factor. Correlated shadowing knows the area too.
    Composition unbiased = plain(GetParam(), sampler);
    unbiased.model.shadowing = Shadowing::uncorrelated;
    Composition biased = unbiased;
    biased.model.normalisation = Normalisation::biased;
    std::uint64_t seed = 50;
    for (const Point& point : calm_points(unbiased)) {
      const reference::Surface s = surface_of(unbiased, point), b = surface_of(biased, point);
      const double loss = reference::normaliser(s, incident(point)) / reference::normaliser(b, incident(point));
      const Integral with = integrate(Operation::evaluate_reflection, biased, point, kSide),
                     without = integrate(Operation::evaluate_reflection, unbiased, point, kSide);
      // `ndf` normalises by nothing, samplers of unoccluded reflections by their own areas.
      const bool own = sampler == Sampler::ndf || (point.iz > 0 && !samples_normals(sampler));
      EXPECT_NEAR(with.pdf, without.pdf * (own ? 1 : loss), with.error + without.error + 1e-5) << describe(biased);
      EXPECT_NEAR(with.value, without.value * loss, with.error + without.error + 1e-5) << describe(biased);
      if (point.iz > 0.01f && (!GetParam().affine || loss == 1)) {
        EXPECT_EQ(with.pdf, without.pdf) << describe(biased);
      }
      if (point.iz < -0.1f && sampler != Sampler::ndf) {
        EXPECT_LT(loss, 0.95) << describe(biased) << describe(point);
        EXPECT_LT(with.pdf, 0.95) << describe(biased) << describe(point);
        EXPECT_NEAR(without.pdf, 1, tolerance(1, without)) << describe(unbiased) << describe(point);
      }
      const std::vector<Result> one = draw(Operation::sample_reflection, unbiased, point, 1000, ++seed),
                                other = draw(Operation::sample_reflection, biased, point, 1000, seed);
      for (std::size_t n = 0; n < one.size(); ++n) {
        ASSERT_EQ(one[n].ox, other[n].ox);
        ASSERT_EQ(one[n].oy, other[n].oy);
        ASSERT_EQ(one[n].oz, other[n].oz);
        ASSERT_EQ(one[n].status, other[n].status);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Families, ModelIntegrals, testing::ValuesIn(families()),
                         [](const auto& info) { return name(info.param); });

}  // namespace
}  // namespace facetwise::test
