// SPDX-License-Identifier: Apache-2.0
// The kernels' samples follow the reference's density: chi-square for every sampler and configuration.
#include <gtest/gtest.h>

#include <cmath>

#include "support/configurations.h"
#include "support/counts.h"
#include "support/hypothesis.h"

namespace facetwise::test {
namespace {

// Any configuration of a sampler fails a right kernel with this probability; the seeds are fixed.
constexpr double kAnyFailure = 0.01;

struct Case {
  Operation operation;
  Sampler sampler;
  int configuration;
};

std::string case_name(const testing::TestParamInfo<Case>& info) {
  return std::string(name(info.param.sampler)) + "_" + name(configurations()[info.param.configuration]);
}

std::vector<Case> cases(Operation operation, int step) {
  std::vector<Case> all;
  for (Sampler sampler : all_samplers()) {
    if (operation == Operation::sample_normal && !samples_normals(sampler)) continue;
    for (std::size_t n = 0; n < configurations().size(); n += step)
      all.push_back({operation, sampler, static_cast<int>(n)});
  }
  return all;
}

class ChiSquareTest : public testing::TestWithParam<Case> {};

TEST_P(ChiSquareTest, SamplesFollowTheDensity) {
  const Case& c = GetParam();
  const Configuration& configuration = configurations()[c.configuration];
  Draw draw;
  draw.operation = c.operation;
  draw.sampler = c.sampler;
  draw.alpha = roughness(configuration);
  draw.i = incident(configuration);
  draw.seed = 100 * static_cast<int>(c.sampler) + c.configuration + 1;
  draw.count = kQuick ? 20'000 : long_run() ? 10'000'000 : 400'000;

  const Verdict verdict = test_hypotheses(draw, {truth(draw)});
  const ChiSquare& test = verdict.tests[0];
  RecordProperty("p_value", std::to_string(test.p_value));
  const double level = sidak(kAnyFailure, static_cast<int>(configurations().size()));
  EXPECT_GE(test.p_value, level) << "chi-square " << test.statistic << " at " << test.degrees << " degrees";
  EXPECT_LE(verdict.outside, 1e-6) << "an accepted sample where the density is 0";
  // A few in a million may have a half vector so short (o nearly -i) that m, or i.m, is known to fewer
  // digits.
  EXPECT_LE(verdict.unreflected, draw.count / 50'000) << "o is not the reflection of i by m";
  EXPECT_EQ(verdict.statistics.smooth + verdict.statistics.invalid, 0u);
  EXPECT_EQ(verdict.statistics.lanes(), draw.count);
  if (c.operation == Operation::sample_reflection && (c.sampler == Sampler::exact || draw.i.z <= 0) &&
      c.sampler != Sampler::ndf) {
    EXPECT_EQ(verdict.statistics.occluded, 0u);
  }
}

INSTANTIATE_TEST_SUITE_P(Reflections, ChiSquareTest, testing::ValuesIn(cases(Operation::sample_reflection, 1)),
                         case_name);
INSTANTIATE_TEST_SUITE_P(Normals, ChiSquareTest, testing::ValuesIn(cases(Operation::sample_normal, kQuick ? 2 : 3)),
                         case_name);

TEST(ChiSquare, CoversAtLeastSixtyConfigurations) {
  EXPECT_TRUE(kQuick || configurations().size() >= 60) << configurations().size();
}

TEST(ChiSquare, PValuesAreRight) {
  // The survival function of chi-square at its 5 % points, exp(-x) for two degrees, and exp(-500) sum 500^k /
  // k!.
  EXPECT_NEAR(upper_incomplete_gamma(0.5, 3.841458820694124 / 2), 0.05, 1e-12);
  EXPECT_NEAR(upper_incomplete_gamma(5, 18.307038053275146 / 2), 0.05, 1e-12);
  EXPECT_NEAR(upper_incomplete_gamma(1, 30), std::exp(-30), 1e-24);
  EXPECT_NEAR(upper_incomplete_gamma(500, 500), 0.494052853829239642, 1e-12);
  EXPECT_NEAR(sidak(0.05, 1), 0.05, 1e-15);
  EXPECT_NEAR(sidak(0.05, 60), 8.545229269492081e-4, 1e-15);
}

}  // namespace
}  // namespace facetwise::test
