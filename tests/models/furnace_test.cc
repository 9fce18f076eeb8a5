// SPDX-License-Identifier: Apache-2.0
// Energy: mean weights are the albedo, at most 1, and light may be traced either way.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "models/compositions.h"
#include "support/counts.h"

namespace facetwise::test {
namespace {

const std::size_t kCount = kQuick ? 5'000 : 100'000;

class ModelFurnace : public testing::TestWithParam<Family> {};

TEST_P(ModelFurnace, MeanWeightIsTheAlbedo) {
  for (const Shadowing shadowing : {Shadowing::correlated, Shadowing::uncorrelated}) {
    if (shadowing == Shadowing::uncorrelated && GetParam().masking == Masking::vcavity) continue;  // no part there
    // The reference's integrals take long on an emulator; they are the same there.
    if (kQuick && shadowing == Shadowing::uncorrelated) continue;
    for (const Interface interface : {Interface::conductor, Interface::schlick, Interface::dielectric}) {
      Composition c = plain(GetParam(), Sampler::visible);
      c.model.shadowing = shadowing;
      c.model.interface = interface;
      std::vector<Point> points = calm_points(c);
      if (kQuick) points.resize(1);
      for (std::size_t n = 0; n < points.size(); ++n) {
        if (interface != Interface::conductor && n % 2 == 0) continue;
        const double albedo = reference::albedo(surface_of(c, points[n]), incident(points[n]));
        EXPECT_LE(albedo, 1 + 1e-6) << describe(c) << describe(points[n]);
        const Integral integral = integrate(Operation::evaluate_reflection, c, points[n], kQuick ? 96 : 256);
        EXPECT_NEAR(integral.value, albedo, integral.error + (kQuick ? 5e-3 : 1e-3) * albedo)
            << describe(c) << describe(points[n]);
        EXPECT_LE(integral.error, kQuick ? 0.05 : 0.01) << describe(c) << describe(points[n]);
        for (const Sampler sampler : samplers_of(GetParam(), Operation::sample_reflection)) {
          c.sampler = sampler;
          double sum = 0, squares = 0, largest = 0;
          for (const Result& r : draw(Operation::sample_reflection, c, points[n], kCount, 20 + n)) {
            sum += r.weight;
            squares += static_cast<double>(r.weight) * r.weight;
            largest = std::max<double>(largest, r.weight);
          }
          const double mean = sum / kCount,
                       deviation = std::sqrt(std::max(0.0, squares / kCount - mean * mean) / kCount);
          // `ndf` weighs by what it rarely draws.
          if (sampler != Sampler::ndf || points[n].iz > 0.3f) {
            EXPECT_NEAR(mean, albedo, 5 * deviation + 1e-5) << describe(c) << describe(points[n]);
          }
          // Visible normals: the weight is what is not shadowed.
          const bool visible = sampler == Sampler::visible || sampler == Sampler::heitz || sampler == Sampler::cap;
          if (visible && !weighs_behind(c.model, points[n])) {
            EXPECT_LE(largest, 1 + 1e-5) << describe(c) << describe(points[n]);
          }
        }
      }
    }
  }
}

// `exact` leaves less of the weights' variance than visible normals do: docs/models.md has the figures.
TEST_P(ModelFurnace, ExactWeightsVaryLess) {
  const std::vector<Sampler> samplers = samplers_of(GetParam(), Operation::sample_reflection);
  if (std::find(samplers.begin(), samplers.end(), Sampler::exact) == samplers.end()) return;
  for (const double theta : {0.0, 45.0, 75.0})
    for (const float alpha : {0.5f, 1.0f}) {
      Point point;
      set_incident(point, direction(theta, 20));
      point.alpha_x = point.alpha_y = alpha;
      const auto moment = [&](Sampler sampler) {
        double sum = 0, squares = 0;
        for (const Result& r : draw(Operation::sample_reflection, plain(GetParam(), sampler), point, kCount, 9)) {
          sum += r.weight;
          squares += static_cast<double>(r.weight) * r.weight;
        }
        return squares * kCount / (sum * sum) - 1;
      };
      // Near grazing little is occluded at alpha = 1, so that the gain is small.
      EXPECT_LT(moment(Sampler::exact), 0.97 * moment(Sampler::visible)) << theta << " degrees, alpha " << alpha;
    }
}

// Over everything a lane may be: a weight of visible normals is at most 1.
TEST_P(ModelFurnace, WeightsOfVisibleNormalsAreAtMostOne) {
  std::uint64_t seed = 1;
  for (const Composition& c : compositions(GetParam(), Operation::sample_reflection)) {
    if (c.sampler != Sampler::visible && c.sampler != Sampler::heitz && c.sampler != Sampler::cap) continue;
    // Biased: more than all is reflected where the area of |i_z| is the smaller.
    if (c.model.normalisation == Normalisation::biased) continue;
    const std::vector<Point> points = hard_points(c, kQuick ? 128 : 4096, ++seed, true);
    const std::vector<Result> results = run_points(Operation::sample_reflection, c, points);
    for (std::size_t n = 0; n < points.size(); ++n)
      if (!weighs_behind(c.model, points[n])) {
        ASSERT_LE(results[n].weight, 1 + 1e-4) << describe(c) << describe(points[n]);
      }
  }
}

// f(i, o) = f(o, i) in front: value / o_z. The microfacets' projected areas are those of the plane they are
// distributed about, so that with a mean slope it is z' = o_z - mean.o in place of o_z, wherever that is
// positive for both.
TEST_P(ModelFurnace, ReflectionIsReciprocal) {
  std::uint64_t seed = 70;
  double worst = 0;
  for (const Composition& c : compositions(GetParam(), Operation::evaluate_reflection)) {
    if (c.sampler != Sampler::visible) continue;
    std::vector<Point> points = hard_points(c, kQuick ? 128 : 4096, ++seed), back;
    std::erase_if(points, [](const Point& p) { return p.iz < 0.02f || p.oz < 0.02f; });
    for (const Point& p : points) {
      Point other = p;
      std::swap(other.ix, other.ox);
      std::swap(other.iy, other.oy);
      std::swap(other.iz, other.oz);
      back.push_back(other);
    }
    const std::vector<Result> there = run_points(Operation::evaluate_reflection, c, points),
                              again = run_points(Operation::evaluate_reflection, c, back);
    std::size_t compared = 0;
    for (std::size_t n = 0; n < points.size(); ++n) {
      const Point& p = points[n];
      const double mx = c.affine && !c.model.retro ? p.mean_x : 0, my = c.affine && !c.model.retro ? p.mean_y : 0;
      const double zi = p.iz - mx * p.ix - my * p.iy, zo = p.oz - mx * p.ox - my * p.oy;
      if (zi < 0.02 || zo < 0.02 || there[n].value < 1e-12f) continue;
      ++compared;
      const double ratio = there[n].value / zo / (again[n].value / zi);
      worst = std::max(worst, std::abs(ratio - 1));
      ASSERT_NEAR(ratio, 1, 2e-5 * (1 + std::hypot(mx, my))) << describe(c) << describe(p);
    }
    EXPECT_GT(compared, points.size() / 8) << describe(c);
  }
  RecordProperty("worst", std::to_string(worst));
}

INSTANTIATE_TEST_SUITE_P(Families, ModelFurnace, testing::ValuesIn(families()),
                         [](const auto& info) { return name(info.param); });

}  // namespace
}  // namespace facetwise::test
