// SPDX-License-Identifier: Apache-2.0
// Densities of every model and sampler integrate to the share that is accepted, and values keep energy and
// reciprocity.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "slopes.h"
#include "support/counts.h"

namespace facetwise::test {
namespace {

using namespace slopes;
using reference::Roughness;

const std::vector<double> kThetas =
    kQuick ? std::vector<double>{60} : std::vector<double>{0, 60, 85, 89.9, 90, 92, 150};
const std::vector<Roughness> kAlphas =
    kQuick ? std::vector<Roughness>{{1.0, 0.3}} : std::vector<Roughness>{{0.15, 0.15}, {0.7, 0.7}, {1.0, 0.3}};

// Every third of them or so: which, goes round with the surfaces. All with FACETWISE_LONG=1.
std::vector<double> in_turn(const std::vector<double>& thetas, std::size_t turn, std::size_t every) {
  if (kQuick || long_run()) return thetas;
  std::vector<double> some;
  for (std::size_t k = turn % every; k < thetas.size(); k += every) some.push_back(thetas[k]);
  return some;
}

Surface surface(Distribution distribution, Masking masking, Roughness alpha) {
  Surface s;
  s.model.distribution = distribution;
  s.model.masking = masking;
  s.alpha = alpha;
  return s;
}

double gaussian(double x, double y) { return std::exp(-x * x - y * y) / std::numbers::pi; }

// Every distribution with every masking it has. The table is a Gaussian's, its area known.
std::vector<Surface> models() {
  std::vector<Surface> all;
  for (Roughness alpha : kAlphas) {
    for (Masking masking : {Masking::smith, Masking::vcavity})
      for (Distribution d : {Distribution::ggx, Distribution::beckmann, Distribution::student_t})
        all.push_back(surface(d, masking, alpha));
    all.push_back(surface(Distribution::phong, Masking::vcavity, alpha));
    Surface table = surface(Distribution::table, Masking::smith, alpha);
    table.table_density = gaussian;
    table.table_area = [](Vector w) {
      Surface one = surface(Distribution::beckmann, Masking::smith, {1, 1});
      return reference::projected_area(one, w);
    };
    all.push_back(table);
  }
  return all;
}

std::vector<Surface> affine_models() {
  std::vector<Surface> all;
  for (Distribution d : {Distribution::ggx, Distribution::beckmann}) {
    for (Roughness alpha : {Roughness{0.3, 0.3}, {0.2, 0.7}}) {
      Surface s = surface(d, Masking::smith, alpha);
      s.slope_correlation = 0.8;
      all.push_back(s);
      s.mean_slope_x = 0.4;
      s.mean_slope_y = -0.3;
      all.push_back(s);
      s.mean_slope_x = -2;
      s.slope_correlation = -0.5;
      all.push_back(s);
    }
  }
  if (kQuick) return {all[1], all[6]};
  return all;
}

bool has_exact(const Surface& s) {
  const Distribution d = s.model.distribution;
  if (d == Distribution::ggx) return true;
  if (d == Distribution::beckmann) return s.mean_slope_x == 0 && s.mean_slope_y == 0;
  return d == Distribution::student_t && s.model.masking == Masking::vcavity;
}

// Where `visible` draws by a density with edges, which quadratures run into: Phong with V-cavity, behind.
bool has_edges(const Surface& s, Vector i) {
  return s.model.masking == Masking::vcavity && i.z < 0 && s.model.distribution == Distribution::phong;
}

Vector reflection(Vector i, Vector m, double im) {
  return {2 * im * m.x - i.x, 2 * im * m.y - i.y, 2 * im * m.z - i.z};
}

// Integral over o of a density or value of reflections.
double over_reflections(const Surface& s, Vector i, const std::function<double(Vector)>& f, bool of_values = false) {
  return over_normals(
      s, i,
      [&](Vector m, double im) {
        const Vector o = reflection(i, m, im);
        return o.z > 0 ? f(o) * 4 * im : 0;
      },
      of_values);
}

double over_pdf(const Surface& s, Sampler sampler, Vector i) {
  return over_reflections(s, i, [&](Vector o) { return reference::pdf_reflection(s, sampler, i, o); });
}

TEST(Densities, VisibleNormalsIntegrateToOne) {
  std::vector<Surface> all = models();
  for (const Surface& s : affine_models()) all.push_back(s);
  std::size_t turn = 0;
  for (const Surface& s : all) {
    for (double theta : in_turn(kThetas, turn++, 3)) {
      const Vector i = direction(theta, 35);
      const double sum =
          over_normals(s, i, [&](Vector m, double) { return reference::pdf_normal(s, Sampler::visible, i, m); });
      EXPECT_NEAR(sum, 1, has_edges(s, i) ? 2e-4 : 1e-6) << describe(s, i);
    }
  }
}

TEST(Densities, ReflectionsIntegrateToTheShareUnoccluded) {
  std::size_t turn = 0;
  for (const Surface& s : models()) {
    for (double theta : in_turn(kThetas, turn++, 3)) {
      const Vector i = direction(theta, 35);
      EXPECT_NEAR(over_pdf(s, Sampler::visible, i), reference::share_unoccluded(s, i), has_edges(s, i) ? 2e-4 : 2e-6)
          << describe(s, i);
    }
  }
}

TEST(Densities, UnoccludedReflectionsIntegrateToOne) {
  std::vector<Surface> all = models();
  for (const Surface& s : affine_models()) all.push_back(s);
  std::size_t turn = 0;
  for (const Surface& s : all) {
    if (!has_exact(s)) continue;
    for (double theta : in_turn(kThetas, turn++, 3)) {
      const Vector i = direction(theta, 35);
      EXPECT_NEAR(over_pdf(s, Sampler::exact, i), 1, 1e-5) << describe(s, i);
    }
  }
}

// Where proportion is exact: GGX with Smith, mean slopes and correlation too.
TEST(Densities, ExactIsTheShareOfVisible) {
  for (const Surface& s : affine_models()) {
    if (s.model.distribution != Distribution::ggx) continue;
    for (double theta : {5.0, 50.0, 80.0, 89.0}) {
      const Vector i = direction(theta, 35);
      const double share = over_pdf(s, Sampler::visible, i);
      EXPECT_NEAR(reference::share_unoccluded(s, i), share, 2e-6) << describe(s, i);
      const Vector o = direction(35, 250);
      EXPECT_NEAR(reference::pdf_reflection(s, Sampler::exact, i, o) * share /
                      reference::pdf_reflection(s, Sampler::visible, i, o),
                  1, 1e-4);
    }
  }
}

// The share of `ndf` and `bounded` is counted by the definition: their densities of normals, where
// unoccluded.
TEST(Densities, NdfNormals) {
  for (const Surface& s : models()) {
    for (double theta : kQuick ? std::vector<double>{60} : std::vector<double>{0, 60, 89.9, 110}) {
      const Vector i = direction(theta, 35);
      const double facing =
          over_normals(s, i, [&](Vector m, double) { return reference::pdf_normal(s, Sampler::ndf, i, m); });
      // P(i.m > 0) is the derivative of sigma with respect to i_z, of any length.
      const double step = 1e-4;
      const double derivative = (reference::projected_area(s, {i.x, i.y, i.z + step}) -
                                 reference::projected_area(s, {i.x, i.y, i.z - step})) /
                                (2 * step);
      EXPECT_NEAR(facing, derivative, s.model.distribution == Distribution::phong ? 1e-4 : 2e-6) << describe(s, i);
    }
  }
}

TEST(Densities, AgreeWithTheGgxReference) {
  for (Roughness alpha : kAlphas) {
    const Surface s = surface(Distribution::ggx, Masking::smith, alpha);
    for (double theta : kThetas) {
      const Vector i = direction(theta, 35);
      EXPECT_NEAR(reference::projected_area(s, i) / reference::projected_area(alpha, i), 1, 1e-14);
      EXPECT_NEAR(reference::share_unoccluded(s, i), reference::share_unoccluded(alpha, i), 1e-13);
      for (double out : {5.0, 50.0, 88.0}) {
        const Vector o = direction(out, 190);
        for (Sampler sampler : {Sampler::ndf, Sampler::heitz, Sampler::cap, Sampler::bounded, Sampler::exact}) {
          const double p = reference::pdf_reflection(sampler, alpha, i, o);
          EXPECT_NEAR(reference::pdf_reflection(s, sampler, i, o), p, 1e-12 * p) << name(sampler);
        }
        for (Shadowing shadowing : {Shadowing::correlated, Shadowing::uncorrelated}) {
          Surface shadowed = s;
          shadowed.model.shadowing = shadowing;
          const double f = reference::evaluate_reflection(shadowed.model, alpha, i, o);
          EXPECT_NEAR(reference::evaluate_reflection(shadowed, i, o), f, 1e-12 * f);
        }
      }
    }
  }
}

TEST(Values, AlbedoIsTheIntegralAndAtMostOne) {
  std::size_t turn = 0;
  for (Surface s : models()) {
    ++turn;
    for (Shadowing shadowing : {Shadowing::correlated, Shadowing::uncorrelated}) {
      s.model.shadowing = shadowing;
      if (s.model.masking == Masking::vcavity && shadowing == Shadowing::uncorrelated) continue;  // no part there
      const bool few = kQuick || shadowing == Shadowing::uncorrelated;
      for (double theta : few ? std::vector<double>{60} : in_turn({0, 60, 89.9, 110}, turn, 3)) {
        const Vector i = direction(theta, 35);
        const double albedo = reference::albedo(s, i);
        EXPECT_LE(albedo, 1 + 1e-7) << describe(s, i);
        const auto value = [&](Vector o) { return reference::evaluate_reflection(s, i, o); };
        EXPECT_NEAR(over_reflections(s, i, value, true), albedo, 5e-6) << describe(s, i);
      }
    }
  }
}

// The rays know no kink at z'(o) = 0, below which all is shadowed.
TEST(Values, AlbedoWithAMeanSlope) {
  std::size_t turn = 0;
  for (const Surface& s : affine_models()) {
    for (double theta : kQuick ? std::vector<double>{50} : in_turn({5, 50, 85, 100}, turn++, 3)) {
      const Vector i = direction(theta, 35);
      const auto value = [&](Vector o) { return reference::evaluate_reflection(s, i, o); };
      EXPECT_NEAR(over_reflections(s, i, value, true), reference::albedo(s, i), 3e-4) << describe(s, i);
    }
  }
}

TEST(Values, AlbedoOfAlphaOneStraightOn) {
  const Surface s = surface(Distribution::ggx, Masking::smith, {1, 1});
  EXPECT_NEAR(reference::albedo(s, {0, 0, 1}), 1 - std::numbers::ln2, 1e-9);
}

// f(i, o) = f(o, i) in front, with and without a mean slope, for both ways of shadowing.
TEST(Values, ReflectionIsReciprocal) {
  std::vector<Surface> all = models();
  for (const Surface& s : affine_models()) all.push_back(s);
  for (Surface s : all) {
    s.model.interface = Interface::schlick;
    for (Shadowing shadowing : {Shadowing::correlated, Shadowing::uncorrelated}) {
      s.model.shadowing = shadowing;
      const Vector a = direction(40, 10), b = direction(70, 230);
      if (stretched(s, a).z <= 0 || stretched(s, b).z <= 0) continue;
      const double there = reference::evaluate_reflection(s, a, b) / b.z / std::abs(stretched(s, b).z / b.z);
      const double back = reference::evaluate_reflection(s, b, a) / a.z / std::abs(stretched(s, a).z / a.z);
      EXPECT_NEAR(there, back, 1e-12 * there) << describe(s, a);
    }
  }
}

TEST(Values, ContinuousThroughTheHorizon) {
  for (const Surface& s : models()) {
    const Vector o = direction(60, 170);
    const double at = reference::evaluate_reflection(s, {1, 0, 0}, o);
    for (double z : {1e-9, -1e-9, 1e-300, -1e-300})
      EXPECT_NEAR(reference::evaluate_reflection(s, {1, 0, z}, o) / at, 1, 1e-6) << describe(s, {1, 0, z});
  }
}

// The older practice: behind, the densities integrate to less than one.
TEST(Values, BiasedNormalisationBehind) {
  for (Distribution d : {Distribution::ggx, Distribution::beckmann}) {
    Surface s = surface(d, Masking::smith, {0.5, 0.3});
    const Vector i = direction(100, 35);
    const double sigma = reference::projected_area(s, i);
    s.model.normalisation = Normalisation::biased;
    EXPECT_NEAR(reference::normaliser(s, i), reference::projected_area(s, {i.x, i.y, -i.z}), 1e-15);
    EXPECT_NEAR(over_pdf(s, Sampler::visible, i), sigma / reference::normaliser(s, i), 1e-6);
    s.model.masking = Masking::vcavity;
    EXPECT_NEAR(over_pdf(s, Sampler::visible, i), reference::hit_probability(s, i), 1e-6);
    EXPECT_LT(over_pdf(s, Sampler::visible, i), 0.999);
  }
}

TEST(Values, RetroIsTheTurnedIncidence) {
  Surface s = surface(Distribution::beckmann, Masking::smith, {0.5, 0.3});
  const Vector i = direction(50, 35), turned = {-i.x, -i.y, i.z}, o = direction(40, 60);
  Surface retro = s;
  retro.model.retro = true;
  EXPECT_EQ(reference::evaluate_reflection(retro, i, o), reference::evaluate_reflection(s, turned, o));
  EXPECT_EQ(reference::pdf_reflection(retro, Sampler::exact, i, o),
            reference::pdf_reflection(s, Sampler::exact, turned, o));
  EXPECT_NEAR(reference::albedo(retro, i), reference::albedo(s, i), 1e-7);
}

// ---- Transmission ----

Surface glass(Distribution distribution, Masking masking, Roughness alpha, double eta) {
  Surface s = surface(distribution, masking, alpha);
  s.model.interface = Interface::dielectric;
  s.eta = eta;
  return s;
}

// Snell's law, from the definition; false for total reflection.
bool refract(double eta, Vector i, Vector m, double im, Vector& o) {
  const double sine2 = (1 - im * im) / (eta * eta);
  if (sine2 > 1) return false;
  const double t = im / eta - std::sqrt(1 - sine2);
  o = {t * m.x - i.x / eta, t * m.y - i.y / eta, t * m.z - i.z / eta};
  return true;
}

// Sum over a grid of the sphere's half where o_z has the given sign, in o itself.
double over_half_sphere(double sign, const std::function<double(Vector)>& f) {
  const int kHeights = kQuick ? 200 : 700, kAzimuths = kHeights;
  double sum = 0;
  for (int n = 0; n < kHeights; ++n) {
    const double z = (n + 0.5) / kHeights, r = std::sqrt(1 - z * z);
    for (int k = 0; k < kAzimuths; ++k) {
      const double phi = 2 * std::numbers::pi * (k + 0.5) / kAzimuths;
      sum += f({r * std::cos(phi), r * std::sin(phi), sign * z});
    }
  }
  return sum * 2 * std::numbers::pi / (kHeights * kAzimuths);
}

std::vector<Surface> glasses() {
  return {glass(Distribution::ggx, Masking::smith, {0.6, 0.6}, 1.5),
          glass(Distribution::ggx, Masking::vcavity, {0.4, 0.8}, 1 / 1.5),
          glass(Distribution::beckmann, Masking::smith, {0.7, 0.5}, 0.6),
          glass(Distribution::beckmann, Masking::vcavity, {0.6, 0.6}, 2.4),
          glass(Distribution::student_t, Masking::smith, {0.5, 0.8}, 1.33),
          glass(Distribution::phong, Masking::vcavity, {0.5, 0.5}, 1.5)};
}

// Densities over o against shares over m by Snell's law: the Jacobian, and which directions are reached.
TEST(Transmission, DensitiesIntegrateToTheShareAccepted) {
  for (const Surface& s : glasses()) {
    for (double theta : kQuick ? std::vector<double>{70} : std::vector<double>{15, 70, 100}) {
      const Vector i = direction(theta, 35);
      for (Sampler sampler : {Sampler::ndf, Sampler::visible}) {
        const double share = over_normals(s, i, [&](Vector m, double im) {
          Vector o;
          return refract(s.eta, i, m, im, o) && o.z < 0 ? reference::pdf_normal(s, sampler, i, m) : 0;
        });
        const double sum =
            over_half_sphere(-1, [&](Vector o) { return reference::pdf_transmission(s, sampler, i, o); });
        EXPECT_NEAR(sum, share, kQuick ? 1e-2 : 2e-3) << describe(s, i) << " eta " << s.eta << " " << name(sampler);
      }
    }
  }
}

TEST(Transmission, ScatteringIntegratesToTheShareThatGoesSomewhere) {
  for (const Surface& s : glasses()) {
    for (double theta : kQuick ? std::vector<double>{70} : std::vector<double>{15, 70, 100}) {
      const Vector i = direction(theta, 35);
      const double share = over_normals(s, i, [&](Vector m, double im) {
        Vector o;
        const bool reflects = reflection(i, m, im).z > 0;
        const bool transmits = refract(s.eta, i, m, im, o) && o.z < 0;
        if (im < 1e-9) return 0.0;  // the scalar product is rounding
        EXPECT_NEAR(reference::branch_probability(s, i, m, true) + reference::branch_probability(s, i, m, false),
                    reflects || transmits ? 1 : 0, 1e-12);
        return reflects || transmits ? reference::pdf_normal(s, Sampler::visible, i, m) : 0;
      });
      const auto pdf = [&](Vector o) { return reference::pdf_scattering(s, Sampler::visible, i, o); };
      const double up = over_half_sphere(1, pdf), down = over_half_sphere(-1, pdf);
      EXPECT_NEAR(up + down, share, kQuick ? 1e-2 : 3e-3) << describe(s, i) << " eta " << s.eta;
      // What both sides get, as importance, is at most all.
      Surface importance = s;
      importance.model.transport = Transport::importance;
      const auto value = [&](Vector o) { return reference::evaluate_scattering(importance, i, o); };
      const double energy = over_half_sphere(1, value) + over_half_sphere(-1, value);
      EXPECT_LE(energy, 1 + (kQuick ? 1e-2 : 3e-3)) << describe(s, i);
      EXPECT_GT(energy, 0.3) << describe(s, i);
    }
  }
}

// The surface seen from the other side, by the mirror image in z: f of radiance, 1 / eta^2 in it, is f of
// importance there (Veach 1997, section 5.2).
TEST(Transmission, ReciprocalUpToEtaSquared) {
  for (Surface s : glasses()) {
    const Vector i = direction(35, 20), o = direction(140, 215);
    s.model.transport = Transport::importance;
    const double there = reference::evaluate_transmission(s, i, o) / -o.z;
    Surface back = s;
    back.eta = 1 / s.eta;
    back.model.transport = Transport::radiance;
    const double here = reference::evaluate_transmission(back, {o.x, o.y, -o.z}, {i.x, i.y, -i.z}) / i.z;
    EXPECT_GT(there, 0);
    EXPECT_NEAR(here, there, 1e-11 * there) << describe(s, i);
    back.model.transport = Transport::importance;
    s.model.transport = Transport::radiance;
    EXPECT_NEAR(reference::evaluate_transmission(s, i, o) * s.eta * s.eta, there * -o.z, 1e-12 * there);
  }
}

TEST(Transmission, NothingAboveAndNothingWithoutADielectric) {
  Surface s = glass(Distribution::ggx, Masking::smith, {0.5, 0.5}, 1.5);
  const Vector i = direction(30, 0);
  EXPECT_EQ(reference::pdf_transmission(s, Sampler::visible, i, direction(30, 180)), 0);
  EXPECT_EQ(reference::evaluate_transmission(s, i, direction(90, 180)), 0);
  // Beyond what Snell's law reaches: o on i's side of the plane across the facet.
  EXPECT_EQ(reference::pdf_transmission(s, Sampler::visible, direction(89, 0), direction(91, 0)), 0);
  s.model.interface = Interface::conductor;
  EXPECT_EQ(reference::evaluate_transmission(s, i, direction(150, 180)), 0);
  EXPECT_EQ(reference::branch_probability(s, i, {0, 0, 1}, true), 1);
  EXPECT_EQ(reference::branch_probability(s, i, {0, 0, 1}, false), 0);
}

}  // namespace
}  // namespace facetwise::test
