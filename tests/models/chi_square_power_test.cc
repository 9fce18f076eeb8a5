// SPDX-License-Identifier: Apache-2.0
// The chi-square test can fail: it rejects a density off by a few per cent, on the very samples for which it
// accepts the right one.
#include <gtest/gtest.h>

#include <algorithm>

#include "support/configurations.h"
#include "support/counts.h"
#include "support/hypothesis.h"

namespace facetwise::test {
namespace {

class PowerTest : public testing::TestWithParam<Sampler> {};

TEST_P(PowerTest, NearMissesAreRejected) {
  // 5 % at 10^6 samples, 1 % at 10^8.
  const double epsilon = kQuick ? 0.3 : long_run() ? 0.01 : 0.05;
  const std::uint64_t count = kQuick ? 20'000 : long_run() ? 100'000'000 : 1'000'000;
  const double level = sidak(0.01, static_cast<int>(configurations().size()));
  int tested = 0;
  for (std::size_t n = 1; n < configurations().size(); n += kQuick ? 2 : 10) {
    const Configuration& configuration = configurations()[n];
    Draw draw;
    draw.sampler = GetParam();
    draw.alpha = roughness(configuration);
    draw.i = incident(configuration);
    draw.seed = 1000 + n;
    draw.count = count;
    const Verdict verdict = test_hypotheses(draw, {truth(draw), modulated(draw, epsilon), rougher(draw, epsilon)});
    // Behind the surface `ndf` accepts next to nothing, and a count of nothing proves nothing.
    if (verdict.share_expected < 0.05) continue;
    // Of a smooth lobe only the tail is visible from behind, and that has the same shape for every alpha.
    if (draw.i.z < 0 && std::max(draw.alpha.x, draw.alpha.y) < 0.1) continue;
    ++tested;
    SCOPED_TRACE(name(configuration));
    EXPECT_GE(verdict.tests[0].p_value, level) << "the density itself";
    EXPECT_LT(verdict.tests[1].p_value, level) << "off by 1 + epsilon cos 2 phi";
    EXPECT_LT(verdict.tests[2].p_value, level) << "alpha off by epsilon";
  }
  EXPECT_GE(tested, kQuick ? 2 : 4);
}

INSTANTIATE_TEST_SUITE_P(Samplers, PowerTest, testing::ValuesIn(all_samplers().begin(), all_samplers().end()),
                         [](const auto& info) { return std::string(name(info.param)); });

}  // namespace
}  // namespace facetwise::test
