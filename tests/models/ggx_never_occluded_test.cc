// SPDX-License-Identifier: Apache-2.0
// `exact` loses no sample: 10^8 over 1,000 random configurations.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "facetwise/engine.h"
#include "support/counts.h"

namespace facetwise::test {
namespace {

TEST(Exact, IsNeverOccluded) {
  const int kConfigurations = kQuick ? 50 : 1000;
  const std::size_t kSamples = kQuick ? 2'000 : 100'000;
  std::mt19937_64 engine(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<float> oz(kSamples);
  Statistics total;
  float lowest = 1;
  for (int n = 0; n < kConfigurations; ++n) {
    const double theta = std::acos(uniform(engine)) * (n % 4 == 0 ? 1.9 : 1);  // a quarter reaches behind
    const double phi = 2 * std::numbers::pi * uniform(engine);
    // Logarithmic in [1e-3, 4]; half of the configurations are isotropic.
    const auto alpha = [&] { return static_cast<float>(1e-3 * std::pow(4000.0, uniform(engine))); };
    Batch batch;
    batch.sampler = Sampler::exact;
    batch.lanes = kSamples;
    batch.incident = {static_cast<float>(std::sin(theta) * std::cos(phi)),
                      static_cast<float>(std::sin(theta) * std::sin(phi)), static_cast<float>(std::cos(theta))};
    const float ax = alpha(), ay = alpha();
    batch.alpha_x = ax;
    batch.alpha_y = n % 2 == 0 ? ax : ay;
    batch.generator = Generator{.seed = static_cast<std::uint64_t>(n), .dimension = 0, .id = {}, .first_id = 0};
    batch.out.outgoing.z = oz;
    const auto statistics = sample_reflection(batch);
    ASSERT_TRUE(statistics.ok()) << statistics.status();
    total += *statistics;
    for (float z : oz) lowest = std::min(lowest, z);
  }
  EXPECT_EQ(total.accepted, static_cast<std::uint64_t>(kConfigurations) * kSamples);
  EXPECT_EQ(total.occluded, 0u);
  EXPECT_GT(lowest, 0);
}

}  // namespace
}  // namespace facetwise::test
