// SPDX-License-Identifier: Apache-2.0
// What energy compensation stands for: light that walks from facet to facet of Smith's surface until it leaves (Heitz et al.
// 2016, "Multiple-Scattering Microfacet BSDFs with the Smith Model"), in double and with nothing of the kernels. Both
// compensations are measured against it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "facetwise/albedo_table.h"
#include "facetwise/engine.h"
#include "facetwise/reference.h"
#include "support/counts.h"

namespace facetwise::test {
namespace {

using reference::Vector;

constexpr int kHeights = 6, kTurns = 12;
// Light by outgoing direction, in bins of equal solid angle.
using Lobe = std::array<double, kHeights * kTurns>;

void add(Lobe& lobe, double x, double y, double z, double light) {
  const double turn = std::atan2(y, x) / (2 * std::numbers::pi) + 0.5;
  const int height = std::min(static_cast<int>(z * kHeights), kHeights - 1);
  lobe[static_cast<std::size_t>(height * kTurns + std::min(static_cast<int>(turn * kTurns), kTurns - 1))] += light;
}

double total(const Lobe& lobe) {
  double sum = 0;
  for (const double light : lobe) sum += light;
  return sum;
}

// Half the difference of two lobes of the same sum: the share of the light that goes another way.
double distance(const Lobe& a, const Lobe& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += std::abs(a[k] / total(a) - b[k] / total(b));
  return sum / 2;
}

struct Surface {
  Distribution distribution;
  double alpha, f0;
};

class Walk {
 public:
  Walk(const Surface& surface, std::uint64_t seed) : surface_(surface), random_(seed) {}

  // One path from i: adds its light to the lobe where it leaves.
  void go(Vector i, Lobe& lobe) {
    Vector to = {-i.x, -i.y, -i.z};
    double height = 1, light = 1;  // height: the share of the surface that is lower
    for (int bounce = 0; bounce < 1000; ++bounce) {
      if (!meets(to, height)) return add(lobe, to.x, to.y, to.z, light);
      const Vector back = {-to.x, -to.y, -to.z}, m = visible_normal(back);
      const double c = back.x * m.x + back.y * m.y + back.z * m.z;
      light *= surface_.f0 + (1 - surface_.f0) * std::pow(1 - std::clamp(c, 0.0, 1.0), 5);
      to = {2 * c * m.x - back.x, 2 * c * m.y - back.y, 2 * c * m.z - back.z};
    }
  }

 private:
  double u() { return std::uniform_real_distribution<double>(0, 1)(random_); }

  // (sigma(to) - to_z) / to_z, also downwards.
  double lambda(Vector to) const {
    const double t = to.z / std::hypot(to.x, to.y) / surface_.alpha;
    if (surface_.distribution == Distribution::ggx) return (-1 + std::copysign(std::sqrt(1 + 1 / (t * t)), t)) / 2;
    const double gaussian = std::exp(-t * t) / (t * std::sqrt(std::numbers::pi));
    return t > 0 ? std::max(gaussian - std::erfc(t), 0.0) / 2 : (std::erf(t) - 1 + gaussian) / 2;
  }
  // Where a ray from `height` meets the surface next: false if nowhere.
  bool meets(Vector to, double& height) {
    if (to.z > 1 - 1e-9) return false;
    const double v = u();
    if (to.z < -1 + 1e-9) {
      height *= v;
      return true;
    }
    if (std::abs(to.z) < 1e-9) return true;
    const double l = lambda(to);
    if (l > 0 && v > 1 - std::pow(height, l)) return false;
    if (l == 0) return false;
    height = std::min(height * std::pow(1 - v, -1 / l), 1.0);
    return true;
  }

  Vector visible_normal(Vector i) {
    if (surface_.distribution == Distribution::ggx)
      return reference::sample_normal(Sampler::heitz, {surface_.alpha, surface_.alpha}, i, u(), u(), 0).m;
    // Of Gaussian slopes: the one along i by bisection of its distribution, in proportion to (c - s x)+ exp(-x^2).
    const double x = surface_.alpha * std::hypot(i.x, i.y), length = std::hypot(x, i.z), c = i.z / length,
                 s = x / length;
    const auto below = [&](double slope) {
      return c * (1 + std::erf(slope)) / 2 + s * std::exp(-slope * slope) / (2 * std::sqrt(std::numbers::pi));
    };
    double low = -8, high = s > 0 ? std::min(c / s, 8.0) : 8;
    const double wanted = u() * below(high);
    for (int step = 0; step < 45; ++step) (below((low + high) / 2) < wanted ? low : high) = (low + high) / 2;
    const double along = surface_.alpha * low,
                 across = surface_.alpha * std::normal_distribution<double>(0, std::numbers::sqrt2 / 2)(random_);
    const double horizontal = std::hypot(i.x, i.y), ex = horizontal > 0 ? i.x / horizontal : 1,
                 ey = horizontal > 0 ? i.y / horizontal : 0;
    const double norm = std::sqrt(1 + along * along + across * across);
    return {-(along * ex - across * ey) / norm, -(along * ey + across * ex) / norm, 1 / norm};
  }

  Surface surface_;
  std::mt19937_64 random_;
};

Lobe walked(const Surface& surface, Vector i, int paths) {
  Lobe lobe{};
  Walk walk(surface, 2016);
  for (int k = 0; k < paths; ++k) walk.go(i, lobe);
  for (double& light : lobe) light /= paths;
  return lobe;
}

Lobe sampled(const Surface& surface, Vector i, Compensation compensation) {
  constexpr std::size_t kSamples = 1 << 18;
  std::vector<float> x(kSamples), y(kSamples), z(kSamples), weight(kSamples);
  Batch batch;
  batch.model = {.distribution = surface.distribution, .interface = Interface::schlick, .compensation = compensation};
  batch.sampler = Sampler::exact;
  batch.lanes = kSamples;
  batch.incident = {static_cast<float>(i.x), static_cast<float>(i.y), static_cast<float>(i.z)};
  batch.alpha_x = batch.alpha_y = static_cast<float>(surface.alpha);
  batch.f0 = static_cast<float>(surface.f0);
  batch.generator = Generator{.seed = 5};
  batch.out.outgoing = {x, y, z};
  batch.out.weight = weight;
  const auto statistics = sample_reflection(batch);
  EXPECT_TRUE(statistics.ok()) << statistics.status();
  Lobe lobe{};
  for (std::size_t k = 0; k < kSamples; ++k)
    if (weight[k] > 0) add(lobe, x[k], y[k], z[k], weight[k] / static_cast<double>(kSamples));
  return lobe;
}

// The sums, and how far the lobes are from the walk's. FACETWISE_LONG=1 prints the table of docs/albedo.md.
TEST(RandomWalk, CompensationIsNearIt) {
  if (kQuick) return;
  const int paths = long_run() ? 400000 : 8000;
  const std::vector<double> alphas = long_run() ? std::vector{0.3, 0.6, 1.0} : std::vector{0.3, 1.0};
  const std::vector<double> heights = long_run() ? std::vector{0.95, 0.5, 0.15} : std::vector{0.9, 0.3};
  for (const Distribution distribution : {Distribution::ggx, Distribution::beckmann})
    for (const double alpha : alphas)
      for (const double f0 : {1.0, 0.5})
        for (const double z : heights) {
          const Surface surface{distribution, alpha, f0};
          const Vector i = {std::sqrt(1 - z * z), 0, z};
          const Lobe truth = walked(surface, i, paths);
          const Lobe none = sampled(surface, i, Compensation::none);
          const Lobe turquin = sampled(surface, i, Compensation::turquin);
          const Lobe kelemen = sampled(surface, i, Compensation::kelemen);
          SCOPED_TRACE(testing::Message() << name(distribution) << " alpha " << alpha << " f0 " << f0 << " z " << z);
          if (long_run())
            std::printf("%-8s %.1f %.1f %.2f | %.3f %.3f %.3f %.3f | %.3f %.3f\n", name(distribution).data(), alpha, f0,
                        z, total(truth), total(none), total(turquin), total(kelemen), distance(turquin, truth),
                        distance(kelemen, truth));
          if (f0 == 1) {
            EXPECT_NEAR(total(truth), 1, 1e-9);  // no light is lost
          }
          EXPECT_NEAR(total(turquin), total(truth), 0.06);
          EXPECT_NEAR(total(kelemen), total(truth), 0.04);
          EXPECT_LT(distance(turquin, truth), 0.2);
          EXPECT_LT(distance(kelemen, truth), 0.1);
        }
}

}  // namespace
}  // namespace facetwise::test
