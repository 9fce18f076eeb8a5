// SPDX-License-Identifier: Apache-2.0
// Directional albedo and compensation: against the reference's quadrature, a furnace, and Turquin's formula.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>
#include <span>

#include "facetwise/albedo_table.h"
#include "facetwise/slope_table.h"
#include "models/compositions.h"
#include "support/counts.h"

namespace facetwise::test {
namespace {

using reference::Vector;

AlbedoTable::Options small() {
  return {.sizes = {17, 9, 5, 5, 3, 3}, .dielectric_sizes = {9, 5, 0, 0, 0, 0, 9}, .samples = 4};
}

void use_table(const Model& model, const AlbedoTable::Options& options) {
  const auto table = AlbedoTable::build(model, options);
  ASSERT_TRUE(table.ok()) << table.status();
  use_albedo_table(*table);
}

struct Places {
  std::vector<float> x, y, z, alpha_x, alpha_y;
  std::size_t size() const { return x.size(); }
  Vector i(std::size_t n) const { return {x[n], y[n], z[n]}; }
  Batch batch(const Model& model) const {
    Batch batch;
    batch.model = model;
    batch.lanes = size();
    batch.incident = {x, y, z};
    batch.alpha_x = alpha_x;
    batch.alpha_y = alpha_y;
    return batch;
  }
  std::string describe(std::size_t n) const {
    return "i " + std::to_string(x[n]) + " " + std::to_string(y[n]) + " " + std::to_string(z[n]) + ", alpha " +
           std::to_string(alpha_x[n]) + " " + std::to_string(alpha_y[n]);
  }
};

float largest_alpha(const Model& model) {
  return model.distribution == Distribution::phong ? kLargestPhongAlpha : kLargestAlpha;
}

// Directions in front, half of them near the horizon; roughness over all that is allowed.
Places places(const Model& model, std::size_t count, bool isotropic, std::uint64_t seed, double least_z,
              float least_alpha, float largest = kLargestAlpha) {
  std::mt19937_64 random(seed);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  const auto alpha = [&] {
    const double least = std::log(least_alpha), most = std::log(std::min(largest, largest_alpha(model)));
    return uniform() < 0.5 ? static_cast<float>(std::exp(least + (most - least) * uniform()))
                           : static_cast<float>(std::exp(most) * std::max<double>(uniform(), least_alpha));
  };
  Places places;
  for (std::size_t n = 0; n < count; ++n) {
    const double z = std::max(n % 2 == 0 ? uniform() : std::pow(uniform(), 4), least_z);
    const double phi = 2 * std::numbers::pi * uniform(), r = std::sqrt((1 - z) * (1 + z));
    places.x.push_back(static_cast<float>(r * std::cos(phi)));
    places.y.push_back(static_cast<float>(r * std::sin(phi)));
    places.z.push_back(static_cast<float>(z));
    places.alpha_x.push_back(alpha());
    places.alpha_y.push_back(isotropic ? places.alpha_x.back() : alpha());
  }
  return places;
}

std::vector<float> albedos(const Model& model, const Places& at) {
  std::vector<float> albedo(at.size());
  Batch batch = at.batch(model);
  batch.out.albedo = albedo;
  const auto statistics = facetwise::albedo(batch);
  EXPECT_TRUE(statistics.ok()) << statistics.status();
  return albedo;
}

// Of samples at one place.
struct Mean {
  double value, deviation;
};
Mean mean_weight(const Model& model, const Places& at, std::size_t n, std::span<float> weight,
                 Operation operation = Operation::sample_reflection, Column<float> eta = {}) {
  Batch batch;
  batch.model = model;
  batch.eta = eta;
  batch.sampler = default_sampler(operation, batch);
  batch.lanes = weight.size();
  batch.incident = {at.x[n], at.y[n], at.z[n]};
  batch.alpha_x = at.alpha_x[n];
  batch.alpha_y = at.alpha_y[n];
  batch.generator = {.seed = n};
  batch.out.weight = weight;
  const auto statistics = run(operation, batch);
  EXPECT_TRUE(statistics.ok()) << statistics.status();
  double sum = 0, squares = 0;
  for (const float w : weight) sum += w, squares += static_cast<double>(w) * w;
  const double count = static_cast<double>(weight.size()), mean = sum / count;
  return {mean, std::sqrt(std::max(0.0, squares / count - mean * mean) / count)};
}

class Albedo : public testing::TestWithParam<Family> {
 protected:
  std::vector<Model> models() const {
    Model model = plain(GetParam(), Sampler::visible).model;
    std::vector<Model> all = {model};
    model.shadowing = Shadowing::uncorrelated;
    if (model.masking == Masking::smith) all.push_back(model);
    return all;
  }
};

// What a table may be wrong by: stated in docs/albedo.md.
double tolerance(const Places& at, std::size_t n) {
  if (at.alpha_x[n] == at.alpha_y[n]) return 1e-3;
  return std::max(at.alpha_x[n], at.alpha_y[n]) <= 4 ? 5e-3 : 0.016;
}

void expect_the_references(const Model& model) {
  for (const bool isotropic : {true, false}) {
    // Closer to the horizon and to a mirror the reference's quadrature takes minutes a point, and may fail.
    const Places at = places(model, long_run() ? 10 : 4, isotropic, isotropic ? 1 : 2, 1e-3, 1e-2f);
    const std::vector<float> got = albedos(model, at);
    for (std::size_t n = 0; n < at.size(); ++n) {
      const reference::Surface surface{.model = model, .alpha = {at.alpha_x[n], at.alpha_y[n]}};
      EXPECT_NEAR(got[n], reference::albedo(surface, at.i(n)), tolerance(at, n)) << at.describe(n);
    }
  }
}

// Everywhere: the mean weight of other samples than those that made the table.
void expect_the_mean_weight(const Model& model) {
  std::vector<float> weight(1 << (long_run() ? 16 : 15));
  for (const bool isotropic : {true, false}) {
    const Places at = places(model, long_run() ? 400 : 80, isotropic, isotropic ? 3 : 4, 1e-6, kSmallestAlpha);
    const std::vector<float> got = albedos(model, at);
    for (std::size_t n = 0; n < at.size(); ++n) {
      const Mean mean = mean_weight(model, at, n, weight);
      EXPECT_NEAR(got[n], mean.value, tolerance(at, n) + 5 * mean.deviation) << at.describe(n);
    }
  }
}

// The average over the hemisphere is that of the albedo, by Gauss's rule in z^2 and equal steps of azimuth.
void expect_the_hemispheres_mean(const Model& model) {
  constexpr int kNodes = 64, kTurns = 16;
  for (const auto& [x, y] : {std::pair{0.1f, 0.1f}, {0.7f, 0.7f}, {1.0f, 0.2f}, {0.05f, 0.9f}}) {
    Places at;
    for (int j = 0; j < kNodes; ++j)
      for (int k = 0; k < kTurns; ++k) {
        const double squared = (j + 0.5) / kNodes, r = std::sqrt(1 - squared);
        const double phi = 2 * std::numbers::pi * (k + 0.5) / kTurns;
        at.x.push_back(static_cast<float>(r * std::cos(phi)));
        at.y.push_back(static_cast<float>(r * std::sin(phi)));
        at.z.push_back(static_cast<float>(std::sqrt(squared)));
        at.alpha_x.push_back(x);
        at.alpha_y.push_back(y);
      }
    double sum = 0;
    for (const float albedo : albedos(model, at)) sum += albedo;
    float mean = 0;
    Batch batch;
    batch.model = model;
    batch.lanes = 1;
    batch.incident = {0.0f, 0.0f, 1.0f};
    batch.alpha_x = x;
    batch.alpha_y = y;
    batch.out.mean_albedo = {&mean, 1};
    ASSERT_TRUE(facetwise::albedo(batch).ok());
    EXPECT_NEAR(mean, sum / static_cast<double>(at.size()), x == y ? 2e-3 : 4e-3) << x << ", " << y;
  }
}

// A furnace of reflectance 1: all light comes back, in the mean over samples.
void expect_a_white_furnace(Model model) {
  std::vector<float> weight(1 << (long_run() ? 17 : 16));
  for (const Compensation compensation : {Compensation::turquin, Compensation::kelemen}) {
    model.compensation = compensation;
    const Places at = places(model, long_run() ? 60 : 16, true, 90, 1e-6, kSmallestAlpha, 4);
    for (std::size_t n = 0; n < at.size(); ++n) {
      const Mean mean = mean_weight(model, at, n, weight);
      EXPECT_NEAR(mean.value, 1, (at.alpha_x[n] <= 1 ? 0.005 : 0.02) + 5 * mean.deviation)
          << name(compensation) << ", " << at.describe(n);
    }
  }
}

// By the tables that calls use, in one test, since a table takes seconds. An emulator would take minutes; the golden bits
// say that small tables are the same there.
TEST_P(Albedo, IsThatOfTheModel) {
  if (kQuick) return;
  for (const Model& model : models()) {
    use_table(model, {});
    expect_the_references(model);
    expect_the_mean_weight(model);
    expect_the_hemispheres_mean(model);
    expect_a_white_furnace(model);
  }
}

// Weights and values are those without it times 1 + F0 (1 - E) / E; behind, and of smooth lanes, as they are.
TEST_P(Albedo, CompensationIsTurquins) {
  for (const Model& model : models()) {
    use_table(model, small());
    for (const Interface interface : {Interface::conductor, Interface::schlick})
      for (const Operation operation : {Operation::sample_reflection, Operation::evaluate_reflection}) {
        Composition with = plain(GetParam(), Sampler::visible), without;
        with.model = model;
        with.model.interface = interface;
        without = with;
        with.model.compensation = Compensation::turquin;
        std::vector<Point> points = hard_points(with, kQuick ? 512 : 4096, 7);
        points[3].alpha_x = 0;
        const auto got = run_points(operation, with, points), before = run_points(operation, without, points);
        Places at;
        for (const Point& p : points) {
          at.x.push_back(p.ix), at.y.push_back(p.iy), at.z.push_back(p.iz);
          at.alpha_x.push_back(p.alpha_x), at.alpha_y.push_back(p.alpha_y);
        }
        const std::vector<float> albedo = albedos(model, at);
        for (std::size_t n = 0; n < points.size(); ++n) {
          const double f0 = interface == Interface::schlick ? points[n].f0 : 1;
          const bool plain_lane = points[n].iz <= 0 || n == 3;
          const double factor = plain_lane ? 1 : 1 + f0 * (1 - double{albedo[n]}) / albedo[n];
          const auto compensated = [&](float value) { return std::min(value * factor, 3e38); };
          EXPECT_NEAR(got[n].weight, compensated(before[n].weight), 3e-6 * compensated(before[n].weight))
              << describe(points[n]);
          EXPECT_NEAR(got[n].value, compensated(before[n].value), 3e-6 * compensated(before[n].value))
              << describe(points[n]);
          EXPECT_EQ(got[n].pdf, before[n].pdf);
          EXPECT_EQ(got[n].status, before[n].status);
        }
      }
  }
}

// The places of points' directions i, or o.
Places places_of(std::span<const Point> points, bool outgoing_ones) {
  Places at;
  for (const Point& p : points) {
    const Vector v = outgoing_ones ? outgoing(p) : incident(p);
    at.x.push_back(static_cast<float>(v.x));
    at.y.push_back(static_cast<float>(v.y));
    at.z.push_back(static_cast<float>(v.z));
    at.alpha_x.push_back(p.alpha_x), at.alpha_y.push_back(p.alpha_y);
  }
  return at;
}

// Values are those without it and F_ms (1 - E(i)) (1 - E(o)) / (pi (1 - mean E)) o_z, which is the same both ways;
// densities a mixture. Behind, and of smooth lanes, nothing changes.
TEST_P(Albedo, KelemensLobe) {
  const Model model = models().front();
  use_table(model, small());
  for (const Interface interface : {Interface::conductor, Interface::schlick}) {
    Composition with = plain(GetParam(), Sampler::visible), without;
    with.model.interface = interface;
    without = with;
    with.model.compensation = Compensation::kelemen;
    std::vector<Point> points = hard_points(with, kQuick ? 512 : 4096, 8);
    points[3].alpha_x = 0;
    const Operation operation = Operation::evaluate_reflection;
    const auto got = run_points(operation, with, points), before = run_points(operation, without, points);
    const Places i = places_of(points, false), o = places_of(points, true);
    const std::vector<float> albedo_i = albedos(model, i), albedo_o = albedos(model, o);
    std::vector<float> mean(points.size());
    Batch batch = i.batch(model);
    batch.out.mean_albedo = mean;
    ASSERT_TRUE(facetwise::albedo(batch).ok());
    int lobes = 0;
    for (std::size_t n = 0; n < points.size(); ++n) {
      const Point& p = points[n];
      EXPECT_EQ(got[n].status, before[n].status);
      if (p.iz <= 0 || p.oz <= 0 || n == 3) {
        EXPECT_EQ(got[n].value, before[n].value) << describe(p);
        EXPECT_EQ(got[n].pdf, before[n].pdf) << describe(p);
        continue;
      }
      const double f = interface == Interface::schlick ? p.f0 + (double{p.f90} - p.f0) / 21 : 1;
      const double again = f * f * mean[n] / std::max(1 - f * (1 - mean[n]), 1e-6);
      const double share = 1 - albedo_i[n];
      const double lobe = (interface == Interface::schlick ? again : 1) * share * (1 - double{albedo_o[n]}) * p.oz /
                          (std::numbers::pi * std::max(1 - double{mean[n]}, 1e-6));
      const double value = std::min(before[n].value + lobe, 3e38);
      const double pdf = (1 - share) * before[n].pdf + share * p.oz / std::numbers::pi;
      // 1 - E has E's rounding.
      const double rounding = 1e-6 * lobe / (std::min({share, 1 - double{albedo_o[n]}, 1 - double{mean[n]}}) + 1e-9);
      EXPECT_NEAR(got[n].value, value, 3e-6 * value + 1e-12 + (lobe > 0 ? rounding : 0)) << describe(p);
      EXPECT_NEAR(got[n].pdf, pdf, 3e-6 * pdf) << describe(p);
      lobes += lobe > 1e-6 * value;
    }
    EXPECT_GT(lobes, kQuick ? 50 : 400);
  }
}

// Samples have the density and the weight that queries give, none that the lobe draws is occluded, and their density
// integrates to one with what is: in 8 x 16 bins of equal solid angle.
TEST_P(Albedo, KelemensSamples) {
  const Model model = models().front();
  use_table(model, small());
  const Family family = GetParam();
  const std::size_t count = kQuick ? 20000 : 200000;
  for (const Sampler sampler : samplers_of(family, Operation::sample_reflection)) {
    Composition c = plain(family, sampler);
    c.model.compensation = Compensation::kelemen;
    std::mt19937_64 random(17);
    const auto uniform = [&] { return static_cast<float>(random() >> 40) * 0x1p-24f; };
    std::vector<Point> points(count);
    for (Point& p : points) {
      p.ix = 0.48f, p.iy = 0.6f, p.iz = 0.64f;
      p.alpha_x = 0.9f, p.alpha_y = 0.5f;
      p.u1 = uniform(), p.u2 = uniform(), p.u3 = uniform();
    }
    const auto drawn = run_points(Operation::sample_reflection, c, points);
    for (std::size_t n = 0; n < count; ++n)
      points[n].ox = drawn[n].ox, points[n].oy = drawn[n].oy, points[n].oz = drawn[n].oz;
    const auto asked = run_points(Operation::evaluate_reflection, c, points);
    constexpr int kTurns = 16, kHeights = 8;
    std::vector<double> counts(kTurns * kHeights), expected(kTurns * kHeights);
    const auto bin = [](float x, float y, float z) {
      const double turn = std::atan2(y, x) / (2 * std::numbers::pi) + 0.5;
      return std::min(static_cast<int>(z * kHeights), kHeights - 1) * kTurns +
             std::min(static_cast<int>(turn * kTurns), kTurns - 1);
    };
    for (std::size_t n = 0; n < count; ++n) {
      const Result& r = drawn[n];
      if (r.status != static_cast<std::uint8_t>(LaneStatus::accepted)) {
        EXPECT_EQ(r.weight, 0);
        EXPECT_EQ(r.pdf, 0);
        continue;
      }
      ASSERT_GT(r.oz, 0);
      ASSERT_NEAR(r.pdf, asked[n].pdf, 1e-3 * asked[n].pdf) << describe(points[n]);
      ASSERT_NEAR(r.weight, asked[n].value / asked[n].pdf, 1e-3 * r.weight + 1e-7) << describe(points[n]);
      // o is i's reflection about m.
      ASSERT_NEAR(2 * r.im * r.mx - points[n].ix, r.ox, 1e-4);
      ASSERT_NEAR(2 * r.im * r.mz - points[n].iz, r.oz, 1e-4);
      ++counts[static_cast<std::size_t>(bin(r.ox, r.oy, r.oz))];
    }
    // The density's integral over a bin, by its midpoints.
    constexpr int kFine = 24;
    std::vector<Point> grid;
    for (int h = 0; h < kHeights * kFine; ++h)
      for (int t = 0; t < kTurns * kFine; ++t) {
        const double z = (h + 0.5) / (kHeights * kFine),
                     phi = 2 * std::numbers::pi * ((t + 0.5) / (kTurns * kFine) - 0.5);
        Point p = points[0];
        set_outgoing(p, {std::sqrt(1 - z * z) * std::cos(phi), std::sqrt(1 - z * z) * std::sin(phi), z});
        grid.push_back(p);
      }
    const auto density = run_points(Operation::pdf_reflection, c, grid);
    for (std::size_t n = 0; n < grid.size(); ++n)
      expected[static_cast<std::size_t>(bin(grid[n].ox, grid[n].oy, grid[n].oz))] +=
          density[n].pdf * 2 * std::numbers::pi / static_cast<double>(grid.size()) * static_cast<double>(count);
    double chi2 = 0;
    for (std::size_t k = 0; k < counts.size(); ++k)
      chi2 += (counts[k] - expected[k]) * (counts[k] - expected[k]) / std::max(expected[k], 1.0);
    // 128 bins: its standard deviation is 16.
    EXPECT_LT(chi2, 128 + 6 * 16 + 1e-6 * static_cast<double>(count)) << name(sampler);
  }
}

// What a dielectric's table may be wrong by (docs/albedo.md): both together, and the reflected or transmitted part.
struct DielectricTolerance {
  double both, part;
  double seldom;  // what nine lanes in ten keep to, part
  double both_compensated() const { return std::min(both, 0.15); }
};
DielectricTolerance dielectric_tolerance(float eta, bool isotropic) {
  if (isotropic) return eta > 1 ? DielectricTolerance{0.005, 0.1, 0.01} : DielectricTolerance{0.02, 0.1, 0.02};
  return {0.7, 0.7, 0.2};
}

// Reflected and transmitted albedo are the mean weights of other samples; together with them, compensated, all light
// comes back or goes through.
TEST_P(Albedo, OfADielectric) {
  // Those of the others take a minute together, and are built in the same way.
  if (kQuick || (GetParam().distribution != Distribution::ggx && !long_run())) return;
  for (Model model : models()) {
    model.interface = Interface::dielectric;
    model.transport = Transport::importance;
    // All that is different is the table.
    if (model.shadowing == Shadowing::uncorrelated) continue;
    use_table(model, {});
    std::vector<float> weight(1 << 14);
    for (const bool isotropic : {true, false}) {
      const Places at = places(model, 100, isotropic, isotropic ? 13 : 14, 1e-4, kSmallestAlpha, 2);
      std::mt19937_64 random(5);
      std::vector<float> eta(at.size()), reflected(at.size()), transmitted(at.size()), mean(at.size());
      for (float& e : eta) {
        const double u = static_cast<double>(random() >> 11) * 0x1p-53;
        e = static_cast<float>(random() % 2 == 0 ? 1 + 1.5 * u : 1 / (1 + 1.5 * u));
      }
      Batch batch = at.batch(model);
      batch.eta = eta;
      batch.out.albedo = reflected;
      batch.out.transmitted = transmitted;
      ASSERT_TRUE(facetwise::albedo(batch).ok());
      std::size_t off = 0;
      for (std::size_t n = 0; n < at.size(); ++n) {
        const DielectricTolerance tolerance = dielectric_tolerance(eta[n], isotropic);
        const auto mean_of = [&](Operation operation, Compensation compensation) {
          Model one = model;
          one.compensation = compensation;
          return mean_weight(one, at, n, weight, operation, eta[n]);
        };
        const Mean r = mean_of(Operation::sample_reflection, Compensation::none);
        const Mean t = mean_of(Operation::sample_transmission, Compensation::none);
        const Mean both = mean_of(Operation::sample_scattering, Compensation::turquin);
        const double sum = r.value + t.value;
        EXPECT_NEAR(reflected[n], r.value, tolerance.part + 5 * r.deviation) << at.describe(n) << " eta " << eta[n];
        EXPECT_NEAR(transmitted[n], t.value, tolerance.part + 5 * t.deviation) << at.describe(n) << " eta " << eta[n];
        EXPECT_NEAR(reflected[n] + transmitted[n], sum, tolerance.both + 5 * (r.deviation + t.deviation))
            << at.describe(n) << " eta " << eta[n];
        // The compensation of anisotropic roughness is less than all that is lost.
        const double noise = 5 * both.deviation;
        EXPECT_LE(both.value, 1 + tolerance.both_compensated() + noise) << at.describe(n) << " eta " << eta[n];
        EXPECT_GE(both.value, (isotropic ? 1 - tolerance.both : sum - 5 * (r.deviation + t.deviation)) - noise - 1e-3)
            << at.describe(n) << " eta " << eta[n];
        off += std::max(std::abs(reflected[n] - r.value), std::abs(transmitted[n] - t.value)) > tolerance.seldom;
      }
      EXPECT_LE(off, at.size() / 10) << isotropic;
    }
  }
}

// Smooth lanes, and those with eta = 1, have Fresnel's shares.
TEST_P(Albedo, OfASmoothDielectric) {
  Model model = models().front();
  model.interface = Interface::dielectric;
  use_table(model, small());
  const float eta[] = {1.5f, 1, 1.5f, 1.5f, -1}, alpha[] = {0, 0.5f, -1, 1e-5f, 0.5f};
  float albedo[5], transmitted[5], mean[5];
  std::uint8_t status[5];
  Batch batch;
  batch.model = model;
  batch.lanes = 5;
  batch.incident = {0.0f, 0.0f, 1.0f};
  batch.eta = eta;
  batch.alpha_x = batch.alpha_y = alpha;
  batch.out.albedo = albedo;
  batch.out.transmitted = transmitted;
  batch.out.mean_albedo = mean;
  batch.out.status = status;
  const auto statistics = facetwise::albedo(batch);
  ASSERT_TRUE(statistics.ok()) << statistics.status();
  EXPECT_EQ(*statistics, (Statistics{.smooth = 3, .invalid = 2}));
  for (const int lane : {0, 3}) {
    EXPECT_NEAR(albedo[lane], 0.04f, 1e-6f);
    EXPECT_NEAR(transmitted[lane], 0.96f, 1e-6f);
    EXPECT_GT(mean[lane], 0.05f);
  }
  EXPECT_EQ(albedo[1], 0);
  EXPECT_EQ(transmitted[1], 1);
  EXPECT_EQ(mean[1], 0);
  for (const int lane : {2, 4}) EXPECT_EQ(albedo[lane] + transmitted[lane] + mean[lane], 0);
}

TEST_P(Albedo, PolicyForLanes) {
  const Model model = models().front();
  use_table(model, small());
  const float nan = std::numeric_limits<float>::quiet_NaN();
  Places at;
  const auto add = [&](float x, float y, float z, float alpha_x, float alpha_y) {
    at.x.push_back(x), at.y.push_back(y), at.z.push_back(z), at.alpha_x.push_back(alpha_x),
        at.alpha_y.push_back(alpha_y);
  };
  add(0.6f, 0, 0.8f, 0, 0.5f);      // smooth
  add(0.6f, 0, -0.8f, 0.5f, 0.5f);  // behind, as at the horizon
  add(1, 0, 0, 0.5f, 0.5f);
  add(0.6f, 0, 0.8f, -1, 0.5f);  // invalid
  add(nan, 0, 0.8f, 0.5f, 0.5f);
  add(0, 0, 1, 0.5f, 0.5f);
  std::vector<float> albedo(at.size()), mean(at.size());
  std::vector<std::uint8_t> status(at.size());
  Batch batch = at.batch(model);
  batch.out.albedo = albedo;
  batch.out.mean_albedo = mean;
  batch.out.status = status;
  const auto statistics = facetwise::albedo(batch);
  ASSERT_TRUE(statistics.ok()) << statistics.status();
  EXPECT_EQ(*statistics, (Statistics{.accepted = 3, .smooth = 1, .invalid = 2}));
  EXPECT_EQ(albedo[0], 1);
  EXPECT_EQ(mean[0], 1);
  EXPECT_EQ(albedo[1], albedo[2]);
  EXPECT_EQ(albedo[3], 0);
  EXPECT_EQ(albedo[4], 0);
  EXPECT_GT(albedo[5], 0.5f);
  EXPECT_LE(albedo[5], 1);
}

INSTANTIATE_TEST_SUITE_P(Families, Albedo, testing::ValuesIn([] {
                           std::vector<Family> all;
                           for (const Family& family : families())
                             if (!family.affine) all.push_back(family);
                           return all;
                         }()),
                         [](const auto& info) { return name(info.param); });

// Of correlated roughness: that of its principal axes.
TEST(AlbedoTables, CorrelatedRoughness) {
  const Model model;
  use_table(model, small());
  // Covariance [[a^2, rho a^2], [rho a^2, a^2]] has the axes (1, 1) and (1, -1).
  constexpr float kAlpha = 0.4f, kRho = 0.5f;
  float turned = 0, straight = 0;
  Batch batch;
  batch.lanes = 1;
  batch.incident = {0.6f, 0.0f, 0.8f};
  batch.alpha_x = batch.alpha_y = kAlpha;
  batch.slope_correlation = kRho;
  batch.out.albedo = {&turned, 1};
  ASSERT_TRUE(facetwise::albedo(batch).ok());
  batch.slope_correlation = {};
  const float along = 0.6f / std::numbers::sqrt2_v<float>;
  batch.incident = {along, along, 0.8f};
  batch.alpha_x = kAlpha * std::sqrt(1 + kRho);
  batch.alpha_y = kAlpha * std::sqrt(1 - kRho);
  batch.out.albedo = {&straight, 1};
  ASSERT_TRUE(facetwise::albedo(batch).ok());
  EXPECT_NEAR(turned, straight, 1e-5);
}

class AlbedoFiles : public testing::TestWithParam<Interface> {};

TEST_P(AlbedoFiles, KeepTables) {
  Model model{.distribution = Distribution::beckmann, .shadowing = Shadowing::uncorrelated, .interface = GetParam()};
  double told = 0;
  AlbedoTable::Options options = small();
  options.progress = [&](double done) {
    EXPECT_GE(done, told);
    told = done;
  };
  const auto table = AlbedoTable::build(model, options);
  ASSERT_TRUE(table.ok()) << table.status();
  EXPECT_GE(told, 0.98);
  EXPECT_TRUE((*table)->fits(model));
  EXPECT_EQ((*table)->description(), std::string("beckmann with smith masking, uncorrelated shadowing") +
                                         (GetParam() == Interface::dielectric ? ", dielectric" : ""));
  Model other = model;
  other.shadowing = Shadowing::correlated;
  EXPECT_FALSE((*table)->fits(other));
  model.interface = GetParam() == Interface::dielectric ? Interface::schlick : Interface::dielectric;
  EXPECT_FALSE((*table)->fits(model));

  const std::string path =
      std::filesystem::temp_directory_path() / ("facetwise_albedo_test" + std::to_string(getpid()) + ".table");
  ASSERT_TRUE((*table)->save(path).ok());
  const auto read = AlbedoTable::load(path);
  std::filesystem::remove(path);
  ASSERT_TRUE(read.ok()) << read.status();
  const std::string bytes = (*table)->serialise();
  EXPECT_EQ((*read)->serialise(), bytes);
  EXPECT_EQ((*read)->key(), (*table)->key());

  EXPECT_EQ(AlbedoTable::load("/nowhere/table").status().code(), absl::StatusCode::kNotFound);
  EXPECT_FALSE(AlbedoTable::parse("").ok());
  EXPECT_FALSE(AlbedoTable::parse(bytes.substr(0, bytes.size() - 1)).ok());
  EXPECT_FALSE(AlbedoTable::parse(bytes + "x").ok());
  for (std::size_t k = 0; k < bytes.size(); k += k < 64 ? 1 : 97) {
    std::string spoilt = bytes;
    spoilt[k] = static_cast<char>(spoilt[k] ^ 0x41);
    EXPECT_FALSE(AlbedoTable::parse(spoilt).ok()) << "byte " << k;
  }
}

INSTANTIATE_TEST_SUITE_P(Interfaces, AlbedoFiles, testing::Values(Interface::conductor, Interface::dielectric),
                         [](const auto& info) { return std::string(name(info.param)); });

TEST(AlbedoTables, OfATableOfSlopes) {
  const auto density = [](double x, double y) { return std::exp(-x * x - y * y); };
  const auto slopes =
      SlopeTable::build(density, {.radial = true, .grid = 129, .incidence = 33, .slopes = 33, .uniforms = 64});
  ASSERT_TRUE(slopes.ok()) << slopes.status();
  const Model tabulated{.distribution = Distribution::table, .table = *slopes},
      beckmann{.distribution = Distribution::beckmann};
  const auto a = AlbedoTable::build(tabulated, small()), b = AlbedoTable::build(beckmann, small());
  ASSERT_TRUE(a.ok()) << a.status();
  ASSERT_TRUE(b.ok()) << b.status();
  EXPECT_NE((*a)->key(), (*b)->key());
  // The same density: the same albedo, up to what the table rounds and other samples.
  for (std::size_t k = 0; k < small().sizes.isotropic(); ++k)
    EXPECT_NEAR((*a)->view().isotropic[k], (*b)->view().isotropic[k], 0.03) << k;
}

TEST(AlbedoTables, Refusals) {
  const auto refused = [](const absl::Status& status, std::string_view start) {
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
    EXPECT_TRUE(std::string(status.message()).starts_with(start)) << status;
  };
  refused(AlbedoTable::build({}, {.sizes = {.v = 1}}).status(), "sizes: ");
  refused(AlbedoTable::build({}, {.sizes = kDielectricAlbedo}).status(), "sizes: ");
  refused(AlbedoTable::build({.interface = Interface::dielectric}, {.dielectric_sizes = {}}).status(), "sizes: ");
  refused(AlbedoTable::build({}, {.samples = 3}).status(), "samples: ");
  refused(AlbedoTable::build({.distribution = Distribution::phong}, small()).status(), "model.masking: ");
  Batch batch;
  batch.lanes = 1;
  batch.incident = {0.0f, 0.0f, 1.0f};
  batch.alpha_x = batch.alpha_y = 0.5f;
  float albedo = -7;
  batch.out.albedo = {&albedo, 1};
  batch.mean_slope_x = 0.1f;
  refused(facetwise::albedo(batch).status(), "mean_slope_x: ");
  batch.mean_slope_x = {};
  batch.out.transmitted = {&albedo, 1};
  refused(facetwise::albedo(batch).status(), "out.transmitted: ");
  batch.out.transmitted = {};
  batch.model.interface = Interface::dielectric;
  refused(facetwise::albedo(batch).status(), "eta: ");
  batch.model.compensation = Compensation::kelemen;
  refused(check(Operation::sample_scattering, batch), "model.compensation: ");
  batch.model.interface = Interface::conductor;
  batch.model.compensation = static_cast<Compensation>(9);
  refused(facetwise::albedo(batch).status(), "model.compensation: ");
  EXPECT_EQ(albedo, -7);
}

}  // namespace
}  // namespace facetwise::test
