// SPDX-License-Identifier: Apache-2.0
// Integrals that the definitions must satisfy, by quadrature of the double-precision reference.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "support/configurations.h"
#include "support/counts.h"
#include "support/draw.h"
#include "support/lobe.h"

namespace facetwise::test {
namespace {

using reference::Roughness;
using reference::Vector;

double dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

double length_stretched(Roughness alpha, Vector i) {
  return std::sqrt(alpha.x * alpha.x * i.x * i.x + alpha.y * alpha.y * i.y * i.y + i.z * i.z);
}

// Which share of a sampler's samples is accepted, from only K: the density of every visible-normal sampler
// is D(m) / (4 N) with its own N, so that the share is K / N.
double share_accepted(Sampler sampler, Roughness alpha, Vector i) {
  if (i.z <= 0) return 1;
  const double sigma = reference::projected_area(alpha, i), k = reference::share_unoccluded(alpha, i) * sigma;
  if (sampler == Sampler::exact) return 1;
  if (sampler == Sampler::bounded) return k / ((reference::bounded_k(alpha, i) * i.z + length_stretched(alpha, i)) / 2);
  return k / sigma;
}

class Integrals : public testing::TestWithParam<int> {
 protected:
  const Configuration& configuration() const { return configurations()[GetParam()]; }
  Roughness alpha() const { return roughness(configuration()); }
  Vector i() const { return incident(configuration()); }
};

TEST_P(Integrals, DensityOfReflectionsIsTheShareAccepted) {
  for (Sampler sampler : all_samplers()) {
    if (sampler == Sampler::ndf) continue;
    const double sum = integrate({alpha(), i()}, [&](const Vector&, const Vector& o) {
      return reference::pdf_reflection(sampler, alpha(), i(), o);
    });
    EXPECT_NEAR(sum, share_accepted(sampler, alpha(), i()), 1e-6) << name(sampler);
  }
}

// `ndf` draws m_hat uniformly in the projected disk, so that the share is the area of a region of the disk.
TEST_P(Integrals, DensityOfNdfReflectionsIsTheShareAccepted) {
  const double sum = integrate({alpha(), i()}, [&](const Vector&, const Vector& o) {
    return reference::pdf_reflection(Sampler::ndf, alpha(), i(), o);
  });
  const int kAngles = kQuick ? 1'000 : 10'000;
  double area = 0;
  for (int p = 0; p < kAngles; ++p) {
    const double phi = 2 * std::numbers::pi * (p + 0.5) / kAngles, cos = std::cos(phi), sin = std::sin(phi);
    const auto inside = [&](double r2) {
      const double r = std::sqrt(r2);
      const Vector m = {alpha().x * r * cos, alpha().y * r * sin, std::sqrt(1 - r2)};
      const double im = dot(i(), m);
      return im > 0 && 2 * im * m.z > i().z * dot(m, m);
    };
    // It holds r = 0 (i_z > 0) or r = 1 (i_z <= 0), or nothing: bisect for the other end.
    const bool from_top = i().z > 0;
    double in = from_top ? 0 : 1 - 1e-15, out = from_top ? 1 : 0;
    if (!inside(in)) continue;
    if (inside(out)) {
      ++area;
      continue;
    }
    for (int step = 0; step < 50; ++step) (inside((in + out) / 2) ? in : out) = (in + out) / 2;
    area += from_top ? in : 1 - in;
  }
  EXPECT_NEAR(sum, area / kAngles, 2e-5);
}

TEST_P(Integrals, WeakWhiteFurnace) {
  for (Sampler sampler : {Sampler::heitz, Sampler::cap}) {
    const double sum = integrate({alpha(), i(), false}, [&](const Vector& m, const Vector&) {
      return reference::pdf_normal(sampler, alpha(), i(), m);
    });
    EXPECT_NEAR(sum, 1, 1e-6) << name(sampler);
  }
  // `ndf` loses the normals that face away: a half disk and a half ellipse are left.
  const double sum = integrate({alpha(), i(), false}, [&](const Vector& m, const Vector&) {
    return reference::pdf_normal(Sampler::ndf, alpha(), i(), m);
  });
  const double facing = reference::projected_area(alpha(), i()) / length_stretched(alpha(), i());
  EXPECT_NEAR(sum, facing, 1e-6);
}

TEST_P(Integrals, ProjectedAreaAndShareUnoccluded) {
  const auto visible = [&](const Vector& m, const Vector&) {
    return reference::distribution(alpha(), m) * std::max(dot(i(), m), 0.0);
  };
  const double sigma = reference::projected_area(alpha(), i());
  const double scale = 1 / sigma;
  const Integrand density = [&](const Vector& m, const Vector& o) { return scale * visible(m, o); };
  EXPECT_NEAR(integrate({alpha(), i(), false}, density), 1, 1e-8) << "projected area";
  const double share = integrate({.alpha = alpha(), .i = i(), .reflections = true, .per_normal = true}, density);
  EXPECT_NEAR(share, reference::share_unoccluded(alpha(), i()), 1e-6) << "K / sigma";

  // The kernel's, to float accuracy.
  float share_of_kernel[1], area_of_kernel[1], masking_of_kernel[1];
  Batch batch;
  batch.lanes = 1;
  batch.incident = {static_cast<float>(i().x), static_cast<float>(i().y), static_cast<float>(i().z)};
  batch.alpha_x = static_cast<float>(alpha().x);
  batch.alpha_y = static_cast<float>(alpha().y);
  batch.out.share_unoccluded = {share_of_kernel, 1};
  batch.out.projected_area = {area_of_kernel, 1};
  batch.out.masking = {masking_of_kernel, 1};
  ASSERT_TRUE(masking(batch).ok());
  EXPECT_NEAR(share_of_kernel[0], share, 2e-6);
  EXPECT_NEAR(area_of_kernel[0] / sigma, 1, 1e-6);
  EXPECT_NEAR(masking_of_kernel[0], reference::masking(alpha(), i()), 1e-6);
}

std::vector<int> every() {
  std::vector<int> all;
  for (std::size_t n = 0; n < configurations().size(); ++n) all.push_back(static_cast<int>(n));
  return all;
}

INSTANTIATE_TEST_SUITE_P(Configurations, Integrals, testing::ValuesIn(every()),
                         [](const auto& info) { return name(configurations()[info.param]); });

// f cos(theta_o) integrates to 1 - ln 2 for alpha = 1 straight on.
TEST(WhiteFurnace, AlphaOneStraightOn) {
  const double albedo = integrate({{1, 1}, {0, 0, 1}}, [](const Vector&, const Vector& o) {
    return reference::evaluate_reflection(Model{}, {1, 1}, {0, 0, 1}, o);
  });
  EXPECT_NEAR(albedo, 1 - std::numbers::ln2, 1e-8);

  double sum = 0;
  const std::uint64_t count = kQuick ? 20'000 : 4'000'000;
  draw({.sampler = Sampler::exact, .model = {}, .alpha = {1, 1}, .i = {0, 0, 1}, .seed = 7, .count = count},
       [&](const Drawn& sample) { sum += sample.weight; });
  EXPECT_NEAR(sum / static_cast<double>(count), 1 - std::numbers::ln2, kQuick ? 0.01 : 7e-4);
}

}  // namespace
}  // namespace facetwise::test
