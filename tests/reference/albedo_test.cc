// SPDX-License-Identifier: Apache-2.0
// The mean of a sampler's weights is the albedo.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/configurations.h"
#include "support/counts.h"
#include "support/draw.h"
#include "support/lobe.h"

namespace facetwise::test {
namespace {

using reference::Vector;

class Albedo : public testing::TestWithParam<Sampler> {};

TEST_P(Albedo, IsTheMeanWeight) {
  const std::uint64_t count = kQuick ? 10'000 : 400'000;
  for (std::size_t n = 0; n < configurations().size(); n += kQuick ? 4 : 3) {
    const Configuration& configuration = configurations()[n];
    const auto alpha = roughness(configuration);
    const auto i = incident(configuration);
    // Behind a smooth surface `ndf` draws next to no visible normal, and its mean weight says nothing.
    if (GetParam() == Sampler::ndf && i.z < 0.1) continue;
    for (Shadowing shadowing : {Shadowing::correlated, Shadowing::uncorrelated}) {
      SCOPED_TRACE(name(configuration) + " " + std::string(name(shadowing)));
      Model model;
      model.shadowing = shadowing;
      const double albedo = integrate(
          {alpha, i},
          [&](const Vector&, const Vector& o) { return reference::evaluate_reflection(model, alpha, i, o); }, 1e-8);
      double sum = 0, squares = 0;
      draw({.sampler = GetParam(), .model = model, .alpha = alpha, .i = i, .seed = 11 + n, .count = count},
           [&](const Drawn& sample) {
             sum += sample.weight;
             squares += static_cast<double>(sample.weight) * sample.weight;
           });
      const double mean = sum / static_cast<double>(count);
      const double deviation =
          std::sqrt(std::max(0.0, squares / static_cast<double>(count) - mean * mean) / static_cast<double>(count));
      // 5 deviations, and float's rounding where the weight hardly varies.
      EXPECT_NEAR(mean, albedo, 5 * deviation + 1e-6);
      EXPECT_LE(albedo, 1 + 1e-7);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Samplers, Albedo, testing::ValuesIn(all_samplers().begin(), all_samplers().end()),
                         [](const auto& info) { return std::string(name(info.param)); });

}  // namespace
}  // namespace facetwise::test
