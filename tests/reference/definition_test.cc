// SPDX-License-Identifier: Apache-2.0
// Closed forms against the integrals that define them, for every distribution.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "slopes.h"
#include "support/counts.h"

namespace facetwise::test {
namespace {

using namespace slopes;

constexpr Distribution kDistributions[] = {Distribution::ggx, Distribution::beckmann, Distribution::student_t,
                                           Distribution::phong};
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::vector<Surface> surfaces() {
  std::vector<Surface> all;
  for (Distribution d : kDistributions) {
    for (reference::Roughness alpha : {reference::Roughness{0.1, 0.1}, {0.4, 0.4}, {1, 1}, {0.08, 0.6}, {0.9, 0.2}}) {
      Surface s;
      s.model.distribution = d;
      s.alpha = alpha;
      all.push_back(s);
    }
  }
  for (Distribution d : {Distribution::ggx, Distribution::beckmann, Distribution::student_t}) {
    Surface s;
    s.model.distribution = d;
    s.alpha = {0.3, 0.8};
    s.slope_correlation = -0.7;
    all.push_back(s);
    s.mean_slope_x = 0.5;
    s.mean_slope_y = -1.2;
    all.push_back(s);
  }
  if (kQuick) {
    std::vector<Surface> some;
    for (std::size_t n = 0; n < all.size(); n += 6) some.push_back(all[n]);
    return some;
  }
  return all;
}

const std::vector<double> kThetas =
    kQuick ? std::vector<double>{60, 100}
           : std::vector<double>{1, 30, 60, 80, 89, 89.99, 90, 90.01, 91, 100, 120, 150, 178};

// How wide the density is across, at u along.
double width(const Surface& s, double u) {
  const double alpha = s.model.distribution == Distribution::phong ? std::max(s.alpha.x, s.alpha.y) : 1;
  return s.model.distribution == Distribution::beckmann ? 1 : std::hypot(1, alpha * u);
}

// The marginal of D m_z^4 along the stretched i, and the sum of i.M over it: f(i.M) is what is summed.
template <class F>
double over_slopes(const Surface& s, Vector i, double from, double to, const F& f) {
  const Vector w = stretched(s, i);
  const double a = std::hypot(w.x, w.y), cos = w.x / a, sin = w.y / a;
  const auto marginal = [&](double u) {
    const double scale = width(s, u);
    double sum = 0;
    for (int n = -60; n <= 60; ++n) {  // double exponential
      const double t = n / 16.0, e = std::numbers::pi / 2 * std::sinh(t), v = scale * std::sinh(e);
      const Vector m = unit(normal(s, cos * u - sin * v, sin * u + cos * v));
      const double weight = scale * std::cosh(e) * std::numbers::pi / 2 * std::cosh(t) / 16;
      const double z2 = m.z * m.z;
      if (std::isfinite(weight)) sum += reference::distribution(s, m) * z2 * z2 * weight;
    }
    return sum * determinant(s);
  };
  return doubling([&](double u) { return marginal(u) * f(w.z - a * u); }, from, to, falls_over(s, from));
}

TEST(Definition, SlopesIntegrateToOne) {
  for (const Surface& s : surfaces()) {
    const Vector i = direction(40, 70);
    const auto one = [](double) { return 1.0; };
    EXPECT_NEAR(over_slopes(s, i, 0, -kInfinity, one) + over_slopes(s, i, 0, kInfinity, one), 1, 1e-9)
        << describe(s, i);
    EXPECT_NEAR(reference::slope_density(s, 0.3, -0.2),
                reference::distribution(s, unit({-0.3, 0.2, 1})) / std::pow(1.13, 2), 1e-12)
        << describe(s, i);
  }
}

TEST(Definition, ProjectedArea) {
  for (const Surface& s : surfaces()) {
    for (double theta : kThetas) {
      const Vector i = direction(theta, 25), w = stretched(s, i);
      const double end = w.z / std::hypot(w.x, w.y);
      const auto facing = [](double im) { return std::max(im, 0.0); };
      double sum = over_slopes(s, i, std::min(end, 0.0), -kInfinity, facing);
      if (end > 0) sum += over_slopes(s, i, 0, end, facing);
      const double sigma = reference::projected_area(s, i);
      if (sum < 1e-290) continue;
      EXPECT_NEAR(sigma / sum, 1, 1e-8) << describe(s, i) << " theta " << theta;
    }
  }
}

TEST(Definition, VcavityHits) {
  for (Surface s : surfaces()) {
    s.model.masking = Masking::vcavity;
    s.mean_slope_x = s.mean_slope_y = 0;
    for (double theta : kThetas) {
      const Vector i = direction(theta, 25), w = stretched(s, i);
      if (i.z == 0) continue;
      const double end = w.z / std::hypot(w.x, w.y);  // i.M = 0; i.M = 2 |i_z| at -end or 3 end
      const auto seen = [&](double im) { return std::min(2 * std::abs(i.z), std::max(im, 0.0)); };
      double sum = 0;
      if (end > 0) {
        sum = over_slopes(s, i, 0, end, seen) + over_slopes(s, i, 0, -end, seen) +
              over_slopes(s, i, -end, -kInfinity, seen);
      } else {
        sum = over_slopes(s, i, end, 3 * end, seen) + over_slopes(s, i, 3 * end, -kInfinity, seen);
      }
      if (sum < 1e-290) continue;
      EXPECT_NEAR(reference::normaliser(s, i) / sum, 1, 1e-8) << describe(s, i) << " theta " << theta;
      EXPECT_NEAR(reference::hit_probability(s, i) * std::abs(i.z) / sum, 1, 1e-8);
    }
  }
}

// sigma(o) - z'(o) = sigma(-o), far from where either is lost in the other.
TEST(Definition, AreasOfOppositeDirections) {
  for (const Surface& s : surfaces()) {
    const Vector i = direction(75, 25), back = {-i.x, -i.y, -i.z};
    EXPECT_NEAR(reference::projected_area(s, i) - reference::projected_area(s, back), stretched(s, i).z, 1e-11);
  }
}

// Far behind, areas and their quotients against the asymptotic series of a Gaussian's tail.
TEST(Definition, BeckmannFarBehind) {
  Surface s;
  s.model.distribution = Distribution::beckmann;
  s.alpha = {0.05, 0.05};
  const Vector i = direction(110, 0);
  const double a = s.alpha.x * i.x, t = -i.z / a, t2 = t * t;
  const double series =
      1 - 3 / (2 * t2) + 15 / (4 * t2 * t2) - 105 / (8 * t2 * t2 * t2) + 945 / (16 * t2 * t2 * t2 * t2);
  const double sigma = a * std::exp(-t2) / (4 * std::sqrt(std::numbers::pi) * t2) * series;
  EXPECT_NEAR(reference::projected_area(s, i) / sigma, 1, 1e-5);
  // alpha 100 times smaller: sigma underflows, the density of the normal at the edge's far side does not.
  s.alpha = {0.0005, 0.0005};
  EXPECT_EQ(reference::projected_area(s, i), 0);
  const double slope = i.z / i.x * (1 + 1e-7);
  const Vector m = unit({-slope, 0, 1});
  const double p = reference::pdf_normal(s, Sampler::visible, i, m);
  EXPECT_TRUE(std::isfinite(p));
  EXPECT_GT(p, 0);
}

// Every table is a distribution of its own: given GGX's density, it is GGX.
TEST(Definition, TableByQuadrature) {
  Surface ggx;
  ggx.alpha = {0.3, 0.8};
  ggx.mean_slope_x = 0.2;
  ggx.slope_correlation = 0.4;
  Surface table = ggx;
  table.model.distribution = Distribution::table;
  table.table_density = [](double x, double y) {
    const double e = 1 + x * x + y * y;
    return 1 / (std::numbers::pi * e * e);
  };
  for (double theta : {10.0, 70.0, 89.0, 95.0, 140.0}) {
    const Vector i = direction(theta, 200);
    EXPECT_NEAR(reference::projected_area(table, i) / reference::projected_area(ggx, i), 1, 1e-8) << theta;
    const Vector m = unit({-0.3, 0.1, 1});
    EXPECT_NEAR(reference::distribution(table, m) / reference::distribution(ggx, m), 1, 1e-12);
  }
}

TEST(Definition, FresnelAtKnownAngles) {
  Surface s;
  s.model.interface = Interface::dielectric;
  EXPECT_NEAR(reference::fresnel(s, 1), 0.04, 1e-15);
  EXPECT_EQ(reference::fresnel(s, 0), 1);
  // The textbook form, away from where it cancels.
  for (double eta : {0.4, 0.75, 1.3, 2.5}) {
    s.eta = eta;
    for (double cos = 0.02; cos < 1; cos += 0.07) {
      const double sine2 = (1 - cos * cos) / (eta * eta);
      const double f = reference::fresnel(s, cos);
      if (sine2 >= 1) {
        EXPECT_EQ(f, 1);
        continue;
      }
      const double t = std::sqrt(1 - sine2), rs = (cos - eta * t) / (cos + eta * t),
                   rp = (eta * cos - t) / (eta * cos + t);
      EXPECT_NEAR(f, (rs * rs + rp * rp) / 2, 1e-14);
      // The same from the other side.
      Surface back = s;
      back.eta = 1 / eta;
      EXPECT_NEAR(reference::fresnel(back, t), f, 1e-13);
    }
  }
  s.eta = 1 + 1e-9;  // (eta - 1)^2 / 4 straight on
  EXPECT_NEAR(reference::fresnel(s, 1) / 2.5e-19, 1, 1e-6);
  s.eta = 1;
  EXPECT_EQ(reference::fresnel(s, 0), 0);
  s.model.interface = Interface::schlick;
  EXPECT_DOUBLE_EQ(reference::fresnel(s, 1), 0.04);
  EXPECT_DOUBLE_EQ(reference::fresnel(s, 0), 1);
  s.model.interface = Interface::conductor;
  EXPECT_EQ(reference::fresnel(s, 0.3), 1);
}

}  // namespace
}  // namespace facetwise::test
