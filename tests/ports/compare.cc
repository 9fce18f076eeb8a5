// SPDX-License-Identifier: Apache-2.0
#include "compare.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "support/call.h"

namespace facetwise::test {
namespace {

constexpr std::size_t kCount = kPortLanes;

Batch batch_of(Sampler sampler) {
  const auto& in = port_lanes();
  Batch batch;
  batch.sampler = sampler;
  batch.lanes = kCount;
  batch.incident = {in[in_ix], in[in_iy], in[in_iz]};
  batch.alpha_x = in[in_alpha_x], batch.alpha_y = in[in_alpha_y];
  return batch;
}

PortAnswer librarys(Sampler sampler) {
  const auto& in = port_lanes();
  PortAnswer answer(port_outputs, std::vector<float>(kCount));
  Batch batch = batch_of(sampler);
  batch.u1 = in[in_u1], batch.u2 = in[in_u2], batch.u3 = in[in_u3];
  batch.out.outgoing = {answer[out_ox], answer[out_oy], answer[out_oz]};
  batch.out.pdf = answer[out_pdf], batch.out.weight = answer[out_weight];
  EXPECT_TRUE(sample_reflection(batch).ok());
  batch = batch_of(sampler);
  batch.outgoing = {in[in_ox], in[in_oy], in[in_oz]};
  batch.out.pdf = answer[out_asked], batch.out.value = answer[out_value];
  EXPECT_TRUE(evaluate_reflection(batch).ok());
  batch = batch_of(sampler);
  batch.out.share_unoccluded = answer[out_share];
  EXPECT_TRUE(masking(batch).ok());
  return answer;
}

double at(std::vector<double>& values, double share) {
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

}  // namespace

const std::vector<std::vector<float>>& port_lanes() {
  static const std::vector<std::vector<float>> columns = [] {
    const Lanes lanes = ordinary_lanes(kCount, 21);
    std::vector<std::vector<float>> in;
    for (const input::Index k :
         {input::incident_x, input::incident_y, input::incident_z, input::alpha_x, input::alpha_y, input::outgoing_x,
          input::outgoing_y, input::outgoing_z, input::u1, input::u2, input::u3})
      in.push_back(lanes.in[k]);
    return in;
  }();
  return columns;
}

void expect_the_librarys(Sampler sampler, const PortAnswer& port) {
  const PortAnswer wanted = librarys(sampler);
  const auto& in = port_lanes();
  std::vector<double> directions, pdfs, weights;
  std::size_t differ = 0, occluded = 0, compared = 0, apart = 0;
  for (std::size_t k = 0; k < kCount; ++k) {
    for (int column = 0; column < port_outputs; ++column) {
      ASSERT_TRUE(std::isfinite(port[column][k])) << k << ", column " << column;
      ASSERT_TRUE(column <= out_oz || port[column][k] >= 0) << k << ", column " << column;
    }
    const auto difference = [&](PortOutput column) { return static_cast<double>(port[column][k]) - wanted[column][k]; };
    const auto far = [&](PortOutput column) {
      return std::abs(difference(column)) > 2e-5 * std::max(std::abs(wanted[column][k]), 1e-30f);
    };
    compared += wanted[out_asked][k] > 0;
    apart += far(out_asked) || far(out_value) || far(out_share);
    occluded += in[in_iz][k] > 0 && port[out_pdf][k] == 0;
    if ((port[out_pdf][k] > 0) != (wanted[out_pdf][k] > 0)) {
      ++differ;
      continue;
    }
    directions.push_back(std::hypot(difference(out_ox), difference(out_oy), difference(out_oz)));
    if (wanted[out_pdf][k] == 0) continue;
    pdfs.push_back(std::abs(difference(out_pdf) / wanted[out_pdf][k]));
    weights.push_back(std::abs(difference(out_weight)));
  }
  std::printf(
      "%s: median and 99.9 %%: o %.2g %.2g, pdf %.2g %.2g, weight %.2g %.2g; %zu accepted by one only; asked for: "
      "%zu of %zu apart\n",
      std::string(name(sampler)).c_str(), at(directions, 0.5), at(directions, 0.999), at(pdfs, 0.5), at(pdfs, 0.999),
      at(weights, 0.5), at(weights, 0.999), differ, apart, kCount);
  EXPECT_LT(at(directions, 0.5), 2e-7);
  EXPECT_LT(at(directions, 0.999), 1e-5);
  EXPECT_LT(at(pdfs, 0.5), 4e-7);
  EXPECT_LT(at(pdfs, 0.999), 1e-3);
  EXPECT_LT(at(weights, 0.5), 2e-7);
  EXPECT_LT(at(weights, 0.999), 4e-4);
  EXPECT_LT(differ, kCount / 1000);
  EXPECT_GT(compared, kCount / 10);
  EXPECT_LT(apart, kCount / 1000);
  if (sampler == Sampler::exact) {
    EXPECT_EQ(occluded, 0u);
  }
}

}  // namespace facetwise::test
