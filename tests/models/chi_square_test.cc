// SPDX-License-Identifier: Apache-2.0
// Samples follow their densities: chi-square over cells of standard slopes, for every sampler of every
// family.
#include "facetwise/chi_square.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "models/compositions.h"
#include "support/counts.h"

namespace facetwise::test {
namespace {

using reference::Vector;

const std::size_t kCount = kQuick ? 10'000 : 100'000;
const int kSide = kQuick ? 120 : 384;
// Any case of this file fails a right kernel with this probability; the seeds are fixed.
constexpr double kAnyFailure = 0.01;

// Rows of the grid put together to about equal parts.
std::vector<int> group(const std::vector<double>& parts, int groups) {
  double total = 0, sum = 0;
  for (const double part : parts) total += part;
  std::vector<int> of;
  for (const double part : parts) {
    of.push_back(total > 0 ? std::clamp(static_cast<int>((sum + part / 2) / total * groups), 0, groups - 1) : 0);
    sum += part;
  }
  return of;
}

struct Cells {
  static constexpr int kGroups = 14;
  std::vector<int> of_t, of_phi;
  explicit Cells(const Grid& grid, int event) {
    std::vector<double> t(grid.side), phi(grid.side);
    for (int n = 0; n < grid.side * grid.side; ++n) {
      t[n / grid.side] += grid.pdf[event][n];
      phi[n % grid.side] += grid.pdf[event][n];
    }
    of_t = group(t, kGroups);
    of_phi = group(phi, kGroups);
  }
  int at(int cell) const {
    const int side = static_cast<int>(of_t.size());
    return of_t[cell / side] * kGroups + of_phi[cell % side];
  }
  std::vector<double> expected(const Grid& grid, int event) const {
    std::vector<double> sums(kGroups * kGroups);
    for (int n = 0; n < grid.side * grid.side; ++n) sums[at(n)] += grid.pdf[event][n] * kCount;
    return sums;
  }
};

// The samples' p-values with the density of `claimed` points, the same cells for all.
std::vector<ChiSquare> test_reflections(const Composition& c, const Point& point, const std::vector<Point>& claimed,
                                        std::uint64_t seed) {
  const reference::Surface s = surface_of(c, point);
  const Grid grid = make_grid(Operation::evaluate_reflection, c, point, kSide);
  const Cells cells(grid, 0);
  std::vector<std::uint64_t> counts(Cells::kGroups * Cells::kGroups + 1);
  const Vector i = incident(point), from = c.model.retro ? turned(i) : i;
  for (const Result& r : draw(Operation::sample_reflection, c, point, kCount, seed))
    ++counts[accepted(r) ? cells.at(cell_of(grid, s, unit({from.x + r.ox, from.y + r.oy, from.z + r.oz})))
                         : counts.size() - 1];
  std::vector<ChiSquare> tests;
  for (const Point& claim : claimed) {
    // The claim's density at the same places: the grid is that of the true surface.
    std::vector<double> expected(cells.expected(grid, 0));
    if (&claim != &claimed[0]) {
      std::vector<Point> points;
      std::vector<std::pair<int, double>> places;
      for (int n = 0; n < grid.side * grid.side; ++n) {
        const double t = grid.t(n / grid.side + 0.5), r = std::tan(t);
        double area = 0;
        const Vector m = normal_of(s, r, 2 * std::numbers::pi * (n % grid.side + 0.5) / grid.side, &area);
        area *= grid.slopes(t);
        if (dot(from, m) <= 0) continue;
        const Vector o = reflection(from, m);
        if (o.z <= 0) continue;
        points.push_back(claim);
        set_outgoing(points.back(), o);
        places.push_back({n, area * 4 * dot(from, m)});
      }
      std::fill(expected.begin(), expected.end(), 0.0);
      const std::vector<Result> results = run_points(Operation::evaluate_reflection, c, points);
      for (std::size_t n = 0; n < points.size(); ++n)
        expected[cells.at(places[n].first)] += places[n].second * results[n].pdf * kCount;
    }
    double sum = 0;
    for (const double e : expected) sum += e;
    // What is left is occluded, or where nothing is the quadrature's error.
    expected.push_back(std::max(0.0, kCount - sum));
    if (counts.back() == 0)
      for (double& e : expected) e = &e == &expected.back() ? 0 : e * kCount / sum;
    tests.push_back(chi_square(counts, expected));
  }
  return tests;
}

class ModelChiSquare : public testing::TestWithParam<Family> {};

// How many p-values there are, roughly, of all families.
constexpr int kTests = 400;

TEST_P(ModelChiSquare, ReflectionsFollowTheDensity) {
  double smallest = 1;
  for (const Sampler sampler : samplers_of(GetParam(), Operation::sample_reflection))
    for (const bool retro : {false, true}) {
      Composition c = plain(GetParam(), sampler);
      c.model.retro = retro;
      std::vector<Point> points = calm_points(c);
      if (retro) points.resize(3);
      for (std::size_t n = 0; n < points.size(); ++n) {
        if (student_t_straight_up(c, points[n])) continue;
        const ChiSquare test = test_reflections(c, points[n], {points[n]}, 100 * n + static_cast<int>(sampler))[0];
        smallest = std::min(smallest, test.p_value);
        EXPECT_GE(test.p_value, sidak(kAnyFailure, kTests)) << "chi-square " << test.statistic << " at " << test.degrees
                                                            << " degrees: " << describe(c) << describe(points[n]);
        EXPECT_GE(test.degrees, kQuick ? 1 : 60) << describe(c) << describe(points[n]);
      }
    }
  RecordProperty("smallest_p_value", std::to_string(smallest));
}

// The same samples refuse a roughness that is 10 % larger, and a direction that is a few degrees off.
TEST_P(ModelChiSquare, WrongDensitiesAreRefused) {
  if (kQuick) return;
  for (const Sampler sampler : samplers_of(GetParam(), Operation::sample_reflection)) {
    const Composition c = plain(GetParam(), sampler);
    const std::vector<Point> points = calm_points(c);
    for (const std::size_t n : {1u, 2u}) {
      Point rougher = points[n], moved = points[n], sheared = points[n];
      rougher.alpha_x *= 1.1f;
      rougher.alpha_y *= 1.1f;
      set_incident(moved, unit({moved.ix - 0.12f, moved.iy, moved.iz}));
      sheared.correlation += 0.15f;
      const std::vector<ChiSquare> tests = test_reflections(c, points[n], {points[n], rougher, moved, sheared}, 77);
      EXPECT_GE(tests[0].p_value, sidak(kAnyFailure, kTests)) << describe(c) << describe(points[n]);
      EXPECT_LT(tests[1].p_value, 1e-6) << "rougher: " << describe(c) << describe(points[n]);
      // `ndf` knows no i but by what reflects.
      if (sampler != Sampler::ndf) {
        EXPECT_LT(tests[2].p_value, 1e-6) << "moved: " << describe(c) << describe(points[n]);
      }
      if (c.affine) {
        EXPECT_LT(tests[3].p_value, 1e-6) << "sheared: " << describe(c) << describe(points[n]);
      }
    }
  }
}

TEST_P(ModelChiSquare, NormalsFollowTheDensity) {
  for (const Sampler sampler : samplers_of(GetParam(), Operation::sample_normal)) {
    const Composition c = plain(GetParam(), sampler);
    const std::vector<Point> points = calm_points(c);
    for (std::size_t n = 1; n < points.size(); n += 2) {
      const Point& point = points[n];
      const reference::Surface s = surface_of(c, point);
      Grid grid{.side = kQuick ? 60 : 196, .pdf = {}, .value = {}};
      grid.pdf[0].resize(grid.side * grid.side);
      for (int k = 0; k < grid.side * grid.side; ++k) {
        const double t = grid.t(k / grid.side + 0.5), r = std::tan(t);
        double area = 0;
        const Vector m = normal_of(s, r, 2 * std::numbers::pi * (k % grid.side + 0.5) / grid.side, &area);
        area *= grid.slopes(t);
        grid.pdf[0][k] = area * reference::pdf_normal(s, sampler, incident(point), m);
      }
      const Cells cells(grid, 0);
      std::vector<std::uint64_t> counts(Cells::kGroups * Cells::kGroups + 1);
      for (const Result& r : draw(Operation::sample_normal, c, point, kCount, 300 + n))
        ++counts[accepted(r) ? cells.at(cell_of(grid, s, {r.mx, r.my, r.mz})) : counts.size() - 1];
      std::vector<double> expected = cells.expected(grid, 0);
      double sum = 0;
      for (const double e : expected) sum += e;
      expected.push_back(std::max(0.0, kCount - sum));
      if (counts.back() == 0)
        for (double& e : expected) e = &e == &expected.back() ? 0 : e * kCount / sum;
      const ChiSquare test = chi_square(counts, expected);
      EXPECT_GE(test.p_value, sidak(kAnyFailure, kTests)) << "chi-square " << test.statistic << " at " << test.degrees
                                                          << " degrees: " << describe(c) << describe(point);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Families, ModelChiSquare, testing::ValuesIn(families()),
                         [](const auto& info) { return name(info.param); });

}  // namespace
}  // namespace facetwise::test
