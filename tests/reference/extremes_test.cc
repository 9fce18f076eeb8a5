// SPDX-License-Identifier: Apache-2.0
// Roughness and directions at the ends of what is valid: everything stays finite, and densities keep their
// integrals.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "slopes.h"
#include "support/counts.h"

namespace facetwise::test {
namespace {

using namespace slopes;

class Fuzz {
 public:
  double uniform() { return uniform_(engine_); }
  double log_uniform(double low, double high) { return low * std::pow(high / low, uniform()); }
  int below(int count) { return static_cast<int>(count * uniform()); }
  Vector direction() {
    const double phi = 2 * std::numbers::pi * uniform(), sign = uniform() < 0.7 ? 1 : -1;
    double z = 0;
    switch (below(4)) {
      case 0: z = uniform(); break;
      case 1: z = log_uniform(1e-30, 1); break;
      case 2: z = std::sqrt(1 - log_uniform(1e-30, 1)); break;
      default: z = below(2); break;
    }
    const double r = std::sqrt((1 - z) * (1 + z));
    return {r * std::cos(phi), r * std::sin(phi), sign * z};
  }
  Surface surface() {
    Surface s;
    Model& m = s.model;
    m.distribution = static_cast<Distribution>(below(4));
    m.masking = m.distribution == Distribution::phong ? Masking::vcavity : static_cast<Masking>(below(2));
    m.shadowing = static_cast<Shadowing>(below(2));
    m.normalisation = static_cast<Normalisation>(below(2));
    m.interface = static_cast<Interface>(below(3));
    m.transport = static_cast<Transport>(below(2));
    const double largest = m.distribution == Distribution::phong ? 1 : 10;
    s.alpha = {log_uniform(1e-4, largest), log_uniform(1e-4, largest)};
    if (below(2)) s.alpha.y = s.alpha.x;
    s.eta = below(3) ? log_uniform(0.01, 100) : 1 + 1e-6 * (uniform() - 0.5);
    if (m.masking == Masking::smith && m.distribution <= Distribution::beckmann && below(2)) {
      s.slope_correlation = below(2) ? 2 * uniform() - 1 : 1 - log_uniform(1e-7, 1);
      if (below(2)) {
        s.mean_slope_x = 200 * uniform() - 100;
        s.mean_slope_y = 2 * uniform() - 1;
      }
    }
    return s;
  }

 private:
  std::mt19937_64 engine_{1};
  std::uniform_real_distribution<double> uniform_{0, 1};
};

TEST(Extremes, EverythingIsFiniteAndNotNegative) {
  Fuzz fuzz;
  for (int n = 0; n < (kQuick ? 300 : 60'000); ++n) {
    const Surface s = fuzz.surface();
    const Vector i = fuzz.direction();
    // Directions at random, and those that a normal of the lobe gives.
    Vector o = fuzz.direction(), m = unit({fuzz.direction().x, fuzz.direction().y, fuzz.uniform()});
    if (fuzz.below(2)) {
      m = unit(normal(s, 4 * fuzz.uniform() - 2, 4 * fuzz.uniform() - 2));
      const double im = dot(i, m);
      const Vector reflected = {2 * im * m.x - i.x, 2 * im * m.y - i.y, 2 * im * m.z - i.z};
      o = unit(reflected);
    }
    SCOPED_TRACE(describe(s, i) + " o " + std::to_string(o.x) + " " + std::to_string(o.y) + " " + std::to_string(o.z));
    const auto check = [&](const char* what, double value) {
      EXPECT_TRUE(std::isfinite(value) && value >= 0) << what << " " << value;
    };
    if (s.model.distribution != Distribution::phong) {  // whose area is a quadrature that no density needs
      check("area", reference::projected_area(s, i));
      check("normaliser", reference::normaliser(s, i));
      check("hits", reference::hit_probability(s, i));
      check("masking", reference::masking(s, i));
      EXPECT_LE(reference::masking(s, i), 1);
      EXPECT_LE(reference::hit_probability(s, i), 1 + 1e-12);
    }
    check("distribution", reference::distribution(s, m));
    const bool exact = s.model.distribution == Distribution::ggx || s.model.masking == Masking::vcavity ||
                       (s.model.distribution == Distribution::beckmann && s.mean_slope_x == 0);
    for (Sampler sampler : {Sampler::ndf, Sampler::visible, Sampler::exact}) {
      if (sampler == Sampler::exact && (!exact || s.model.distribution == Distribution::phong)) continue;
      check("pdf of a normal", reference::pdf_normal(s, sampler, i, m));
      check("pdf of a reflection", reference::pdf_reflection(s, sampler, i, o));
    }
    check("reflection", reference::evaluate_reflection(s, i, o));
    check("pdf of a transmission", reference::pdf_transmission(s, Sampler::visible, i, o));
    check("transmission", reference::evaluate_transmission(s, i, o));
    check("pdf of scattering", reference::pdf_scattering(s, Sampler::visible, i, o));
    check("scattering", reference::evaluate_scattering(s, i, o));
    check("branch", reference::branch_probability(s, i, m, true));
    if (HasFailure()) break;
  }
}

// Intervals of y in far tails: `exact` of very anisotropic Beckmann.
TEST(Extremes, AnisotropicBeckmann) {
  for (reference::Roughness alpha : {reference::Roughness{0.02, 1}, {3, 0.05}, {0.001, 0.5}}) {
    Surface s;
    s.model.distribution = Distribution::beckmann;
    s.alpha = alpha;
    for (double theta : kQuick ? std::vector<double>{80} : std::vector<double>{30, 80}) {
      for (double phi : kQuick ? std::vector<double>{2} : std::vector<double>{0, 2, 45, 89}) {
        const Vector i = direction(theta, phi);
        const double sum = over_normals(s, i, [&](Vector m, double im) {
          const Vector o = {2 * im * m.x - i.x, 2 * im * m.y - i.y, 2 * im * m.z - i.z};
          return o.z > 0 ? reference::pdf_reflection(s, Sampler::exact, i, o) * 4 * im : 0;
        });
        EXPECT_NEAR(sum, 1, 1e-3) << describe(s, i);
      }
    }
  }
}

}  // namespace
}  // namespace facetwise::test
