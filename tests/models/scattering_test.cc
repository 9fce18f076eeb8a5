// SPDX-License-Identifier: Apache-2.0
// Dielectrics: reflection and transmission at a microfacet, by choice or forced, of every family.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "models/compositions.h"
#include "facetwise/chi_square.h"
#include "support/counts.h"

namespace facetwise::test {
namespace {

using reference::Vector;

constexpr double kUnit = 0x1p-24;
const std::size_t kCount = kQuick ? 10'000 : 100'000;
const int kSide = kQuick ? 96 : 288;
constexpr double kAnyFailure = 0.01;
constexpr int kTests = 300;  // chi-square tests of this file, roughly

Composition glass(const Family& family, Sampler sampler, Transport transport = Transport::radiance) {
  Composition c = plain(family, sampler);
  c.model.interface = Interface::dielectric;
  c.model.transport = transport;
  return c;
}

// Into glass and out of it.
std::vector<Point> glasses(const Composition& c) {
  std::vector<Point> points = calm_points(c);
  for (std::size_t n = 0; n < points.size(); ++n) points[n].eta = n % 2 ? 1.5f : 1 / 1.4f;
  return points;
}

class ModelScattering : public testing::TestWithParam<Family> {
 protected:
  std::vector<Sampler> samplers() const { return samplers_of(GetParam(), Operation::sample_scattering); }
  void SetUp() override {
    if (samplers().empty()) GTEST_SKIP() << "no kernel";
  }
};

struct Mean {
  double weight = 0, deviation = 0, accepted = 0;
};
Mean mean_of(const std::vector<Result>& results) {
  double sum = 0, squares = 0, kept = 0;
  for (const Result& r : results) {
    sum += r.weight;
    squares += static_cast<double>(r.weight) * r.weight;
    kept += accepted(r);
  }
  const double n = static_cast<double>(results.size()), mean = sum / n;
  return {mean, std::sqrt(std::max(0.0, squares / n - mean * mean) / n), kept / n};
}

// The density of both hemispheres integrates to the share that goes somewhere, the value to the mean weight.
TEST_P(ModelScattering, IntegralsAreTheSharesAndMeans) {
  for (const Sampler sampler : samplers())
    for (const bool forced : {false, true}) {
      const Composition c = glass(GetParam(), sampler, Transport::importance);
      for (const Point& point : glasses(c)) {
        const Integral integral =
            integrate(forced ? Operation::evaluate_transmission : Operation::evaluate_scattering, c, point, kSide);
        const Mean mean =
            mean_of(draw(forced ? Operation::sample_transmission : Operation::sample_scattering, c, point, kCount, 5));
        EXPECT_LE(integral.error, kQuick ? 0.05 : 0.01) << describe(c) << describe(point);
        const double share = mean.accepted;
        EXPECT_NEAR(integral.pdf, share,
                    5 * std::sqrt(share * (1 - share) / kCount) + integral.error + (kQuick ? 5e-3 : 1e-3))
            << (forced ? "forced " : "") << describe(c) << describe(point);
        if (sampler != Sampler::ndf || point.iz > 0.3f) {
          EXPECT_NEAR(integral.value, mean.weight,
                      5 * mean.deviation + integral.error + (kQuick ? 5e-3 : 1e-3) * mean.weight)
              << (forced ? "forced " : "") << describe(c) << describe(point);
        }
      }
    }
}

// No energy is made, and each forced event has its part of it.
TEST_P(ModelScattering, ForcedEventsShareTheEnergy) {
  for (const Sampler sampler : samplers()) {
    const Composition c = glass(GetParam(), sampler, Transport::importance);
    for (const Point& point : glasses(c)) {
      if (sampler == Sampler::ndf && point.iz < 0.3f) continue;
      const Mean both = mean_of(draw(Operation::sample_scattering, c, point, kCount, 7)),
                 reflected = mean_of(draw(Operation::sample_reflection, c, point, kCount, 8)),
                 transmitted = mean_of(draw(Operation::sample_transmission, c, point, kCount, 9));
      const double deviation = std::hypot(both.deviation, reflected.deviation, transmitted.deviation);
      EXPECT_NEAR(both.weight, reflected.weight + transmitted.weight, 5 * deviation + 1e-5)
          << describe(c) << describe(point);
      EXPECT_LE(both.weight, 1 + 5 * both.deviation + 1e-5) << describe(c) << describe(point);
      // Behind, most of what is transmitted goes up, and is occluded.
      if (point.iz > 0) {
        EXPECT_GT(both.weight, 0.3) << describe(c) << describe(point);
      }
    }
  }
}

TEST_P(ModelScattering, WeightsOfVisibleNormalsAreAtMostOne) {
  std::uint64_t seed = 1;
  for (Composition c : compositions(GetParam(), Operation::sample_scattering)) {
    if (c.sampler == Sampler::ndf || c.model.normalisation == Normalisation::biased) continue;
    c.model.transport = Transport::importance;
    const std::vector<Point> points = hard_points(c, kQuick ? 128 : 4096, ++seed, true);
    const std::vector<Result> results = run_points(Operation::sample_scattering, c, points);
    for (std::size_t n = 0; n < points.size(); ++n)
      if (!weighs_behind(c.model, points[n])) {
        ASSERT_LE(results[n].weight, 1 + 1e-4) << describe(c) << describe(points[n]);
      }
  }
}

// Samples follow the density, each event in its own cells.
ChiSquare test_scattering(const Composition& c, const Point& point, const Point& claim, bool forced,
                          std::uint64_t seed) {
  const Operation query = forced ? Operation::evaluate_transmission : Operation::evaluate_scattering;
  const reference::Surface s = surface_of(c, point);
  const Grid grid = make_grid(query, c, claim, kSide);
  constexpr int kGroups = 12;
  // Parts of the grid that are of about equal weight, by row and column.
  std::vector<int> of[2];
  for (const bool column : {false, true}) {
    std::vector<double> parts(kSide);
    double total = 0, sum = 0;
    for (int n = 0; n < kSide * kSide; ++n)
      for (const auto& pdf : grid.pdf) {
        parts[column ? n % kSide : n / kSide] += pdf[n];
        total += pdf[n];
      }
    for (const double part : parts) {
      of[column].push_back(std::clamp(static_cast<int>((sum + part / 2) / total * kGroups), 0, kGroups - 1));
      sum += part;
    }
  }
  const auto cell = [&](int event, int n) { return (event * kGroups + of[0][n / kSide]) * kGroups + of[1][n % kSide]; };
  std::vector<double> expected(2 * kGroups * kGroups + 1);
  std::vector<std::uint64_t> counts(expected.size());
  double sum = 0;
  for (int event = 0; event < 2; ++event)
    for (int n = 0; n < kSide * kSide; ++n) {
      expected[cell(event, n)] += grid.pdf[event][n] * kCount;
      sum += grid.pdf[event][n] * kCount;
    }
  expected.back() = std::max(0.0, kCount - sum);
  const Vector i = incident(point);
  for (const Result& r :
       draw(forced ? Operation::sample_transmission : Operation::sample_scattering, c, point, kCount, seed)) {
    if (!accepted(r)) {
      ++counts.back();
      continue;
    }
    const int event = r.oz < 0;
    const Vector from = event == 0 && c.model.retro ? turned(i) : i;
    const double eta = event ? s.eta : 1;
    Vector m = unit({from.x + eta * r.ox, from.y + eta * r.oy, from.z + eta * r.oz});
    if (m.z < 0) m = {-m.x, -m.y, -m.z};
    ++counts[cell(event, cell_of(grid, s, m))];
  }
  // Where nothing is occluded, what is left is the quadrature's error.
  if (counts.back() == 0)
    for (double& e : expected) e = &e == &expected.back() ? 0 : e * kCount / sum;
  return chi_square(counts, expected);
}

TEST_P(ModelScattering, SamplesFollowTheDensity) {
  double smallest = 1;
  for (const Sampler sampler : samplers())
    for (const bool forced : {false, true}) {
      Composition c = glass(GetParam(), sampler);
      const std::vector<Point> points = glasses(c);
      for (std::size_t n = 0; n < points.size(); ++n) {
        if (student_t_straight_up(c, points[n])) continue;
        // Retro: of the family without a mean slope, as the points have one.
        c.model.retro = !GetParam().affine && n % 3 == 2;
        const ChiSquare test = test_scattering(c, points[n], points[n], forced, 50 + n);
        smallest = std::min(smallest, test.p_value);
        EXPECT_GE(test.p_value, sidak(kAnyFailure, kTests))
            << "chi-square " << test.statistic << " at " << test.degrees << " degrees: " << (forced ? "forced " : "")
            << describe(c) << describe(points[n]);
      }
    }
  RecordProperty("smallest_p_value", std::to_string(smallest));
}

TEST_P(ModelScattering, WrongIndicesAreRefused) {
  if (kQuick) return;
  for (const Sampler sampler : samplers()) {
    const Composition c = glass(GetParam(), sampler);
    const Point point = glasses(c)[1];
    Point claim = point;
    claim.eta *= 1.1f;
    // The cells are those of the claim, in which the samples' own normals lie: only the choice of the event
    // differs.
    EXPECT_LT(test_scattering(c, point, claim, false, 60).p_value, 1e-6) << describe(c);
    claim = point;
    claim.alpha_x *= 1.1f;
    claim.alpha_y *= 1.1f;
    EXPECT_LT(test_scattering(c, point, claim, false, 60).p_value, 1e-6) << describe(c);
  }
}

// By how much the reference's answers move with o's rounding, in units.
double change(const Composition& c, const Point& point, Vector o) {
  const reference::Surface s = surface_of(c, point);
  const Vector i = incident(point);
  const double pdf = reference::pdf_scattering(s, c.sampler, i, o), value = reference::evaluate_scattering(s, i, o);
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    double largest = 0;
    for (const double step : {-kUnit, kUnit}) {
      Vector moved = o;
      (k == 0 ? moved.x : k == 1 ? moved.y : moved.z) += step;
      largest = std::max(largest, std::abs(reference::pdf_scattering(s, c.sampler, i, moved) / pdf - 1) +
                                      std::abs(reference::evaluate_scattering(s, i, moved) / value - 1));
    }
    sum += largest;
  }
  return sum / kUnit;
}

TEST_P(ModelScattering, SamplesAgreeWithQueries) {
  std::uint64_t seed = 900;
  std::size_t compared = 0, drawn = 0;
  double worst = 0;
  std::vector<double> errors;
  for (Composition c : compositions(GetParam(), Operation::sample_scattering)) {
    c.model.transport = ++seed % 2 ? Transport::radiance : Transport::importance;
    std::vector<Point> points;
    for (const Point& calm : glasses(c))
      for (const Point& p : with_random(calm, kQuick ? 8 : 256, seed * 10 + points.size())) points.push_back(p);
    const std::vector<Result> samples = run_points(Operation::sample_scattering, c, points);
    for (std::size_t n = 0; n < points.size(); ++n) {
      points[n].ox = samples[n].ox;
      points[n].oy = samples[n].oy;
      points[n].oz = samples[n].oz;
    }
    const std::vector<Result> queries = run_points(Operation::evaluate_scattering, c, points);
    for (std::size_t n = 0; n < points.size(); ++n) {
      const Result &sample = samples[n], &query = queries[n];
      if (!accepted(sample)) {
        ASSERT_EQ(sample.pdf, 0) << describe(c) << describe(points[n]);
        ASSERT_EQ(sample.weight, 0) << describe(c) << describe(points[n]);
        continue;
      }
      if (student_t_straight_up(c, points[n])) continue;
      ++drawn;
      const bool below = sample.event == static_cast<int>(Event::transmission);
      ASSERT_EQ(below, sample.oz < 0) << describe(c) << describe(points[n]);
      const float eta2 = points[n].eta * points[n].eta;
      ASSERT_EQ(sample.eta_scale, below && c.model.transport == Transport::radiance ? eta2 : 1) << describe(c);
      if (sample.weight == 0 || query.value == 0) {
        ASSERT_LE(std::max(sample.weight * sample.pdf, query.value), 1e-12) << describe(c) << describe(points[n]);
        continue;
      }
      if (std::abs(sample.oz) < 1e-4f || points[n].iz + sample.oz * (below ? -10 : 1) < 1e-4f) continue;
      const Vector i = incident(points[n]);
      const HalfVector half =
          half_vector(c, points[n], !below && c.model.retro ? turned(i) : i, {sample.mx, sample.my, sample.mz});
      const double moves = change(c, points[n], outgoing(points[n])) * (1 + half.turn) + half.im;
      if (!(moves * kUnit < 0.01)) continue;
      ++compared;
      const double error = std::abs(query.pdf / sample.pdf - 1) / kUnit;
      errors.push_back(error);
      worst = std::max(worst, (error - 64) / moves);
      ASSERT_LE(error, 128 + 24 * moves) << "pdf " << sample.pdf << ", query " << query.pdf << ": " << describe(c)
                                         << describe(points[n]) << " event " << int{sample.event};
      ASSERT_NEAR(query.branch, sample.branch, (128 + 24 * moves) * kUnit) << describe(c) << describe(points[n]);
      ASSERT_LE(std::abs(query.value / (static_cast<double>(sample.weight) * query.pdf) - 1) / kUnit,
                128 + 8 / std::abs(sample.oz) + 24 * moves)
          << "weight " << sample.weight << ", value " << query.value << ", pdf " << query.pdf << ": " << describe(c)
          << describe(points[n]) << " event " << int{sample.event};
      ASSERT_NEAR(sample.ox * sample.ox + sample.oy * sample.oy + sample.oz * sample.oz, 1, 1e-5) << describe(c);
    }
  }
  std::printf("%-22s %zu of %zu samples, beyond at most %.2f of o's rounding\n", name(GetParam()).c_str(), compared,
              drawn, worst);
  EXPECT_GT(compared, drawn / 2);
}

// Radiance is scaled by 1 / eta^2 on its way, importance is not; nothing else differs.
TEST_P(ModelScattering, TransportsDifferByEtaSquared) {
  for (const Sampler sampler : samplers()) {
    const Composition radiance = glass(GetParam(), sampler),
                      importance = glass(GetParam(), sampler, Transport::importance);
    const std::vector<Point> points = scattering_points(radiance, kQuick ? 128 : 8192, 31);
    for (const Operation operation : {Operation::sample_scattering, Operation::sample_transmission,
                                      Operation::evaluate_scattering, Operation::evaluate_transmission}) {
      const std::vector<Result> a = run_points(operation, radiance, points),
                                b = run_points(operation, importance, points);
      for (std::size_t n = 0; n < points.size(); ++n) {
        const bool sampled = operation == Operation::sample_scattering || operation == Operation::sample_transmission;
        const bool below = (sampled ? a[n].oz : points[n].oz) < 0;
        const double eta2 = below ? static_cast<double>(points[n].eta) * points[n].eta : 1;
        ASSERT_EQ(a[n].pdf, b[n].pdf) << describe(points[n]);
        ASSERT_EQ(a[n].status, b[n].status) << describe(points[n]);
        ASSERT_NEAR(a[n].weight * eta2, b[n].weight, 1e-6 * b[n].weight) << describe(points[n]);
        if (b[n].value > 1e-30f && b[n].value < 1e30f) {
          ASSERT_NEAR(a[n].value * eta2, b[n].value, 1e-6 * b[n].value) << describe(points[n]);
        }
      }
    }
  }
}

// Out of glass, steep microfacets reflect all: forced transmission finds nothing there, and reflection has F
// = 1.
TEST_P(ModelScattering, TotalReflection) {
  for (const Sampler sampler : samplers()) {
    const Composition c = glass(GetParam(), sampler, Transport::importance);
    Point point;
    point.eta = 0.5f;
    point.alpha_x = point.alpha_y = 0.05f;
    set_incident(point, direction(60, 30));  // the critical angle is 30
    Statistics statistics;
    draw(Operation::sample_transmission, c, point, kCount, 3, &statistics);
    EXPECT_LT(statistics.accepted, kCount / 100) << describe(c);
    for (const Result& r : draw(Operation::sample_scattering, c, point, kCount / 10, 3)) {
      const double sine2 = (1 - static_cast<double>(r.im) * r.im) / 0.25;
      if (!accepted(r) || std::abs(sine2 - 1) < 1e-4) continue;
      if (sine2 > 1) {
        ASSERT_EQ(r.event, static_cast<int>(Event::reflection)) << describe(c);
        ASSERT_EQ(r.branch, 1) << describe(c);
      }
    }
  }
}

// eta = 1: a window, whatever its roughness.
TEST_P(ModelScattering, EtaOfOneIsSmooth) {
  for (const Sampler sampler : samplers())
    for (const Operation operation : {Operation::sample_scattering, Operation::sample_transmission,
                                      Operation::evaluate_scattering, Operation::evaluate_transmission}) {
      const Composition c = glass(GetParam(), sampler);
      std::vector<Point> points = scattering_points(c, 256, 17);
      for (Point& p : points) p.eta = 1;
      const std::vector<Result> results = run_points(operation, c, points);
      const bool sampled = operation == Operation::sample_scattering || operation == Operation::sample_transmission;
      for (std::size_t n = 0; n < points.size(); ++n) {
        const Result& r = results[n];
        ASSERT_EQ(r.status, static_cast<int>(LaneStatus::smooth)) << describe(points[n]);
        ASSERT_EQ(r.pdf, 0);
        ASSERT_EQ(r.value, 0);
        if (!sampled || points[n].iz <= 0) continue;
        ASSERT_NEAR(r.ox, -points[n].ix, 1e-6) << describe(points[n]);
        ASSERT_NEAR(r.oy, -points[n].iy, 1e-6) << describe(points[n]);
        ASSERT_NEAR(r.oz, -points[n].iz, 1e-6) << describe(points[n]);
        ASSERT_NEAR(r.weight, 1, 1e-6) << describe(points[n]);
      }
    }
}

// Next to 1 the lobe of transmission is next to a delta: large, and finite.
TEST_P(ModelScattering, EtaNearOneIsFinite) {
  for (const Sampler sampler : samplers())
    for (const Operation operation : {Operation::sample_scattering, Operation::sample_transmission}) {
      const Composition c = glass(GetParam(), sampler, Transport::importance);
      std::vector<Point> points;
      for (const float eta : {1 - 0x1p-24f, 1 + 0x1p-23f, 1.00001f, 0.9999f, 1.001f})
        for (Point p : glasses(c)) {
          p.eta = eta;
          for (const Point& random : with_random(p, 64, points.size())) points.push_back(random);
        }
      std::vector<Result> results = run_points(operation, c, points);
      for (std::size_t n = 0; n < points.size(); ++n) {
        const Result& r = results[n];
        ASSERT_TRUE(std::isfinite(r.pdf) && r.pdf >= 0) << r.pdf << describe(c) << describe(points[n]);
        ASSERT_TRUE(std::isfinite(r.weight) && r.weight >= 0) << r.weight << describe(c) << describe(points[n]);
        if (!accepted(r)) continue;
        if (sampler != Sampler::ndf) {
          ASSERT_LE(r.weight, 1 + 1e-4) << describe(c) << describe(points[n]);
        }
        ASSERT_NEAR(r.ox * r.ox + r.oy * r.oy + r.oz * r.oz, 1, 1e-5) << describe(c) << describe(points[n]);
        set_outgoing(points[n], {r.ox, r.oy, r.oz});
      }
      for (const Result& r : run_points(operation == Operation::sample_scattering ? Operation::evaluate_scattering
                                                                                  : Operation::evaluate_transmission,
                                        c, points))
        ASSERT_TRUE(std::isfinite(r.pdf) && std::isfinite(r.value) && r.pdf >= 0 && r.value >= 0) << describe(c);
    }
}

// Transmission takes no part in retro-reflection.
TEST_P(ModelScattering, RetroTurnsReflectionsAlone) {
  for (const Sampler sampler : samplers()) {
    Composition c = glass(GetParam(), sampler), retro = c;
    retro.model.retro = true;
    std::vector<Point> points = scattering_points(retro, kQuick ? 128 : 8192, 77);
    for (Point& p : points) p.mean_x = p.mean_y = 0;
    const std::vector<Result> a = run_points(Operation::sample_scattering, c, points),
                              b = run_points(Operation::sample_scattering, retro, points);
    std::size_t below = 0;
    for (std::size_t n = 0; n < points.size(); ++n) {
      ASSERT_EQ(a[n].pdf, b[n].pdf) << describe(c) << describe(points[n]);
      ASSERT_EQ(a[n].weight, b[n].weight) << describe(c) << describe(points[n]);
      ASSERT_EQ(a[n].event, b[n].event) << describe(c) << describe(points[n]);
      if (!accepted(a[n])) continue;
      const float sign = a[n].event == static_cast<int>(Event::reflection) ? -1 : 1;
      below += sign > 0;
      ASSERT_EQ(a[n].ox, sign * b[n].ox) << describe(c) << describe(points[n]);
      ASSERT_EQ(a[n].oy, sign * b[n].oy) << describe(c) << describe(points[n]);
      ASSERT_EQ(a[n].oz, b[n].oz) << describe(c) << describe(points[n]);
    }
    EXPECT_GT(below, points.size() / 16);
  }
}

INSTANTIATE_TEST_SUITE_P(Families, ModelScattering, testing::ValuesIn(families()),
                         [](const auto& info) { return name(info.param); });

}  // namespace
}  // namespace facetwise::test
