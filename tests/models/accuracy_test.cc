// SPDX-License-Identifier: Apache-2.0
// Densities, values and projected areas of every composition against the double-precision reference.
//
// Errors are relative, in units of 2^-24. The reference is evaluated at the kernels' own float inputs. What
// is left is rounding inside the kernel, which the answer's conditioning magnifies: an error above `floor`
// may be at most `factor` times what the reference itself changes by when each of its inputs is moved by one
// unit of the larger of itself and the vector it belongs to (i + o rounds to that).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "models/compositions.h"
#include "support/counts.h"

namespace facetwise::test {
namespace {

using reference::Surface;
using reference::Vector;

constexpr double kUnit = 0x1p-24;
// Below this, parts of an answer leave the floats' normal range, and its digits are lost: Student-t has sixth
// powers.
double smallest(const Composition& c) { return c.model.distribution == Distribution::student_t ? 1e-15 : 1e-24; }

constexpr double kFloor = 64, kFactor = 4;

using Truth = double (*)(const Composition&, const double (&)[kPointFloats]);

// The members of Point as doubles, so that they can be moved by less than a float's spacing.
enum Slot { kIx, kIy, kIz, kAlphaX, kAlphaY, kMeanX, kMeanY, kCorrelation, kEta, kF0, kF90, kOx, kOy, kOz, kSlots };

Surface surface_at(const Composition& c, const double (&v)[kPointFloats]) {
  Surface s = surface_of(c, Point{});
  s.alpha = {v[kAlphaX], v[kAlphaY]};
  if (c.affine) {
    if (!c.model.retro) s.mean_slope_x = v[kMeanX], s.mean_slope_y = v[kMeanY];
    s.slope_correlation = v[kCorrelation];
  }
  s.eta = v[kEta];
  s.f0 = v[kF0];
  s.f90 = v[kF90];
  return s;
}
Vector i_at(const double (&v)[kPointFloats]) { return {v[kIx], v[kIy], v[kIz]}; }
Vector o_at(const double (&v)[kPointFloats]) { return {v[kOx], v[kOy], v[kOz]}; }

// By how much the truth changes when the inputs move, in units, relative.
double sensitivity(Truth truth, const Composition& c, const double (&at)[kPointFloats], double here) {
  double sum = 0;
  for (int k = 0; k < kSlots; ++k) {
    double largest = 0;
    for (const double sign : {-1.0, 1.0}) {
      double moved[kPointFloats];
      std::copy(std::begin(at), std::end(at), moved);
      // A component that is small beside the vector's length is rounded with i + o.
      const bool vector = k == kIx || k == kIy || k == kOx || k == kOy || k == kMeanX || k == kMeanY;
      moved[k] += sign * kUnit * std::max(std::abs(at[k]), vector ? 0.25 : 0.0);
      largest = std::max(largest, std::abs(truth(c, moved) - here));
    }
    sum += largest;
  }
  return sum / std::abs(here) / kUnit;
}

struct Row {
  std::vector<double> errors;
  double worst_ratio = 0;
  std::size_t unexplained = 0;
};

void compare(Row& row, const char* what, Truth truth, const Composition& c, const Point& point, float got, double floor,
             double factor) {
  // What densities are divided by is a quadrature there: HitsOfPhong.
  const bool divided =
      std::string_view(what).find("pdf") == std::string_view::npos || c.model.normalisation == Normalisation::biased;
  if (divided && weighs_behind(c.model, point)) return;
  // o = -i to the last bits has no half vector.
  const Vector i = incident(point), from = c.model.retro ? turned(i) : i, o = outgoing(point);
  if (std::hypot(from.x + o.x, from.y + o.y, from.z + o.z) < 0x1.001p-20) return;
  double at[kPointFloats];
  const auto* in = reinterpret_cast<const float*>(&point);
  std::copy(in, in + kPointFloats, at);
  const double expected = truth(c, at);
  if (!std::isfinite(got) || got < 0) {
    ADD_FAILURE() << what << " is " << got << ", not " << expected << ": " << describe(c) << describe(point);
    return;
  }
  if (expected < smallest(c)) {
    EXPECT_LE(got, 2 * smallest(c)) << what << ": " << describe(c) << describe(point);
    return;
  }
  if (expected > 1e37) return;  // the kernels keep to finite floats
  const double error = std::abs(got / expected - 1) / kUnit;
  row.errors.push_back(error);
  // Its conditional shares of slopes are differences of error functions.
  if (c.model.distribution == Distribution::beckmann && c.sampler == Sampler::exact) floor *= 4;
  if (error <= floor) return;
  const double moves = sensitivity(truth, c, at, expected);
  if (moves * kUnit > 0.02) return;  // beyond the first order, rounding leaves few digits
  const double ratio = (error - floor) / moves;
  row.worst_ratio = std::max(row.worst_ratio, ratio);
  if (ratio <= factor) return;
  if (++row.unexplained <= 3)
    ADD_FAILURE() << what << " is " << got << ", not " << expected << ": off by " << error
                  << " units, the inputs' rounding is " << moves << ": " << describe(c) << describe(point);
}

void finish(const Family& family, const char* what, Row& row) {
  if (row.errors.empty()) return;
  const auto at = [&](double share) {
    const auto place = row.errors.begin() + static_cast<std::ptrdiff_t>(share * (row.errors.size() - 1));
    std::nth_element(row.errors.begin(), place, row.errors.end());
    return *place;
  };
  const double median = at(0.5);
  std::printf(
      "%-22s %-16s %8zu lanes: median %.2f, 99 %% %.1f units of 2^-24; beyond the floor at most %.2f of "
      "rounding\n",
      name(family).c_str(), what, row.errors.size(), median, at(0.99), row.worst_ratio);
  EXPECT_LE(median, kQuick ? 16 : 8) << what;
  EXPECT_EQ(row.unexplained, 0u) << what;
}

class ModelAccuracy : public testing::TestWithParam<Family> {};

std::size_t points_each() { return kQuick ? 32 : 1000; }

TEST_P(ModelAccuracy, DensitiesOfReflections) {
  Row row;
  std::uint64_t seed = 1;
  for (const Composition& c : compositions(GetParam(), Operation::pdf_reflection)) {
    if (c.model.shadowing != Shadowing::correlated) continue;
    const std::vector<Point> points = hard_points(c, 4 * points_each(), ++seed);
    const std::vector<Result> results = run_points(Operation::pdf_reflection, c, points);
    const Truth truth = [](const Composition& c, const double(&v)[kPointFloats]) {
      return reference::pdf_reflection(surface_at(c, v), c.sampler, i_at(v), o_at(v));
    };
    for (std::size_t n = 0; n < points.size(); ++n)
      compare(row, "pdf", truth, c, points[n], results[n].pdf, kFloor, kFactor);
  }
  finish(GetParam(), "pdf", row);
}

TEST_P(ModelAccuracy, Values) {
  Row row;
  std::uint64_t seed = 1000;
  for (const Composition& c : compositions(GetParam(), Operation::evaluate_reflection)) {
    if (c.sampler != Sampler::visible) continue;  // values know no sampler
    const std::vector<Point> points = hard_points(c, 2 * points_each(), ++seed);
    const std::vector<Result> results = run_points(Operation::evaluate_reflection, c, points);
    const Truth truth = [](const Composition& c, const double(&v)[kPointFloats]) {
      return reference::evaluate_reflection(surface_at(c, v), i_at(v), o_at(v));
    };
    for (std::size_t n = 0; n < points.size(); ++n)
      compare(row, "value", truth, c, points[n], results[n].value, kFloor, kFactor);
  }
  finish(GetParam(), "value", row);
}

// What the bounds notice: a roughness that is 2e-5 larger.
TEST_P(ModelAccuracy, AWrongRoughnessIsNoticed) {
  const Composition c = plain(GetParam(), Sampler::visible);
  const std::vector<Point> points = hard_points(c, 4 * points_each(), 99);
  std::vector<Point> rougher = points;
  for (Point& p : rougher) p.alpha_x *= 1.00002f;
  const std::vector<Result> results = run_points(Operation::evaluate_reflection, c, rougher);
  const Truth truth = [](const Composition& c, const double(&v)[kPointFloats]) {
    return reference::evaluate_reflection(surface_at(c, v), i_at(v), o_at(v));
  };
  std::size_t noticed = 0, compared = 0;
  for (std::size_t n = 0; n < points.size(); ++n) {
    if (weighs_behind(c.model, points[n])) continue;  // HitsOfPhong has those
    double at[kPointFloats];
    const auto* in = reinterpret_cast<const float*>(&points[n]);
    std::copy(in, in + kPointFloats, at);
    const double expected = truth(c, at);
    if (expected < smallest(c) || expected > 1e37) continue;
    ++compared;
    const double error = std::abs(results[n].value / expected - 1) / kUnit;
    noticed += error > kFloor + kFactor * sensitivity(truth, c, at, expected);
  }
  EXPECT_GT(noticed, compared / 4);
}

TEST_P(ModelAccuracy, Scattering) {
  for (const bool forced : {false, true}) {
    const Operation operation = forced ? Operation::evaluate_transmission : Operation::evaluate_scattering;
    Row pdfs, values;
    std::uint64_t seed = 3000;
    for (Composition c : compositions(GetParam(), operation)) {
      if (++seed % 2 == 0) c.model.transport = Transport::importance;
      const std::vector<Point> points = scattering_points(c, points_each(), seed);
      const std::vector<Result> results = run_points(operation, c, points);
      const Truth pdf = [](const Composition& c, const double(&v)[kPointFloats]) {
        return reference::pdf_scattering(surface_at(c, v), c.sampler, i_at(v), o_at(v));
      };
      const Truth forced_pdf = [](const Composition& c, const double(&v)[kPointFloats]) {
        return reference::pdf_transmission(surface_at(c, v), c.sampler, i_at(v), o_at(v));
      };
      const Truth value = [](const Composition& c, const double(&v)[kPointFloats]) {
        return reference::evaluate_scattering(surface_at(c, v), i_at(v), o_at(v));
      };
      const Truth forced_value = [](const Composition& c, const double(&v)[kPointFloats]) {
        return reference::evaluate_transmission(surface_at(c, v), i_at(v), o_at(v));
      };
      for (std::size_t n = 0; n < points.size(); ++n) {
        compare(pdfs, forced ? "forced pdf" : "scattering pdf", forced ? forced_pdf : pdf, c, points[n], results[n].pdf,
                kFloor, 4 * kFactor);
        compare(values, forced ? "forced value" : "scattering value", forced ? forced_value : value, c, points[n],
                results[n].value, kFloor, 4 * kFactor);
      }
    }
    finish(GetParam(), forced ? "forced pdf" : "scattering pdf", pdfs);
    finish(GetParam(), forced ? "forced value" : "scattering value", values);
  }
}

TEST_P(ModelAccuracy, AreaAndMasking) {
  Row areas, maskings;
  const Composition c = plain(GetParam(), Sampler::visible);
  const std::vector<Point> points = hard_points(c, 16 * points_each(), 7);
  const std::vector<Result> results = run_points(Operation::masking, c, points);
  const Truth area = [](const Composition& c, const double(&v)[kPointFloats]) {
    return reference::normaliser(surface_at(c, v), i_at(v));
  };
  const Truth masking = [](const Composition& c, const double(&v)[kPointFloats]) {
    return reference::masking(surface_at(c, v), i_at(v));
  };
  for (std::size_t n = 0; n < points.size(); ++n) {
    compare(areas, "projected area", area, c, points[n], results[n].area, kFloor, kFactor);
    // V-cavity masking is of a normal, and has no output.
    if (c.model.masking == Masking::vcavity) {
      EXPECT_EQ(results[n].masking, 0);
    } else {
      compare(maskings, "masking", masking, c, points[n], results[n].masking, kFloor, kFactor);
    }
  }
  finish(GetParam(), "projected area", areas);
  finish(GetParam(), "masking", maskings);
}

// Phong's share of rays that hit, by V-cavity from behind, and the values that it divides.
TEST(HitsOfPhong, AreWithinTheStatedError) {
  const Composition c = plain({Distribution::phong, Masking::vcavity, false}, Sampler::visible);
  std::vector<Point> points = hard_points(c, kQuick ? 64 : 600, 5);
  std::erase_if(points, [](const Point& p) { return !(p.iz < 0); });
  const std::vector<Result> areas = run_points(Operation::masking, c, points),
                            values = run_points(Operation::evaluate_reflection, c, points);
  double worst = 0, worst_isotropic = 0;
  std::size_t compared = 0;
  for (std::size_t n = 0; n < points.size(); ++n) {
    const Point& p = points[n];
    const double area = reference::normaliser(surface_of(c, p), incident(p)), hits = area / -p.iz;
    const double value = reference::evaluate_reflection(surface_of(c, p), incident(p), outgoing(p));
    EXPECT_TRUE(std::isfinite(values[n].value) && values[n].value >= 0) << describe(p);
    if (hits < 1e-30) continue;
    const double error = std::abs(areas[n].area / area - 1);
    if (hits > 1e-3) worst = std::max(worst, error);
    if (p.alpha_x == p.alpha_y) worst_isotropic = std::max(worst_isotropic, error);
    if (hits > 1e-3 && value > 1e-6 && value < 1e30 && p.oz > 1e-3f) {
      ++compared;
      EXPECT_NEAR(values[n].value / value, 1, 2e-3) << describe(p);
    }
  }
  std::printf(
      "phong-vcavity behind: H within %.2g where it is above 1e-3, within %.2g of isotropic roughness; %zu values\n",
      worst, worst_isotropic, compared);
  EXPECT_LT(worst, 1e-4);
  EXPECT_LT(worst_isotropic, 1e-3);
  EXPECT_GT(compared, kQuick ? 2u : 20u);
}

INSTANTIATE_TEST_SUITE_P(Families, ModelAccuracy, testing::ValuesIn(families()),
                         [](const auto& info) { return name(info.param); });

}  // namespace
}  // namespace facetwise::test
