// SPDX-License-Identifier: Apache-2.0
// ports/facetwise.hpp against the library, on lanes that look for trouble.
#include <gtest/gtest.h>

#include <cmath>

#include "ports/facetwise.hpp"
#include "support/call.h"

namespace facetwise::test {
namespace {

using port::Vec3;

constexpr std::size_t kLanes = 1'000'000;

struct Kind {
  Sampler sampler;
  port::Sample (*sample)(Vec3, float, float, float, float, float);
  float (*pdf)(Vec3, Vec3, float, float);
};
void PrintTo(const Kind& kind, std::ostream* to) { *to << name(kind.sampler); }
const Kind kKinds[] = {
    {Sampler::cap,
     [](Vec3 i, float ax, float ay, float u1, float u2, float) { return port::sample_cap(i, ax, ay, u1, u2); },
     port::pdf_cap},
    {Sampler::bounded,
     [](Vec3 i, float ax, float ay, float u1, float u2, float) { return port::sample_bounded(i, ax, ay, u1, u2); },
     port::pdf_bounded},
    {Sampler::exact, port::sample_exact, port::pdf_exact},
};

class CppPort : public testing::TestWithParam<Kind> {};

// Differences are those of rounding, which steep and grazing lanes magnify: half of the lanes agree to a few units in the
// last place, 99.9 % to 1e-4 (pdf: 1e-3, weight: 2e-4), and what is accepted differs only at the horizon. Weights are compared as they
// are, since those of o at the horizon go to 0 with o_z.
TEST_P(CppPort, SamplesAreTheLibrarys) {
  const Kind& kind = GetParam();
  const Lanes lanes = ordinary_lanes(kLanes, 21);
  const auto in = [&](input::Index k) { return lanes.in[k].data(); };
  std::vector<float> x(kLanes), y(kLanes), z(kLanes), pdf(kLanes), weight(kLanes);
  Batch batch;
  batch.sampler = kind.sampler;
  batch.lanes = kLanes;
  batch.incident = {lanes.in[input::incident_x], lanes.in[input::incident_y], lanes.in[input::incident_z]};
  batch.alpha_x = lanes.in[input::alpha_x], batch.alpha_y = lanes.in[input::alpha_y];
  batch.u1 = lanes.in[input::u1], batch.u2 = lanes.in[input::u2], batch.u3 = lanes.in[input::u3];
  batch.out.outgoing = {x, y, z};
  batch.out.pdf = pdf, batch.out.weight = weight;
  ASSERT_TRUE(sample_reflection(batch).ok());

  std::vector<double> directions, pdfs, weights;
  std::size_t differ = 0, occluded = 0;
  for (std::size_t k = 0; k < kLanes; ++k) {
    const Vec3 i{in(input::incident_x)[k], in(input::incident_y)[k], in(input::incident_z)[k]};
    const port::Sample s = kind.sample(i, in(input::alpha_x)[k], in(input::alpha_y)[k], in(input::u1)[k],
                                       in(input::u2)[k], in(input::u3)[k]);
    ASSERT_TRUE(std::isfinite(s.o.x) && std::isfinite(s.o.y) && std::isfinite(s.o.z)) << k;
    ASSERT_TRUE(std::isfinite(s.pdf) && s.pdf >= 0 && std::isfinite(s.weight) && s.weight >= 0) << k;
    occluded += i.z > 0 && s.pdf == 0;
    if ((s.pdf > 0) != (pdf[k] > 0)) {
      ++differ;
      continue;
    }
    directions.push_back(std::hypot(s.o.x - x[k], s.o.y - y[k], s.o.z - z[k]));
    if (pdf[k] == 0) continue;
    pdfs.push_back(std::abs(s.pdf / pdf[k] - 1));
    weights.push_back(std::abs(s.weight - weight[k]));
  }
  const auto at = [](std::vector<double>& values, double share) {
    const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), place, values.end());
    return *place;
  };
  std::printf("%s: median and 99.9 %%: o %.2g %.2g, pdf %.2g %.2g, weight %.2g %.2g; %zu accepted by one only\n",
              std::string(name(kind.sampler)).c_str(), at(directions, 0.5), at(directions, 0.999), at(pdfs, 0.5),
              at(pdfs, 0.999), at(weights, 0.5), at(weights, 0.999), differ);
  EXPECT_LT(at(directions, 0.5), 1e-6);
  EXPECT_LT(at(directions, 0.999), 1e-4);
  EXPECT_LT(at(pdfs, 0.5), 2e-6);
  EXPECT_LT(at(pdfs, 0.999), 1e-3);
  EXPECT_LT(at(weights, 0.5), 1e-6);
  EXPECT_LT(at(weights, 0.999), 2e-4);
  EXPECT_LT(differ, kLanes / 1000);
  if (kind.sampler == Sampler::exact) {
    EXPECT_EQ(occluded, 0u);
  }
}

TEST_P(CppPort, DensitiesAndValuesAreTheLibrarys) {
  const Kind& kind = GetParam();
  const Lanes lanes = ordinary_lanes(kLanes, 22);
  std::vector<float> pdf(kLanes), value(kLanes), share(kLanes);
  Batch batch;
  batch.sampler = kind.sampler;
  batch.lanes = kLanes;
  batch.incident = {lanes.in[input::incident_x], lanes.in[input::incident_y], lanes.in[input::incident_z]};
  batch.alpha_x = lanes.in[input::alpha_x], batch.alpha_y = lanes.in[input::alpha_y];
  Batch masking = batch;
  masking.out.share_unoccluded = share;
  ASSERT_TRUE(facetwise::masking(masking).ok());
  batch.outgoing = {lanes.in[input::outgoing_x], lanes.in[input::outgoing_y], lanes.in[input::outgoing_z]};
  batch.out.pdf = pdf, batch.out.value = value;
  ASSERT_TRUE(evaluate_reflection(batch).ok());
  std::size_t apart = 0, compared = 0;
  for (std::size_t k = 0; k < kLanes; ++k) {
    const auto in = [&](input::Index column) { return lanes.in[column][k]; };
    const Vec3 i{in(input::incident_x), in(input::incident_y), in(input::incident_z)},
        o{in(input::outgoing_x), in(input::outgoing_y), in(input::outgoing_z)};
    const float ax = in(input::alpha_x), ay = in(input::alpha_y);
    const float p = kind.pdf(i, o, ax, ay), v = port::evaluate(i, o, ax, ay), s = port::share_unoccluded(i, ax, ay);
    ASSERT_TRUE(std::isfinite(p) && p >= 0 && std::isfinite(v) && v >= 0) << k;
    const auto far = [](float a, float b) { return std::abs(a - b) > 2e-5f * std::max(std::abs(b), 1e-30f); };
    compared += pdf[k] > 0;
    apart += far(p, pdf[k]) || far(v, value[k]) || far(s, share[k]);
  }
  EXPECT_GT(compared, kLanes / 10);
  EXPECT_LT(apart, kLanes / 1000) << name(kind.sampler);
}

INSTANTIATE_TEST_SUITE_P(Samplers, CppPort, testing::ValuesIn(kKinds),
                         [](const auto& info) { return std::string(name(info.param.sampler)); });

}  // namespace
}  // namespace facetwise::test
