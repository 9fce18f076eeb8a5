// SPDX-License-Identifier: Apache-2.0
// `exact` never returns an occluded reflection in front, and what its weights vary by.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "models/compositions.h"
#include "support/counts.h"

namespace facetwise::test {
namespace {

class ModelUnoccluded : public testing::TestWithParam<Family> {};

bool has_exact(const Family& family) {
  const std::vector<Sampler> all = samplers_of(family, Operation::sample_reflection);
  return std::find(all.begin(), all.end(), Sampler::exact) != all.end();
}

std::vector<Family> families_with_exact() {
  std::vector<Family> all = families();
  std::erase_if(all, [](const Family& family) { return !has_exact(family); });
  return all;
}

TEST_P(ModelUnoccluded, NoLaneInFrontIsOccluded) {
  const Composition c = plain(GetParam(), Sampler::exact);
  std::size_t front = 0;
  const std::size_t wanted = kQuick ? 20'000 : 1'000'000;
  for (std::uint64_t seed = 1; front < wanted; ++seed) {
    std::vector<Point> points = hard_points(c, 65536, seed, seed % 2 == 0);
    std::erase_if(points, [](const Point& p) { return p.iz <= 0; });
    const std::vector<Result> results = run_points(Operation::sample_reflection, c, points);
    for (std::size_t n = 0; n < points.size(); ++n) {
      if (results[n].status >= static_cast<int>(LaneStatus::smooth)) continue;
      ++front;
      ASSERT_TRUE(accepted(results[n])) << describe(c) << describe(points[n]);
      ASSERT_GT(results[n].oz, 0) << describe(c) << describe(points[n]);
    }
  }
}

// The weight without shadowing is the density of visible normals over that of `exact`. Where the sampler is
// in exact proportion (ggx with Smith) it does not vary; rejection of visible normals, which gives that
// proportion too, spends 1 / share samples on each.
TEST_P(ModelUnoccluded, WeightsVaryLessThanRejection) {
  const Composition c = plain(GetParam(), Sampler::exact), visible = plain(GetParam(), Sampler::visible);
  std::uint64_t seed = 40;
  int number = 0;
  for (const Point& point : calm_points(c)) {
    if (point.iz <= 0) continue;
    const std::vector<Result> samples = draw(Operation::sample_reflection, c, point, kQuick ? 10'000 : 200'000, ++seed);
    std::vector<Point> points(samples.size(), point);
    for (std::size_t n = 0; n < points.size(); ++n) {
      points[n].ox = samples[n].ox;
      points[n].oy = samples[n].oy;
      points[n].oz = samples[n].oz;
    }
    const std::vector<Result> a = run_points(Operation::pdf_reflection, visible, points),
                              b = run_points(Operation::pdf_reflection, c, points);
    double sum = 0, squares = 0, count = 0;
    for (std::size_t n = 0; n < points.size(); ++n) {
      if (b[n].pdf == 0) continue;
      const double w = a[n].pdf / b[n].pdf;
      sum += w;
      squares += w * w;
      ++count;
    }
    EXPECT_GT(count, 0.999 * static_cast<double>(points.size()));
    const double share = sum / count, moment = squares * count / (sum * sum);
    Statistics statistics;
    draw(Operation::sample_reflection, visible, point, kQuick ? 10'000 : 200'000, ++seed, &statistics);
    const double kept = static_cast<double>(statistics.accepted) / static_cast<double>(statistics.lanes());
    std::printf("%-22s theta %5.1f: relative second moment %.4f, of rejection %.4f\n", name(GetParam()).c_str(),
                std::acos(point.iz) * 180 / 3.14159265, moment, 1 / kept);
    const std::string key = "_of_point_" + std::to_string(number++);
    RecordProperty("second_moment" + key, std::to_string(moment));
    RecordProperty("second_moment_of_rejection" + key, std::to_string(1 / kept));
    // Its mean is the share that is not occluded.
    EXPECT_NEAR(share, kept, kQuick ? 0.03 : 0.01) << describe(c) << describe(point);
    if (GetParam().masking == Masking::smith && GetParam().distribution == Distribution::ggx) {
      EXPECT_NEAR(moment, 1, 1e-5) << describe(c) << describe(point);
    } else {
      EXPECT_LE(moment, 1 / kept + 0.005) << describe(c) << describe(point);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Families, ModelUnoccluded, testing::ValuesIn(families_with_exact()),
                         [](const auto& info) { return name(info.param); });

TEST(ModelExact, IsWhereItIsSaidToBe) {
  for (const Family& family : families()) {
    if (family.distribution == Distribution::ggx) {
      EXPECT_TRUE(has_exact(family)) << name(family);
    }
    if (family.masking == Masking::vcavity && family.distribution != Distribution::phong) {
      EXPECT_TRUE(has_exact(family)) << name(family);
    }
  }
}

// Directions that are each other's opposite but for rounding, at grazing incidence: no slope of the ellipse has their half
// vector. (Their pdf was the largest float once.)
TEST(ModelExact, HasNoDensityWhereNoSlopeIs) {
  float pdf = -1;
  Batch batch;
  batch.model.distribution = Distribution::beckmann;
  batch.model.retro = true;
  batch.sampler = Sampler::exact;
  batch.lanes = 1;
  batch.incident = {-0.806684375f, -0.590982437f, 1.27004239e-06f};
  batch.outgoing = {-0.806684434f, -0.590982437f, 1.27004239e-06f};
  batch.alpha_x = 1.40472591f;
  batch.alpha_y = 0.01f;
  batch.out.pdf = {&pdf, 1};
  ASSERT_TRUE(pdf_reflection(batch).ok());
  EXPECT_LE(pdf, 1e-24f);
}

}  // namespace
}  // namespace facetwise::test
