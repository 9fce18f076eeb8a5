// SPDX-License-Identifier: Apache-2.0
// The kernels against the double-precision reference, lane by lane, for every operation.
//
// Errors are in units of 2^-24: of directions and cosines absolute, of the rest relative. Most lanes are
// within a few units. An error above `floor` must be explained: it may be at most `factor` times what
// rounding explains:
//   - what the reference itself changes by when each of its inputs is moved by one unit;
//   - for samplers that form a half vector (cap, bounded), a sum i_hat + o_hat that is rounded to one unit.
//   It is
//     short where o is nearly -i, and a stretch by alpha_x, alpha_y can enlarge what is lost. The kernels
//     take i.m from it as a scalar product, so that o keeps its length: that loses (1 / |i_hat + o_hat|)^2
//     units, relative, and the density with it. Nothing is left of the density where this is 2^24, in about
//     one sample in 10^7;
//   - for the weight, o_z rounded to one unit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "facetwise/engine.h"
#include "facetwise/reference.h"
#include "support/counts.h"
#include "support/lanes.h"

namespace facetwise::test {
namespace {

using reference::Roughness;
using reference::Vector;

constexpr double kUnit = 0x1p-24;

// What is compared.
enum Quantity { kO, kM, kIm, kPdf, kWeight, kValue, kMasking, kArea, kShare, kQuantities };
constexpr const char* kNames[] = {
    "o", "m", "i.m", "pdf", "weight", "value", "masking", "projected area", "share unoccluded"};

struct Answer {
  Vector vector[2];            // o, m
  double scalar[kQuantities];  // the rest
  LaneStatus status = LaneStatus::accepted;
};

double difference(Quantity quantity, const Answer& a, const Answer& truth) {
  if (quantity == kO || quantity == kM) {
    const Vector &x = a.vector[quantity], &y = truth.vector[quantity];
    return std::hypot(x.x - y.x, x.y - y.y, x.z - y.z) / kUnit;
  }
  const double error = std::abs(a.scalar[quantity] - truth.scalar[quantity]) / kUnit;
  if (quantity == kIm || error == 0) return error;
  return error / std::abs(truth.scalar[quantity]);
}

using Truth = std::function<Answer(const Lane&)>;

// By how much each quantity can change when each input moves by one unit: relative, of u2 and u3 absolute.
void sensitivity(const Truth& truth, const Lane& lane, const Answer& here, double (&sum)[kQuantities]) {
  std::fill(std::begin(sum), std::end(sum), 0.0);
  for (int k = 0; k < kInputs; ++k) {
    double largest[kQuantities] = {};
    for (double sign : {-1.0, 1.0}) {
      Lane moved = lane;
      moved[k] += sign * kUnit * (k == kU2 || k == kU3 ? 1 : std::abs(lane[k]));
      if (k == kU1 || k == kU3) moved[k] = std::clamp(moved[k], 0.0, 1 - kUnit / 4);
      const Answer there = truth(moved);
      if (there.status != here.status) continue;
      for (int q = 0; q < kQuantities; ++q)
        largest[q] = std::max(largest[q], difference(static_cast<Quantity>(q), there, here));
    }
    for (int q = 0; q < kQuantities; ++q) sum[q] += largest[q];
  }
}

// Of the rounded sum of unit vectors i_hat + o_hat, in units.
struct HalfVectorRounding {
  double turn;  // of m
  double im;    // of i.m, relative
};

HalfVectorRounding half_vector_rounding(const Lane& lane, Vector m) {
  const double ax = lane[kAlphaX], ay = lane[kAlphaY];
  const double nu = std::hypot(ax * lane[kIx], ay * lane[kIy], lane[kIz]);
  const Vector stretched = {m.x / ax, m.y / ay, m.z};
  const double length = std::hypot(stretched.x, stretched.y, stretched.z);
  // |i_hat + o_hat| = 2 i_hat.m_hat; i_hat.m_hat = i.m / (nu |m / alpha|).
  const double half = 2 * (lane[kIx] * m.x + lane[kIy] * m.y + lane[kIz] * m.z) / (nu * length);
  return {std::max({ax, ay, 1.0}) * length / half, 2 / (half * half)};
}

bool opposite(const Lane& lane) {
  return std::hypot(lane[kIx] + lane[kOx], lane[kIy] + lane[kOy], lane[kIz] + lane[kOz]) < 0x1.001p-20;
}

struct Bound {
  Quantity quantity;
  double median, floor, factor;
};

class Comparison {
 public:
  Comparison(std::string title, Truth truth, bool half_vectors, std::vector<Bound> bounds)
      : title_(std::move(title)),
        truth_(std::move(truth)),
        half_vectors_(half_vectors),
        bounds_(std::move(bounds)),
        rows_(bounds_.size()) {}

  void add(const Lane& lane, const Answer& kernel) {
    Answer truth = truth_(lane);
    if (kernel.status != truth.status) {
      ++status_differs_;
      // Only at the edge: the reference's own o_z or i.m is 0 to within what its inputs' rounding makes of
      // it.
      double moves[kQuantities];
      explain(lane, truth, moves);
      const double margin = std::min(std::abs(truth.vector[kO].z), std::abs(truth.scalar[kIm])) / kUnit;
      if (margin > 32 + 8 * (moves[kO] + moves[kIm])) report(lane, "status", margin);
      return;
    }
    bool known = false;
    double moves[kQuantities];
    for (std::size_t n = 0; n < bounds_.size(); ++n) {
      const Bound& bound = bounds_[n];
      double error = difference(bound.quantity, kernel, truth);
      if (error > bound.floor && twin(lane, kernel, truth)) error = difference(bound.quantity, kernel, truth);
      Row& row = rows_[n];
      row.errors.push_back(static_cast<float>(error));
      if (!(error <= bound.floor)) {
        if (!known) explain(lane, truth, moves);
        known = true;
        const double ratio = (error - bound.floor) / moves[bound.quantity];
        row.worst_ratio = std::max(row.worst_ratio, ratio);
        ++row.above;
        if (!(ratio <= bound.factor)) report(lane, kNames[bound.quantity], error);
      }
      if (!(error <= row.worst)) {
        row.worst = error;
        row.worst_lane = lane;
      }
    }
  }

  void finish() {
    for (std::size_t n = 0; n < bounds_.size(); ++n) {
      Row& row = rows_[n];
      auto at = [&](double share) {
        const auto place = row.errors.begin() + static_cast<std::ptrdiff_t>(share * (row.errors.size() - 1));
        std::nth_element(row.errors.begin(), place, row.errors.end());
        return *place;
      };
      const double median = at(0.5);
      std::printf(
          "%-34s %-16s %9zu lanes: median %.2f, 99.9 %% %.1f, worst %.3g units of 2^-24; %zu above %.0f, "
          "at most %.2f times what rounding explains\n",
          title_.c_str(), kNames[bounds_[n].quantity], row.errors.size(), median, at(0.999), row.worst, row.above,
          bounds_[n].floor, row.worst_ratio);
      std::printf("    worst at %s\n", text(row.worst_lane).c_str());
      EXPECT_LE(median, bounds_[n].median) << title_ << " " << kNames[bounds_[n].quantity];
    }
    if (status_differs_ > 0) std::printf("    %zu lanes at the edge differ in status\n", status_differs_);
    EXPECT_EQ(unexplained_, 0u) << title_;
  }

 private:
  struct Row {
    std::vector<float> errors;
    double worst = -1, worst_ratio = 0;
    std::size_t above = 0;
    Lane worst_lane{};
  };

  // `exact` chooses between two normals by u3: where u3 is next to the threshold, rounding decides. Then the
  // truth is what a neighbouring u3 gives.
  bool twin(const Lane& lane, const Answer& kernel, Answer& truth) {
    for (double move : {-64 * kUnit, 64 * kUnit}) {
      Lane moved = lane;
      moved[kU3] = std::clamp(moved[kU3] + move, 0.0, 1.0);
      const Answer other = truth_(moved);
      if (other.status == truth.status && difference(kM, kernel, other) < difference(kM, kernel, truth) / 4) {
        truth = other;
        return true;
      }
    }
    return false;
  }

  // What rounding explains, in units.
  void explain(const Lane& lane, const Answer& truth, double (&moves)[kQuantities]) const {
    sensitivity(truth_, lane, truth, moves);
    if (half_vectors_) {
      const auto [turn, im] = half_vector_rounding(lane, truth.vector[kM]);
      moves[kM] += turn;
      moves[kIm] += turn;
      moves[kO] += 2 * turn;
      // D(m) has the square of i.m: beyond the first order where most of it is lost.
      moves[kPdf] += im * kUnit < 0.01 ? 2 * im : std::numeric_limits<double>::infinity();
    }
    moves[kWeight] += (1 + moves[kO]) / std::abs(truth.vector[kO].z);
  }

  static std::string text(const Lane& lane) {
    char buffer[400];
    std::snprintf(buffer, sizeof buffer, "i (%.9g, %.9g, %.9g) alpha %.9g %.9g u %.9g %.9g %.9g o (%.9g, %.9g, %.9g)",
                  lane[kIx], lane[kIy], lane[kIz], lane[kAlphaX], lane[kAlphaY], lane[kU1], lane[kU2], lane[kU3],
                  lane[kOx], lane[kOy], lane[kOz]);
    return buffer;
  }

  void report(const Lane& lane, const char* what, double error) {
    if (++unexplained_ <= 5)
      ADD_FAILURE() << title_ << ": " << what << " off by " << error << " units, unexplained, at " << text(lane);
  }

  std::string title_;
  Truth truth_;
  bool half_vectors_;
  std::vector<Bound> bounds_;
  std::vector<Row> rows_;
  std::size_t status_differs_ = 0, unexplained_ = 0;
};

// Runs the operation on `count` lanes and compares.
void compare(Operation operation, const Model& model, Sampler sampler, std::size_t count, const Truth& truth,
             std::vector<Bound> bounds) {
  std::string title = std::string(name(operation)) + " " + std::string(name(sampler)) + " " +
                      (model.shadowing == Shadowing::uncorrelated ? "uncorrelated" : "");
  const bool samples = operation == Operation::sample_reflection || operation == Operation::sample_normal;
  const bool half_vectors = samples && sampler != Sampler::ndf && sampler != Sampler::heitz;
  Comparison comparison(title, truth, half_vectors, std::move(bounds));
  constexpr std::size_t kChunk = 65536;
  for (std::size_t first = 0; first < count; first += kChunk) {
    const std::size_t lanes = std::min(kChunk, count - first);
    const LaneColumns columns = make_lanes(lanes, 77 + first);
    std::vector<float> out[13];
    Batch batch;
    batch.model = model;
    batch.sampler = sampler;
    batch.lanes = lanes;
    for (const InputField& field : input_fields()) {
      const auto index = static_cast<std::size_t>(&field - input_fields().data());
      // The table's order: i, alpha, mean slopes and interface (none here), o, u.
      constexpr int kNone = -1;
      constexpr int kOrder[] = {kIx,   kIy,   kIz, kAlphaX, kAlphaY, kNone, kNone, kNone, kNone,
                                kNone, kNone, kOx, kOy,     kOz,     kU1,   kU2,   kU3};
      if (!(field.operations & bit(operation)) || kOrder[index] == kNone) continue;
      if (kOrder[index] == kU3 && !uses_u3({}, sampler)) continue;
      field.column(batch) = columns.column[kOrder[index]];
    }
    for (const OutputField& field : output_fields().first(std::size(out))) {
      const auto index = static_cast<std::size_t>(&field - output_fields().data());
      out[index].resize(lanes);
      if (field.operations & bit(operation)) field.column(batch) = out[index];
    }
    std::vector<std::uint8_t> status(lanes);
    batch.out.status = status;
    const auto statistics = run(operation, batch);
    ASSERT_TRUE(statistics.ok()) << statistics.status();
    ASSERT_EQ(statistics->smooth + statistics->invalid, 0u);
    for (std::size_t n = 0; n < lanes; ++n) {
      // Where |i + o| < 2^-20 the half vector is rounding and no more, and the kernels answer 0.
      if (!samples && opposite(columns.lane(n))) continue;
      Answer kernel;
      kernel.vector[kO] = {out[0][n], out[1][n], out[2][n]};
      kernel.vector[kM] = {out[3][n], out[4][n], out[5][n]};
      for (int q = kIm; q < kQuantities; ++q) kernel.scalar[q] = out[6 + q - kIm][n];
      kernel.status = static_cast<LaneStatus>(status[n]);
      comparison.add(columns.lane(n), kernel);
    }
  }
  comparison.finish();
}

Roughness alpha_of(const Lane& lane) { return {lane[kAlphaX], lane[kAlphaY]}; }
Vector i_of(const Lane& lane) { return {lane[kIx], lane[kIy], lane[kIz]}; }
Vector o_of(const Lane& lane) { return {lane[kOx], lane[kOy], lane[kOz]}; }

const std::size_t kLanes = kQuick ? 20'000 : 10'000'000;

class Accuracy : public testing::TestWithParam<Sampler> {};

TEST_P(Accuracy, SampleReflection) {
  const auto truth = [&](const Lane& lane) {
    const auto s =
        reference::sample_reflection({}, GetParam(), alpha_of(lane), i_of(lane), lane[kU1], lane[kU2], lane[kU3]);
    Answer answer{};
    answer.vector[kO] = s.o;
    answer.vector[kM] = s.m;
    answer.scalar[kIm] = s.incident_dot_normal;
    answer.scalar[kPdf] = s.pdf;
    answer.scalar[kWeight] = s.weight;
    answer.status = s.status;
    return answer;
  };
  compare(Operation::sample_reflection, {}, GetParam(), kLanes / 5, truth,
          {{kO, 4, 32, 24}, {kM, 4, 32, 24}, {kIm, 4, 32, 24}, {kPdf, 8, 64, 24}, {kWeight, 8, 64, 24}});
}

class AccuracyOfNormals : public testing::TestWithParam<Sampler> {};

TEST_P(AccuracyOfNormals, SampleNormal) {
  const auto truth = [&](const Lane& lane) {
    const auto s = reference::sample_normal(GetParam(), alpha_of(lane), i_of(lane), lane[kU1], lane[kU2], lane[kU3]);
    Answer answer{};
    answer.vector[kM] = s.m;
    answer.scalar[kIm] = s.incident_dot_normal;
    answer.scalar[kPdf] = s.pdf;
    answer.status = s.status;
    return answer;
  };
  compare(Operation::sample_normal, {}, GetParam(), kLanes / 3, truth,
          {{kM, 4, 32, 24}, {kIm, 4, 32, 24}, {kPdf, 8, 64, 24}});
}

Truth query(Sampler sampler, const Model& model) {
  return [=](const Lane& lane) {
    Answer answer{};
    answer.scalar[kPdf] = reference::pdf_reflection(sampler, alpha_of(lane), i_of(lane), o_of(lane));
    answer.scalar[kValue] = reference::evaluate_reflection(model, alpha_of(lane), i_of(lane), o_of(lane));
    answer.status = lane[kOz] > 0 ? LaneStatus::accepted : LaneStatus::occluded;
    return answer;
  };
}

TEST_P(Accuracy, PdfReflection) {
  compare(Operation::pdf_reflection, {}, GetParam(), kLanes / 5, query(GetParam(), {}), {{kPdf, 8, 64, 24}});
}

TEST_P(Accuracy, EvaluateAndPdf) {
  compare(Operation::evaluate_reflection, {}, GetParam(), kLanes / 5, query(GetParam(), {}),
          {{kPdf, 8, 64, 24}, {kValue, 8, 64, 24}});
}

INSTANTIATE_TEST_SUITE_P(Samplers, Accuracy, testing::ValuesIn(all_samplers().begin(), all_samplers().end()),
                         [](const auto& info) { return std::string(name(info.param)); });

INSTANTIATE_TEST_SUITE_P(Samplers, AccuracyOfNormals, testing::Values(Sampler::ndf, Sampler::heitz, Sampler::cap),
                         [](const auto& info) { return std::string(name(info.param)); });

TEST(AccuracyOfAll, EvaluateReflection) {
  for (Shadowing shadowing : {Shadowing::correlated, Shadowing::uncorrelated}) {
    Model model;
    model.shadowing = shadowing;
    compare(Operation::evaluate_reflection, model, Sampler::cap, kLanes / 2, query(Sampler::cap, model),
            {{kValue, 8, 64, 24}});
  }
}

TEST(AccuracyOfAll, Masking) {
  const auto truth = [](const Lane& lane) {
    Answer answer{};
    answer.scalar[kMasking] = reference::masking(alpha_of(lane), i_of(lane));
    answer.scalar[kArea] = reference::projected_area(alpha_of(lane), i_of(lane));
    answer.scalar[kShare] = reference::share_unoccluded(alpha_of(lane), i_of(lane));
    return answer;
  };
  compare(Operation::masking, {}, Sampler::cap, kLanes, truth,
          {{kMasking, 2, 8, 8}, {kArea, 2, 8, 8}, {kShare, 8, 64, 24}});
}

}  // namespace
}  // namespace facetwise::test
