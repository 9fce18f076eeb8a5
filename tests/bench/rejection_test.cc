// SPDX-License-Identifier: Apache-2.0
// Rejection counts meet their predictions, and predictions those of other means.
#include "bench/rejection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "facetwise/reference.h"

namespace facetwise::bench {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

TEST(Rejections, CountsMeetPredictions) {
  std::vector<RejectionResult> results;
  int steps = 0;
  ASSERT_TRUE(count_rejections(
                  300'000, Target::best, [&] { return ++steps > 0; }, results)
                  .ok());
  EXPECT_GT(results.size(), 400u);
  double squares = 0;
  int random = 0;
  for (const RejectionResult& r : results) {
    EXPECT_LT(std::abs(r.deviations()), 5)
        << r.sampler << " " << r.theta_degrees << " " << r.alpha_x << " " << r.alpha_y << ": " << r.rejected << " of "
        << r.samples << ", " << r.predicted_share;
    if (r.sampler == "exact") {
      EXPECT_EQ(r.rejected, 0u);
      EXPECT_EQ(r.predicted_share, 0);
    }
    // Where the count is as good as normal, deviations have unit variance: neither too large nor too small.
    const double expected = r.predicted_share * static_cast<double>(r.samples);
    if (expected < 20 || static_cast<double>(r.samples) - expected < 20) continue;
    squares += r.deviations() * r.deviations();
    ++random;
  }
  ASSERT_GT(random, 200);
  EXPECT_NEAR(squares / random, 1, 5 * std::sqrt(2.0 / random));
}

// The shares that the documentation states, to its four digits.
TEST(Rejections, PredictionsAreThoseOfTheDocumentation) {
  struct Row {
    double theta, alpha_x, alpha_y, ndf, cap, bounded;
  };
  for (const Row& row :
       {Row{0, 1, 1, .5, .5, 0}, Row{30, .5, .5, .2276, .1951, .0522}, Row{60, .3, 1, .3850, .3014, .2684},
        Row{60, .02, .9, .2575, .2569, .2567}, Row{89, .5, .5, .4935, .0086, .0002}}) {
    const auto share = [&](Sampler sampler) {
      return predicted_share(sampler, row.alpha_x, row.alpha_y, row.theta * kDegree);
    };
    EXPECT_NEAR(share(Sampler::ndf), row.ndf, 6e-5) << row.theta;
    EXPECT_NEAR(share(Sampler::cap), row.cap, 6e-5) << row.theta;
    EXPECT_EQ(share(Sampler::heitz), share(Sampler::cap));
    EXPECT_NEAR(share(Sampler::bounded), row.bounded, 6e-5) << row.theta;
    EXPECT_EQ(share(Sampler::exact), 0);
  }
}

// The quadrature against the definition: a grid over u1, u2 through the double-precision reference.
TEST(Rejections, NdfQuadratureIsTheDefinition) {
  struct Row {
    double theta, alpha_x, alpha_y;
  };
  constexpr int kGrid = 1000;
  for (const Row& row : {Row{0, .7, .7}, Row{50, .4, .9}, Row{85, .2, .2}, Row{100, .3, .3}, Row{140, 1, .5}}) {
    const double theta = row.theta * kDegree;
    const reference::Vector i{std::sin(theta), 0, std::cos(theta)};
    int occluded = 0;
    for (int a = 0; a < kGrid; ++a)
      for (int b = 0; b < kGrid; ++b)
        occluded += reference::sample_reflection({}, Sampler::ndf, {row.alpha_x, row.alpha_y}, i, (a + .5) / kGrid,
                                                 (b + .5) / kGrid, 0)
                        .status == LaneStatus::occluded;
    EXPECT_NEAR(ndf_share_occluded(row.alpha_x, row.alpha_y, theta), occluded / 1e6, 1e-3) << row.theta;
  }
}

TEST(Rejections, Stop) {
  std::vector<RejectionResult> results;
  int steps = 0;
  const auto status = count_rejections(
      1000, Target::best, [&] { return ++steps < 3; }, results);
  EXPECT_EQ(status.code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(results.size(), 3 * 5u);  // steps and samplers of GGX
}

TEST(Rejections, Deviations) {
  RejectionResult r;
  r.samples = 10000;
  r.rejected = 5100;
  r.predicted_share = 0.5;
  EXPECT_DOUBLE_EQ(r.deviations(), 2);
  r.samples = 100;
  r.rejected = 0;
  r.predicted_share = 0;
  EXPECT_EQ(r.deviations(), 0);
  r.rejected = 1;  // what is predicted never to happen
  EXPECT_TRUE(std::isinf(r.deviations()));
}

}  // namespace
}  // namespace facetwise::bench
