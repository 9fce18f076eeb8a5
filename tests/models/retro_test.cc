// SPDX-License-Identifier: Apache-2.0
// Retro-reflection by the back-vector: reflects as if i were turned half way about n.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "models/compositions.h"
#include "support/counts.h"

namespace facetwise::test {
namespace {

const std::size_t kLanes = kQuick ? 512 : 8192;

Composition without(Composition c) {
  c.model.retro = false;
  return c;
}

// The composition without mean slopes, or with only a correlation: the same columns with and without retro.
std::vector<Point> without_mean(std::vector<Point> points) {
  for (Point& p : points) p.mean_x = p.mean_y = 0;
  return points;
}

class ModelRetro : public testing::TestWithParam<Family> {
 protected:
  std::vector<Composition> retros(Operation operation) const {
    std::vector<Composition> all = compositions(GetParam(), operation);
    std::erase_if(all, [](const Composition& c) { return !c.model.retro; });
    return all;
  }
};

TEST_P(ModelRetro, IsTheTurnedIncidence) {
  std::uint64_t seed = 1;
  for (const Composition& c : retros(Operation::evaluate_reflection)) {
    const std::vector<Point> points = without_mean(hard_points(c, kLanes, ++seed));
    std::vector<Point> plain = points;
    for (Point& p : plain) p.ix = -p.ix, p.iy = -p.iy;
    const std::vector<Result> retro = run_points(Operation::evaluate_reflection, c, points),
                              turned = run_points(Operation::evaluate_reflection, without(c), plain);
    std::size_t lit = 0;
    for (std::size_t n = 0; n < points.size(); ++n) {
      // Straight up, the azimuth that some samplers go by is not turned.
      if (points[n].ix == 0 && points[n].iy == 0) continue;
      ASSERT_EQ(retro[n].value, turned[n].value) << describe(c) << describe(points[n]);
      ASSERT_EQ(retro[n].pdf, turned[n].pdf) << describe(c) << describe(points[n]);
      ASSERT_EQ(retro[n].status, turned[n].status) << describe(c) << describe(points[n]);
      lit += retro[n].value > 0;
    }
    EXPECT_GT(lit, points.size() / 8);
  }
}

// The same numbers give the turned reflection, with the same weight: the albedo is the same.
TEST_P(ModelRetro, SamplesAreTurned) {
  std::uint64_t seed = 100;
  for (const Composition& c : retros(Operation::sample_reflection)) {
    const std::vector<Point> points = without_mean(hard_points(c, kLanes, ++seed));
    const std::vector<Result> retro = run_points(Operation::sample_reflection, c, points),
                              plain = run_points(Operation::sample_reflection, without(c), points);
    for (std::size_t n = 0; n < points.size(); ++n) {
      ASSERT_EQ(retro[n].ox, -plain[n].ox) << describe(c) << describe(points[n]);
      ASSERT_EQ(retro[n].oy, -plain[n].oy) << describe(c) << describe(points[n]);
      ASSERT_EQ(retro[n].oz, plain[n].oz) << describe(c) << describe(points[n]);
      ASSERT_EQ(retro[n].mx, -plain[n].mx) << describe(c) << describe(points[n]);
      ASSERT_EQ(retro[n].mz, plain[n].mz) << describe(c) << describe(points[n]);
      ASSERT_EQ(retro[n].im, plain[n].im) << describe(c) << describe(points[n]);
      ASSERT_EQ(retro[n].pdf, plain[n].pdf) << describe(c) << describe(points[n]);
      ASSERT_EQ(retro[n].weight, plain[n].weight) << describe(c) << describe(points[n]);
      ASSERT_EQ(retro[n].status, plain[n].status) << describe(c) << describe(points[n]);
    }
  }
}

TEST_P(ModelRetro, IsSymmetric) {
  std::uint64_t seed = 200;
  for (const Composition& c : retros(Operation::evaluate_reflection)) {
    if (c.sampler != Sampler::visible) continue;
    std::vector<Point> points = without_mean(hard_points(c, kLanes, ++seed)), back;
    std::erase_if(points, [](const Point& p) { return p.iz < 0.02f || p.oz < 0.02f; });
    for (const Point& p : points) {
      back.push_back(p);
      std::swap(back.back().ix, back.back().ox);
      std::swap(back.back().iy, back.back().oy);
      std::swap(back.back().iz, back.back().oz);
    }
    const std::vector<Result> there = run_points(Operation::evaluate_reflection, c, points),
                              again = run_points(Operation::evaluate_reflection, c, back);
    for (std::size_t n = 0; n < points.size(); ++n) {
      if (there[n].value < 1e-12f) continue;
      ASSERT_NEAR(there[n].value / points[n].oz / (again[n].value / points[n].iz), 1, 2e-5)
          << describe(c) << describe(points[n]);
    }
  }
}

// Light comes back to where it came from: the value at o = i is that of the mirror direction without retro.
TEST_P(ModelRetro, ReturnsWhereItCameFrom) {
  Composition c = plain(GetParam(), Sampler::visible);
  c.model.retro = true;
  std::vector<Point> points = calm_points(c), mirrored;
  std::erase_if(points, [](const Point& p) { return p.iz <= 0; });
  for (Point& p : points) {
    p.correlation = 0;
    p.alpha_x = p.alpha_y = 0.1f;
    set_outgoing(p, incident(p));
    mirrored.push_back(p);
    set_outgoing(mirrored.back(), turned(incident(p)));
  }
  const std::vector<Result> back = run_points(Operation::evaluate_reflection, c, points),
                            mirror = run_points(Operation::evaluate_reflection, without(c), mirrored),
                            wrong = run_points(Operation::evaluate_reflection, c, mirrored);
  for (std::size_t n = 0; n < points.size(); ++n) {
    EXPECT_EQ(back[n].value, mirror[n].value) << describe(points[n]);
    if (points[n].iz < 0.99f) {
      EXPECT_GT(back[n].value, 10 * wrong[n].value) << describe(points[n]);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Families, ModelRetro, testing::ValuesIn(families()),
                         [](const auto& info) { return name(info.param); });

}  // namespace
}  // namespace facetwise::test
