// The scalar baseline computes what the reference does, to float's accuracy: it is an honest thing to compare
// with.
#include "bench/baseline/baseline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

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

}  // namespace
}  // namespace facetwise::test
