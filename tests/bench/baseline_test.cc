// SPDX-License-Identifier: Apache-2.0
// The scalar baseline computes what the reference does, to float's accuracy: it is an honest thing to compare
// with.
#include "bench/baseline/baseline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <tuple>
#include <vector>

#include "facetwise/engine.h"
#include "facetwise/reference.h"
#include "support/counts.h"
#include "support/lanes.h"

namespace facetwise::test {
namespace {

class Baseline : public testing::TestWithParam<Sampler> {};

TEST_P(Baseline, AgreesWithTheReference) {
  const LaneColumns columns = make_lanes(kQuick ? 20'000 : 400'000, 9);
  std::vector<double> o, m, pdf, weight, query, value;
  std::size_t differs = 0;
  for (std::size_t n = 0; n < columns.count(); ++n) {
    const auto f = [&](int k) { return columns.column[k][n]; };
    const reference::Roughness alpha = {f(kAlphaX), f(kAlphaY)};
    const reference::Vector i = {f(kIx), f(kIy), f(kIz)}, out = {f(kOx), f(kOy), f(kOz)};
    const baseline::Vector fi = {f(kIx), f(kIy), f(kIz)}, fo = {f(kOx), f(kOy), f(kOz)};
    const auto truth = reference::sample_reflection({}, GetParam(), alpha, i, f(kU1), f(kU2), f(kU3));
    const auto sample = baseline::sample_reflection(GetParam(), Shadowing::correlated, fi, f(kAlphaX), f(kAlphaY),
                                                    f(kU1), f(kU2), f(kU3));
    if (sample.accepted != (truth.status == LaneStatus::accepted)) {
      ++differs;
    } else {
      o.push_back(std::hypot(sample.o.x - truth.o.x, sample.o.y - truth.o.y, sample.o.z - truth.o.z));
      if (sample.accepted) {
        pdf.push_back(std::abs(sample.pdf / truth.pdf - 1));
        weight.push_back(std::abs(sample.weight / truth.weight - 1));
      }
    }
    if (samples_normals(GetParam())) {
      const auto normal = baseline::sample_normal(GetParam(), fi, f(kAlphaX), f(kAlphaY), f(kU1), f(kU2));
      m.push_back(std::hypot(normal.m.x - truth.m.x, normal.m.y - truth.m.y, normal.m.z - truth.m.z));
    }
    const double expected = reference::pdf_reflection(GetParam(), alpha, i, out);
    if (expected > 0) {
      const float answer = baseline::pdf_reflection(GetParam(), fi, fo, f(kAlphaX), f(kAlphaY));
      query.push_back(std::abs(answer / expected - 1));
      const float light = baseline::evaluate_reflection(Shadowing::correlated, fi, fo, f(kAlphaX), f(kAlphaY));
      value.push_back(std::abs(light / reference::evaluate_reflection({}, alpha, i, out) - 1));
    }
  }
  // Half of the lanes are adversarial and plain float code gives some of them up: quantiles, not the worst.
  const auto at = [](std::vector<double>& errors, double share) {
    const auto place = errors.begin() + static_cast<std::ptrdiff_t>(share * (errors.size() - 1));
    std::nth_element(errors.begin(), place, errors.end());
    return *place;
  };
  EXPECT_LE(differs, columns.count() * 3 / 100);
  for (auto* errors : {&o, &m, &pdf, &weight, &query, &value}) {
    if (errors->empty()) continue;
    EXPECT_LE(at(*errors, 0.5), 5e-7);
    EXPECT_LE(at(*errors, 0.9), 1e-3);
  }
}

INSTANTIATE_TEST_SUITE_P(Samplers, Baseline, testing::ValuesIn(all_samplers().begin(), all_samplers().end()),
                         [](const auto& info) { return std::string(name(info.param)); });

// The other models: a sample's density is the reference's, and samples lie where the engine's do.
struct Kind {
  Distribution distribution;
  Masking masking;
  Sampler sampler;
};

std::vector<Kind> kinds() {
  std::vector<Kind> all;
  for (const Model& model : all_models())
    for (const Sampler sampler : all_samplers())
      if (!(model.distribution == Distribution::ggx && model.masking == Masking::smith) &&
          baseline::has_baseline({model.distribution, model.masking}, sampler))
        all.push_back({model.distribution, model.masking, sampler});
  return all;
}

class ModelBaseline : public testing::TestWithParam<Kind> {};

TEST_P(ModelBaseline, AgreesWithTheReferenceAndTheEngine) {
  const auto [distribution, masking, sampler] = GetParam();
  const baseline::Model model{distribution, masking};
  const std::size_t count = kQuick ? 20'000 : 100'000;
  for (const auto& [theta, ax, ay] : {std::tuple{0.3f, 0.4f, 0.4f}, {1.0f, 0.3f, 0.8f}, {1.45f, 0.6f, 0.2f}}) {
    const float ix = std::sin(theta) * 0.8f, iy = std::sin(theta) * 0.6f, iz = std::cos(theta);
    std::vector<float> u[3], x(count), y(count), z(count);
    std::mt19937_64 random(5);
    for (auto& column : u)
      for (std::size_t n = 0; n < count; ++n) column.push_back(static_cast<float>(random() >> 40) * 0x1p-24f);
    Batch batch;
    batch.model.distribution = distribution;
    batch.model.masking = masking;
    batch.sampler = sampler;
    batch.lanes = count;
    batch.incident = {ix, iy, iz};
    batch.alpha_x = ax;
    batch.alpha_y = ay;
    batch.u1 = u[0], batch.u2 = u[1], batch.u3 = u[2];
    std::vector<std::uint8_t> status(count);
    batch.out.outgoing = {x, y, z};
    batch.out.status = status;
    ASSERT_TRUE(sample_reflection(batch).ok());
    const reference::Surface surface{.model = batch.model, .alpha = {ax, ay}};
    double sum[3] = {}, squares[3] = {}, expected[3] = {};
    std::size_t accepted = 0, engine_accepted = 0, wrong = 0, compared = 0;
    for (std::size_t n = 0; n < count; ++n) {
      const auto s = baseline::sample_reflection(model, sampler, Shadowing::correlated, {ix, iy, iz}, ax, ay, u[0][n],
                                                 u[1][n], u[2][n]);
      const float o[] = {s.o.x, s.o.y, s.o.z}, e[] = {x[n], y[n], z[n]};
      for (int k = 0; k < 3; ++k) {
        if (s.accepted) sum[k] += o[k], squares[k] += static_cast<double>(o[k]) * o[k];
        if (status[n] == static_cast<std::uint8_t>(LaneStatus::accepted)) expected[k] += e[k];
      }
      accepted += s.accepted;
      engine_accepted += status[n] == static_cast<std::uint8_t>(LaneStatus::accepted);
      if (!s.accepted || s.o.z < 1e-3f || n % 50 != 0) continue;
      ++compared;
      const double pdf = reference::pdf_reflection(surface, sampler, {ix, iy, iz}, {s.o.x, s.o.y, s.o.z});
      wrong += !(std::abs(s.pdf / pdf - 1) < 0.01);
      wrong += !(std::abs(baseline::pdf_reflection(model, sampler, {ix, iy, iz}, s.o, ax, ay) / pdf - 1) < 0.01);
    }
    const double lanes = static_cast<double>(count);
    EXPECT_NEAR(static_cast<double>(accepted), static_cast<double>(engine_accepted), 6 * std::sqrt(lanes)) << theta;
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(sum[k] / lanes, expected[k] / lanes, 8 * std::sqrt(squares[k]) / lanes) << theta << ", part " << k;
    EXPECT_LE(wrong, compared / 50) << theta;  // plain float code gives up in tails
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, ModelBaseline, testing::ValuesIn(kinds()), [](const auto& info) {
  return std::string(name(info.param.distribution)) + "_" + std::string(name(info.param.masking)) + "_" +
         std::string(name(info.param.sampler));
});

}  // namespace
}  // namespace facetwise::test
