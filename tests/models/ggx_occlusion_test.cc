// SPDX-License-Identifier: Apache-2.0
// How many samples each sampler loses: known shares, by K and by counting the kernels' samples.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "support/counts.h"
#include "support/draw.h"
#include "support/lobe.h"

namespace facetwise::test {
namespace {

using reference::Roughness;
using reference::Vector;

constexpr Sampler kSamplers[] = {Sampler::ndf, Sampler::cap, Sampler::bounded, Sampler::exact};

Vector at(double degrees) {
  const double theta = degrees * std::numbers::pi / 180;
  return {std::sin(theta), 0, std::cos(theta)};
}

double occluded_by_quadrature(Sampler sampler, Roughness alpha, Vector i) {
  return 1 - integrate({alpha, i},
                       [&](const Vector&, const Vector& o) { return reference::pdf_reflection(sampler, alpha, i, o); });
}

double occluded_by_count(Sampler sampler, Roughness alpha, Vector i, std::uint64_t count) {
  const Statistics statistics =
      draw({.sampler = sampler, .model = {}, .alpha = alpha, .i = i, .seed = 3, .count = count}, [](const Drawn&) {});
  return static_cast<double>(statistics.occluded) / static_cast<double>(statistics.lanes());
}

// Five standard deviations of a count's share.
double spread(double share, std::uint64_t count) {
  return 5 * std::sqrt(share * (1 - share) / static_cast<double>(count)) + 1e-6;
}

TEST(Occlusion, SharesBySampler) {
  struct Row {
    double theta;
    Roughness alpha;
    double ndf, cap, bounded;
  };
  const Row rows[] = {
      {0, {1, 1}, .5000, .5000, 0},         {30, {.5, .5}, .2276, .1951, .0522}, {60, {.3, 1}, .3850, .3014, .2684},
      {60, {.02, .9}, .2575, .2569, .2567}, {89, {.5, .5}, .4935, .0086, .0002},
  };
  const std::uint64_t count = kQuick ? 20'000 : 4'000'000;
  for (const Row& row : rows) {
    const double expected[] = {row.ndf, row.cap, row.bounded, 0};
    for (int n = 0; n < 4; ++n) {
      SCOPED_TRACE(testing::Message() << name(kSamplers[n]) << " theta " << row.theta << " alpha " << row.alpha.x << " "
                                      << row.alpha.y);
      const double share = occluded_by_quadrature(kSamplers[n], row.alpha, at(row.theta));
      EXPECT_NEAR(share, expected[n], 0.5e-4 + 1e-9);
      const double counted = occluded_by_count(kSamplers[n], row.alpha, at(row.theta), count);
      EXPECT_NEAR(counted, share, spread(std::max(share, 0.0), count));
      if (kSamplers[n] == Sampler::exact) {
        EXPECT_EQ(counted, 0);
      }
    }
    EXPECT_NEAR(1 - reference::share_unoccluded(row.alpha, at(row.theta)), row.cap, 0.5e-4 + 1e-9);
  }
}

// Above alpha = 1 the sign in Eto & Tokuyoshi's Eq. 5 matters: `bounded` has it, their listing saturates
// alpha.
TEST(Occlusion, BoundedAboveOneUsesTheSignedForm) {
  const Roughness alpha = {2, 2};
  const Vector i = at(30);
  const double sigma = reference::projected_area(alpha, i), k = reference::share_unoccluded(alpha, i) * sigma;
  const double nu = std::sqrt(4 * i.x * i.x + i.z * i.z);
  const double bounded = 1 - k / ((reference::bounded_k(alpha, i) * i.z + nu) / 2);
  EXPECT_NEAR(bounded, .560, .0005);
  EXPECT_NEAR(1 - k / (nu / 2), .626, .0005) << "saturated: k = 0";
  EXPECT_NEAR(1 - k / sigma, .774, .0005) << "cap";
  EXPECT_NEAR(occluded_by_quadrature(Sampler::bounded, alpha, i), bounded, 1e-8);

  const std::uint64_t count = kQuick ? 20'000 : 4'000'000;
  EXPECT_NEAR(occluded_by_count(Sampler::bounded, alpha, i, count), bounded, spread(bounded, count));
  EXPECT_NEAR(occluded_by_count(Sampler::cap, alpha, i, count), 1 - k / sigma, spread(1 - k / sigma, count));
}

}  // namespace
}  // namespace facetwise::test
