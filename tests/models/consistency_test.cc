// SPDX-License-Identifier: Apache-2.0
// Samples agree with queries, and nothing upsets a lane: every composition.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>

#include "models/compositions.h"
#include "support/counts.h"

namespace facetwise::test {
namespace {

using reference::Vector;

constexpr double kUnit = 0x1p-24;
const std::size_t kLanes = kQuick ? 128 : 2048;

class ModelConsistency : public testing::TestWithParam<Family> {};

// By how much a density and a value change when o moves by a unit, relative, in units: the rounding of a
// direction to floats.
double change(const Composition& c, const Point& point, Vector o) {
  const reference::Surface s = surface_of(c, point);
  const Vector i = incident(point);
  const double pdf = reference::pdf_reflection(s, c.sampler, i, o), value = reference::evaluate_reflection(s, i, o);
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    double of_pdf = 0, of_value = 0;
    for (const double step : {-kUnit, kUnit}) {
      Vector moved = o;
      (k == 0 ? moved.x : k == 1 ? moved.y : moved.z) += step;
      of_pdf = std::max(of_pdf, std::abs(reference::pdf_reflection(s, c.sampler, i, moved) / pdf - 1));
      if (value > 0) of_value = std::max(of_value, std::abs(reference::evaluate_reflection(s, i, moved) / value - 1));
    }
    sum += of_pdf + of_value;
  }
  return sum / kUnit;
}

// The pdf of a sample is that of a query at its direction, and weight times pdf is the value.
TEST_P(ModelConsistency, SamplesAgreeWithQueries) {
  std::uint64_t seed = 1;
  std::vector<double> errors, value_errors;
  double worst = 0, worst_value = 0;
  std::size_t compared = 0, drawn = 0;
  for (const Composition& c : compositions(GetParam(), Operation::sample_reflection)) {
    // Random u throughout: those at its ends draw from the tails, which accuracy_test.cc has.
    std::vector<Point> points = hard_points(c, kLanes, ++seed);
    for (std::size_t n = 0; n < points.size(); ++n) points[n] = with_random(points[n], 1, 7919 * seed + n)[0];
    const std::vector<Result> samples = run_points(Operation::sample_reflection, c, points);
    for (std::size_t n = 0; n < points.size(); ++n) {
      points[n].ox = samples[n].ox;
      points[n].oy = samples[n].oy;
      points[n].oz = samples[n].oz;
    }
    const std::vector<Result> queries = run_points(Operation::evaluate_reflection, c, points);
    for (std::size_t n = 0; n < points.size(); ++n) {
      const Result &sample = samples[n], &query = queries[n];
      if (!accepted(sample)) {
        EXPECT_EQ(sample.pdf, 0) << describe(c) << describe(points[n]);
        EXPECT_EQ(sample.weight, 0) << describe(c) << describe(points[n]);
        continue;
      }
      if (student_t_straight_up(c, points[n])) continue;
      ++drawn;
      const Vector i = incident(points[n]), from = c.model.retro ? turned(i) : i, o = outgoing(points[n]);
      // The rim of what microfacets reach, and half vectors that are nothing but rounding.
      if (from.z + o.z <= 4 * kUnit || o.z <= 4 * kUnit) continue;
      if (std::hypot(from.x + o.x, from.y + o.y, from.z + o.z) < 1e-3) continue;
      if (sample.pdf < 1e-15 || sample.pdf > 1e30) continue;
      // The reference's quadrature takes long there, and an emulator a second.
      if (weighs_behind(c.model, points[n]) && (kQuick || n % 16 != 0)) continue;
      const Vector m = unit({from.x + o.x, from.y + o.y, from.z + o.z});
      const HalfVector half = half_vector(c, points[n], from, m);
      const double moves = change(c, points[n], o) * (1 + half.turn) + half.im;
      if (!(moves * kUnit <= 0.01)) continue;
      ++compared;
      const double error = std::abs(query.pdf / sample.pdf - 1) / kUnit;
      errors.push_back(error);
      worst = std::max(worst, (error - 32) / (moves + 1));
      EXPECT_LE(error, 64 + 24 * moves) << "pdf " << sample.pdf << ", query " << query.pdf << ": " << describe(c)
                                        << describe(points[n]);
      if (sample.weight == 0 || query.value == 0) {
        EXPECT_LE(std::max(sample.weight * sample.pdf, query.value), 1e-20) << describe(c) << describe(points[n]);
        continue;
      }
      const double value_error = std::abs(query.value / (static_cast<double>(sample.weight) * query.pdf) - 1) / kUnit;
      value_errors.push_back(value_error);
      worst_value = std::max(worst_value, value_error / (64 + 8 / o.z + 24 * moves));
      EXPECT_LE(value_error, 64 + 8 / o.z + 24 * moves)
          << "weight " << sample.weight << ", value " << query.value << ", pdf " << query.pdf << ": " << describe(c)
          << describe(points[n]);
      if (HasFailure()) return;
    }
  }
  const auto median = [](std::vector<double>& all) {
    if (all.empty()) return 0.0;
    std::nth_element(all.begin(), all.begin() + all.size() / 2, all.end());
    return all[all.size() / 2];
  };
  std::printf(
      "%-22s %zu of %zu samples: pdf's median %.2f units, beyond at most %.2f of o's rounding; value's "
      "median %.2f\n",
      name(GetParam()).c_str(), compared, drawn, median(errors), worst, median(value_errors));
  EXPECT_GT(compared, drawn / 4);
}

// Normals: the density of a normal is that of the reference, and the reflection's is a quarter of it over
// i.m.
TEST_P(ModelConsistency, NormalsHaveTheirDensity) {
  std::uint64_t seed = 500;
  std::size_t compared = 0, drawn = 0;
  for (const Sampler sampler : samplers_of(GetParam(), Operation::sample_normal)) {
    const Composition c = plain(GetParam(), sampler);
    std::vector<Point> points;
    for (const Point& calm : calm_points(c))
      for (const Point& p : with_random(calm, kLanes / 8, ++seed)) points.push_back(p);
    const std::vector<Result> normals = run_points(Operation::sample_normal, c, points);
    for (std::size_t n = 0; n < points.size(); ++n) {
      const Result& r = normals[n];
      if (!accepted(r)) continue;
      if (student_t_straight_up(c, points[n])) continue;
      ++drawn;
      if (HasFailure()) return;
      const Vector m = {r.mx, r.my, r.mz};
      EXPECT_NEAR(dot(m, m), 1, 1e-6);
      const Vector i = incident(points[n]);
      const reference::Surface s = surface_of(c, points[n]);
      const HalfVector half = half_vector(c, points[n], i, m);
      EXPECT_NEAR(r.im, dot(i, m), 16 * kUnit * (1 + half.turn)) << describe(c) << describe(points[n]);
      const double pdf = reference::pdf_normal(s, sampler, i, m);
      double moves = 0;
      for (const Vector& step : {Vector{kUnit, 0, 0}, Vector{0, kUnit, 0}, Vector{0, 0, kUnit}})
        moves += std::abs(reference::pdf_normal(s, sampler, i, {m.x + step.x, m.y + step.y, m.z + step.z}) / pdf - 1) /
                 kUnit;
      moves = moves * (1 + half.turn) + half.im;
      if (!(moves * kUnit < 0.01)) continue;
      ++compared;
      EXPECT_LE(std::abs(r.pdf / pdf - 1) / kUnit, 64 + 24 * moves) << describe(c) << describe(points[n]);
    }
  }
  EXPECT_GT(compared, drawn / 2);
}

// ---- Trouble ----

// `exact` of Beckmann from straight below, whose weight is NaN: StraightBelow tests that.
bool beckmann_straight_below(const Composition& c, const Point& p) {
  return c.model.distribution == Distribution::beckmann && c.model.masking == Masking::smith &&
         c.sampler == Sampler::exact && p.iz < 0 && std::hypot(p.alpha_x * p.ix, p.alpha_y * p.iy) < 1e-7f;
}

bool all_zero(const Result& r) {
  for (const float f :
       {r.ox, r.oy, r.oz, r.mx, r.my, r.mz, r.im, r.pdf, r.weight, r.value, r.masking, r.area, r.branch})
    if (f != 0) return false;
  return true;
}

bool finite(std::initializer_list<float> values) {
  return std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); });
}

// Directions that go nowhere are OccludedDirectionsAreFinite's.
bool sane(const Result& r) {
  if (!finite({r.mx, r.my, r.mz, r.im, r.pdf, r.weight, r.value, r.masking, r.area, r.branch, r.eta_scale}))
    return false;
  if (r.status != static_cast<int>(LaneStatus::occluded) && !finite({r.ox, r.oy, r.oz})) return false;
  return r.pdf >= 0 && r.weight >= 0 && r.value >= 0 && r.masking >= 0 && r.masking <= 1.00001f && r.area >= 0 &&
         r.branch >= 0 && r.branch <= 1 && r.status <= 3;
}

// Ordinary points at the ends of everything.
std::vector<Point> adversarial(const Composition& c, std::size_t count, std::uint64_t seed) {
  std::vector<Point> points = hard_points(c, count, seed, true);
  constexpr float kBelowOne = 1 - 0x1p-24f;
  for (std::size_t n = 0; n < count; ++n) {
    Point& p = points[n];
    switch (n % 16) {
      case 0: p.ix = 1, p.iy = 0, p.iz = 0; break;
      case 1: p.ix = p.iy = 0, p.iz = 1; break;
      case 2: p.ix = p.iy = 0, p.iz = -1; break;
      case 3: p.ix = 0, p.iy = -1, p.iz = 1e-30f; break;
      case 4: p.ix = 0.6f, p.iy = 0.8f, p.iz = -1e-30f; break;
      case 5: p.ix = 0.6f, p.iy = -0.8f, p.iz = -0.0f; break;
      case 6: p.u1 = 0, p.u2 = 0, p.u3 = kBelowOne; break;
      case 7: p.u1 = kBelowOne, p.u2 = 0.25f, p.u3 = 0; break;
      case 8: p.u2 = kBelowOne, p.u1 = 1e-30f; break;
      case 9: p.ox = -p.ix, p.oy = -p.iy, p.oz = -p.iz; break;
      case 10: p.ox = p.ix, p.oy = p.iy, p.oz = p.iz; break;
      case 11: p.ox = 1, p.oy = 0, p.oz = 1e-30f; break;
      case 12: p.ox = 0, p.oy = 0, p.oz = 1; break;
      default: break;
    }
    if (n % 5 == 0) p.alpha_x = 1e-4f;
    if (n % 7 == 0 && !c.affine) p.alpha_y = c.model.distribution == Distribution::phong ? 1 : 10;
    if (n % 11 == 0) p.alpha_y = 1e-4f;
  }
  return points;
}

// Any bit pattern, or an awkward value, in some of the inputs of some of the lanes.
std::vector<Point> corrupted(std::vector<Point> points, std::uint64_t seed) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  constexpr float kBad[] = {kNan,    -kNan, kInf, -kInf,   -0.0f,    0.0f,  1e-40f, 5e-5f,
                            10.001f, 1,     -1,   1.0005f, 0x1p100f, -0.1f, 200};
  std::mt19937_64 random(seed);
  for (std::size_t n = 0; n < points.size(); ++n) {
    // Whole stretches stay as they are, so that vectors without exceptions occur too.
    if ((n / 64) % 2 == 0 || random() % 4 != 0) continue;
    auto* in = reinterpret_cast<float*>(&points[n]);
    const std::uint64_t bits = random();
    in[bits % kPointFloats] = bits & (1 << 20) ? std::bit_cast<float>(static_cast<std::uint32_t>(bits >> 32))
                                               : kBad[(bits >> 32) % std::size(kBad)];
  }
  return points;
}

std::vector<Operation> operations() {
  return {Operation::sample_normal,     Operation::sample_reflection,   Operation::evaluate_reflection,
          Operation::masking,           Operation::sample_transmission, Operation::evaluate_transmission,
          Operation::sample_scattering, Operation::evaluate_scattering};
}

std::vector<Composition> all_compositions(const Family& family, Operation operation) {
  if (operation == Operation::masking) return {plain(family, Sampler::visible)};
  return compositions(family, operation);
}

TEST_P(ModelConsistency, NothingIsNanNegativeOrInfinite) {
  std::uint64_t seed = 2000;
  for (const Operation operation : operations())
    for (const Composition& c : all_compositions(GetParam(), operation)) {
      const std::vector<Point> points = adversarial(c, kLanes / 2, ++seed);
      const std::vector<Result> results = run_points(operation, c, points);
      for (std::size_t n = 0; n < points.size(); ++n) {
        const Result& r = results[n];
        if (beckmann_straight_below(c, points[n])) continue;
        ASSERT_TRUE(sane(r)) << name(operation) << " " << describe(c) << describe(points[n]) << " pdf " << r.pdf
                             << " weight " << r.weight << " value " << r.value << " masking " << r.masking << " area "
                             << r.area << " o " << r.ox << " " << r.oy << " " << r.oz << " status " << int{r.status};
        // Correlation can make a principal roughness too large.
        ASSERT_TRUE(r.status != static_cast<int>(LaneStatus::invalid) || GetParam().affine)
            << name(operation) << " " << describe(c) << describe(points[n]);
        if (operation == Operation::sample_reflection && accepted(r)) {
          ASSERT_GT(r.oz, 0) << describe(c) << describe(points[n]);
        }
        if (!accepted(r)) {
          ASSERT_EQ(r.value, 0) << name(operation) << " " << describe(c) << describe(points[n]);
          if (operation != Operation::masking) {
            ASSERT_EQ(r.pdf, 0) << name(operation) << " " << describe(c) << describe(points[n]);
          }
        }
      }
    }
}

TEST_P(ModelConsistency, BadLanesAreZeroAndDisturbNoOther) {
  std::uint64_t seed = 3000;
  for (const Operation operation : operations())
    for (const Composition& c : all_compositions(GetParam(), operation)) {
      const std::vector<Point> points = adversarial(c, std::max<std::size_t>(kLanes / 4, 256) + 3, ++seed),
                               bad = corrupted(points, seed);
      const std::vector<Result> good = run_points(operation, c, points), results = run_points(operation, c, bad);
      std::size_t invalid = 0;
      for (std::size_t n = 0; n < points.size(); ++n) {
        if (std::memcmp(&points[n], &bad[n], sizeof(Point)) == 0) {
          ASSERT_EQ(std::memcmp(&good[n], &results[n], sizeof(Result)), 0)
              << name(operation) << " " << describe(c) << describe(points[n]) << " beside a bad lane";
          continue;
        }
        if (beckmann_straight_below(c, bad[n])) continue;
        ASSERT_TRUE(sane(results[n])) << name(operation) << " " << describe(c) << describe(bad[n]);
        if (results[n].status != static_cast<int>(LaneStatus::invalid)) continue;
        ++invalid;
        ASSERT_TRUE(all_zero(results[n])) << name(operation) << " " << describe(c) << describe(bad[n]);
      }
      ASSERT_GT(invalid, 0u) << name(operation) << " " << describe(c);
    }
}

// A reflection is of unit length: it can be asked about.
TEST_P(ModelConsistency, ReflectionsAreOfUnitLength) {
  std::uint64_t seed = 2500;
  for (const Sampler sampler : samplers_of(GetParam(), Operation::sample_reflection)) {
    const Composition c = plain(GetParam(), sampler);
    std::vector<Point> points = hard_points(c, 16 * kLanes, ++seed);
    for (std::size_t n = 0; n < points.size(); ++n) points[n] = with_random(points[n], 1, 7919 * seed + n)[0];
    const std::vector<Result> results = run_points(Operation::sample_reflection, c, points);
    for (std::size_t n = 0; n < points.size(); ++n) {
      const Result& r = results[n];
      if (!accepted(r) || student_t_straight_up(c, points[n])) continue;
      ASSERT_NEAR(r.ox * r.ox + r.oy * r.oy + r.oz * r.oz, 1, 1e-4) << describe(c) << describe(points[n]);
    }
  }
}

TEST_P(ModelConsistency, ReflectionsAreOfUnitLengthAtTheEndsOfU) {
  std::uint64_t seed = 2600;
  for (const Sampler sampler : samplers_of(GetParam(), Operation::sample_reflection)) {
    const Composition c = plain(GetParam(), sampler);
    const std::vector<Point> points = adversarial(c, 16 * kLanes, ++seed);
    const std::vector<Result> results = run_points(Operation::sample_reflection, c, points);
    for (std::size_t n = 0; n < points.size(); ++n) {
      const Result& r = results[n];
      if (!accepted(r) || student_t_straight_up(c, points[n])) continue;
      ASSERT_NEAR(r.ox * r.ox + r.oy * r.oy + r.oz * r.oz, 1, 2.5e-3) << describe(c) << describe(points[n]);
    }
  }
}

TEST_P(ModelConsistency, OccludedDirectionsAreFinite) {
  std::uint64_t seed = 2700;
  for (const Operation operation :
       {Operation::sample_reflection, Operation::sample_transmission, Operation::sample_scattering})
    for (const Sampler sampler : samplers_of(GetParam(), operation)) {
      Composition c = plain(GetParam(), sampler);
      if (operation != Operation::sample_reflection) c.model.interface = Interface::dielectric;
      const std::vector<Point> points = adversarial(c, kLanes, ++seed);
      const std::vector<Result> results = run_points(operation, c, points);
      for (std::size_t n = 0; n < points.size(); ++n)
        ASSERT_TRUE(finite({results[n].ox, results[n].oy, results[n].oz}))
            << name(operation) << " " << describe(c) << describe(points[n]);
    }
}

// Each way in which a lane can be bad, one at a time.
TEST_P(ModelConsistency, EveryBadInputIsInvalid) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  struct Bad {
    float Point::*member;
    std::vector<float> values;
  };
  const std::vector<Bad> bads = {
      {&Point::ix, {kNan, kInf, 2, -1.5f}},
      {&Point::iz, {kNan, -kInf, 0x1p80f}},
      {&Point::alpha_x, {-1e-40f, -0.5f, 10.01f, kNan, kInf}},
      {&Point::alpha_y, {-0x1p-100f, -1e-3f, 11, kNan, -kInf}},
      {&Point::mean_x, {kNan, kInf, 1e30f, 151}},
      {&Point::mean_y, {kNan, -kInf, -151}},
      {&Point::correlation, {1, -1, 1.5f, kNan, kInf}},
      {&Point::eta, {0, 0.0099f, 100.1f, -1.5f, kNan, kInf}},
      {&Point::f0, {-0.01f, 1.01f, kNan}},
      {&Point::f90, {-0.01f, 1.01f, kInf}},
      {&Point::ox, {kNan, kInf, 2}},
      {&Point::oz, {kNan, 3}},
      {&Point::u1, {1, -0x1p-24f, kNan, kInf}},
      {&Point::u2, {1, -1, kNan}},
      {&Point::u3, {1, -1, kNan}},
  };
  for (const Operation operation : operations())
    for (const Composition& c : all_compositions(GetParam(), operation)) {
      Result unused;
      const Point ordinary;
      const Batch batch = make_batch(operation, c, {&ordinary, 1}, {&unused, 1});
      // The columns that the call reads.
      const auto reads = [&](float Point::*member) {
        const float* address = &(ordinary.*member);
        Batch copy = batch;
        for (const InputField& field : input_fields())
          if (field.column(copy).present() && field.column(copy).data() == address) return true;
        return false;
      };
      std::vector<Point> points;
      for (const Bad& bad : bads) {
        if (!reads(bad.member)) continue;
        for (const float value : bad.values) {
          points.push_back(ordinary);
          points.back().*bad.member = value;
        }
      }
      const std::vector<Result> results = run_points(operation, c, points);
      for (std::size_t n = 0; n < points.size(); ++n) {
        ASSERT_EQ(results[n].status, static_cast<int>(LaneStatus::invalid))
            << name(operation) << " " << describe(c) << describe(points[n]);
        ASSERT_TRUE(all_zero(results[n])) << name(operation) << " " << describe(c) << describe(points[n]);
      }
    }
}

// How scene files write a mirror: either axis, either sign.
TEST_P(ModelConsistency, ZeroRoughnessIsSmooth) {
  for (const Operation operation : operations())
    for (const Composition& c : all_compositions(GetParam(), operation)) {
      std::vector<Point> points(5);
      points[0].alpha_x = 0;
      points[1].alpha_y = -0.0f;
      points[2].alpha_x = points[2].alpha_y = 0;
      points[3].alpha_x = -0.0f, points[3].alpha_y = 0.7f, points[3].correlation = 0.5f;
      points[4].alpha_x = points[4].alpha_y = 5e-5f;  // what was smooth all along
      points[4].mean_x = points[4].mean_y = 0;
      const std::vector<Result> results = run_points(operation, c, points);
      for (std::size_t n = 0; n < points.size(); ++n)
        ASSERT_EQ(results[n].status, static_cast<int>(LaneStatus::smooth))
            << name(operation) << " " << describe(c) << describe(points[n]);
      // A mirror is one mirror.
      EXPECT_EQ(results[2].oz, results[4].oz);
      EXPECT_EQ(results[2].weight, results[4].weight);
      EXPECT_EQ(results[2].pdf, results[4].pdf);
    }
}

TEST_P(ModelConsistency, LongMeanSlopesAreInvalid) {
  if (!GetParam().affine) return;
  const Composition c = plain(GetParam(), Sampler::visible);
  std::vector<Point> points(4);
  points[0].mean_x = 100.5f;
  points[1].mean_y = -120;
  points[2].mean_x = points[2].mean_y = 80;
  points[3].mean_x = 100;
  const std::vector<Result> results = run_points(Operation::masking, c, points);
  for (int n = 0; n < 2; ++n) EXPECT_EQ(results[n].status, static_cast<int>(LaneStatus::invalid)) << n;
  EXPECT_EQ(results[2].status, static_cast<int>(LaneStatus::accepted));
  EXPECT_EQ(results[3].status, static_cast<int>(LaneStatus::accepted));
}

// Without the directions that OccludedDirectionsAreFinite is about: NaN have a sign.
std::vector<Result> comparable(std::vector<Result> results) {
  for (Result& r : results)
    if (!finite({r.ox, r.oy, r.oz}) && r.status == static_cast<int>(LaneStatus::occluded)) r.ox = r.oy = r.oz = 0;
  return results;
}

// Full vectors, one lane and every target of this machine.
TEST_P(ModelConsistency, SameBitsOnEveryTarget) {
  std::uint64_t seed = 4000;
  for (const Operation operation : operations())
    for (const Composition& c : all_compositions(GetParam(), operation)) {
      ++seed;
      const std::vector<Point> points = corrupted(adversarial(c, kLanes / 8 + 5, seed), seed);
      const std::vector<Result> best = comparable(run_points(operation, c, points));
      for (const Target target : available_targets())
        for (const bool one_lane : {false, true}) {
          const std::vector<Result> other = comparable(
              run_points(operation, c, points, {.target = target, .one_lane = one_lane, .threads = Threads::one}));
          for (std::size_t n = 0; n < points.size(); ++n)
            ASSERT_EQ(std::memcmp(&best[n], &other[n], sizeof(Result)), 0)
                << name(operation) << " " << describe(c) << name(target) << (one_lane ? " one lane" : "") << ": "
                << describe(points[n]);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Families, ModelConsistency, testing::ValuesIn(families()),
                         [](const auto& info) { return name(info.param); });

TEST(ModelStraightBelow, WeightsAreFinite) {
  for (const Family& family : families())
    for (const Sampler sampler : samplers_of(family, Operation::sample_reflection)) {
      const Composition c = plain(family, sampler);
      const std::vector<Point> points = with_random({.iz = -1}, 4096, 9);
      for (const Result& r : run_points(Operation::sample_reflection, c, points)) ASSERT_TRUE(sane(r)) << describe(c);
    }
}

// Visible normals of Student-t from straight above, where m_z is i.m.
TEST(ModelStraightUp, IncidentDotNormalIsMz) {
  for (const Family& family : families())
    for (const Sampler sampler : samplers_of(family, Operation::sample_normal)) {
      const Composition c = plain(family, sampler);
      for (const float alpha : {0.01f, 0.5f}) {
        const std::vector<Point> points = with_random({.alpha_x = alpha, .alpha_y = alpha}, 4096, 9);
        for (const Result& r : run_points(Operation::sample_normal, c, points))
          if (accepted(r)) {
            ASSERT_NEAR(r.im, r.mz, 1e-6) << describe(c) << describe(points[0]);
          }
      }
    }
}

}  // namespace
}  // namespace facetwise::test
