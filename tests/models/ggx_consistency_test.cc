// SPDX-License-Identifier: Apache-2.0
// A sample's pdf is what the pdf call says of its direction, as far as o's rounding to float lets it.
//
// Moving o by d moves log p by at most about d times
//   4 / |h| + 4 |S h| / (h.S h),  h = i + o,  S = diag(1 / alpha_x^2, 1 / alpha_y^2, 1),
// for `ndf` also d (1 / h_z + 2 / |h|). Samplers that form a half vector in the stretched frame know i.m, and
// with it their pdf, to 4 / |i_hat + o_hat|^2 units (ggx_accuracy_test.cc). The kernels' o is within a few units
// of 2^-24 of the sample that the pdf was computed for, so that the two agree to that many units times this,
// and no implementation can promise more. At alpha = 1e-4, i_z = 1e-3 that is per cents. The weight has no
// such loss: its density is cancelled.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "facetwise/engine.h"
#include "facetwise/reference.h"
#include "support/counts.h"
#include "support/lanes.h"

namespace facetwise::test {
namespace {

// By how much log p changes when o moves by one unit, for the half vector h = i + o.
double change(Sampler sampler, const Lane& lane, reference::Vector h) {
  const reference::Vector stretched = {h.x / lane[kAlphaX], h.y / lane[kAlphaY], h.z};
  const reference::Vector s = {stretched.x / lane[kAlphaX], stretched.y / lane[kAlphaY], h.z};
  const double square = h.x * s.x + h.y * s.y + h.z * s.z;  // |stretched|^2
  const double length = std::hypot(h.x, h.y, h.z);
  const double moves = 4 / length + 4 * std::hypot(s.x, s.y, s.z) / square;
  if (sampler == Sampler::ndf) return moves + 1 / h.z + 2 / length;
  // |i_hat + o_hat| = 2 i_hat.m_hat, and w.stretched = i.h = |h|^2 / 2.
  const double nu = std::hypot(lane[kAlphaX] * lane[kIx], lane[kAlphaY] * lane[kIy], lane[kIz]);
  const double sum = length * length / (nu * std::sqrt(square));
  return moves + 4 / (sum * sum);
}

class Consistency : public testing::TestWithParam<Sampler> {};

TEST_P(Consistency, SampledPdfIsThePdf) {
  const std::size_t kLanes = kQuick ? 20'000 : 2'000'000;
  constexpr double kUnit = 0x1p-24;
  const LaneColumns columns = make_lanes(kLanes, 5);
  std::vector<float> o[3], m[3], im(kLanes), pdf(kLanes), weight(kLanes), again(kLanes), value(kLanes);
  for (auto& column : o) column.resize(kLanes);
  for (auto& column : m) column.resize(kLanes);
  Batch batch;
  batch.sampler = GetParam();
  batch.lanes = kLanes;
  batch.incident = {columns.column[kIx], columns.column[kIy], columns.column[kIz]};
  batch.alpha_x = columns.column[kAlphaX];
  batch.alpha_y = columns.column[kAlphaY];
  Batch query = batch;
  batch.u1 = columns.column[kU1];
  batch.u2 = columns.column[kU2];
  if (uses_u3({}, GetParam())) batch.u3 = columns.column[kU3];
  batch.out.outgoing = {o[0], o[1], o[2]};
  batch.out.normal = {m[0], m[1], m[2]};
  batch.out.incident_dot_normal = im;
  batch.out.pdf = pdf;
  batch.out.weight = weight;
  ASSERT_TRUE(sample_reflection(batch).ok());
  query.outgoing = {o[0], o[1], o[2]};
  query.out.pdf = again;
  query.out.value = value;
  ASSERT_TRUE(evaluate_reflection(query).ok());

  std::vector<double> differences;
  double worst = 0, worst_ratio = 0, worst_value = 0;
  for (std::size_t n = 0; n < kLanes; ++n) {
    if (pdf[n] == 0) {
      EXPECT_EQ(weight[n], 0);
      continue;
    }
    const Lane lane = columns.lane(n);
    // Below o_z = -i_z the density is 0, and at that edge rounding decides.
    if (lane[kIz] + o[2][n] <= 4 * kUnit) continue;
    // Not those with u1, u2, u3 at their ends: accuracy_test.cc has them.
    if (n % 8 == 5) continue;
    // At o as it was rounded, and as it was drawn: i + o = 2 (i.m) m.
    const double twice = 2 * im[n];
    const double moves =
        std::max(change(GetParam(), lane, {lane[kIx] + o[0][n], lane[kIy] + o[1][n], lane[kIz] + o[2][n]}),
                 change(GetParam(), lane, {twice * m[0][n], twice * m[1][n], twice * m[2][n]}));
    if (moves * kUnit > 0.02) continue;  // beyond the first order
    const double difference = std::abs(again[n] / pdf[n] - 1) / kUnit;
    differences.push_back(difference);
    worst = std::max(worst, difference);
    worst_ratio = std::max(worst_ratio, (difference - 32) / moves);
    // f cos(theta_o) / pdf is the weight, up to the same and to what o_z's rounding makes of the shadowing.
    const double from_value = value[n] / again[n];
    worst_value = std::max(worst_value, std::abs(from_value / weight[n] - 1) / kUnit / (64 + 8 / o[2][n] + moves));
  }
  std::nth_element(differences.begin(), differences.begin() + differences.size() / 2, differences.end());
  std::printf("%s: %zu lanes, median %.2f, worst %.3g units of 2^-24; at most %.2f units of o's rounding\n",
              std::string(name(GetParam())).c_str(), differences.size(), differences[differences.size() / 2], worst,
              worst_ratio);
  EXPECT_GT(differences.size(), kLanes / 10);
  EXPECT_LE(worst_ratio, 24);
  EXPECT_LE(worst_value, 1) << "value / pdf is not the weight";
}

INSTANTIATE_TEST_SUITE_P(Samplers, Consistency, testing::ValuesIn(all_samplers().begin(), all_samplers().end()),
                         [](const auto& info) { return std::string(name(info.param)); });

}  // namespace
}  // namespace facetwise::test
