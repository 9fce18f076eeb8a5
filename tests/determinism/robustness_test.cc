// SPDX-License-Identifier: Apache-2.0
// Whatever goes in: finite, non-negative, the status that model.h's policy says, and no lane disturbs another.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "support/call.h"
#include "support/counts.h"

namespace facetwise::test {
namespace {

const std::size_t kLanes = kQuick ? 50'000 : 1'000'000;

enum Input {
  kX = input::incident_x,
  kY,
  kZ,
  kAlphaX,
  kAlphaY,
  kOx = input::outgoing_x,
  kOy,
  kOz,
  kU1 = input::u1,
  kU2,
  kU3
};
enum Output { kOutX = 0, kOutZ = 2, kMx, kMy, kMz, kIm, kPdf, kWeight, kValue, kMasking, kArea, kShare };

// model.h's policy, from its words. Length is taken in double; lanes within rounding of the bound are unclear.
enum class Kind { ordinary, smooth, invalid, unclear };
Kind kind_of(const Call& call, const Lanes& lanes, std::size_t lane) {
  const auto in = [&](Input input) { return lanes.in[input][lane]; };
  bool unclear = false;
  const auto unit = [&](Input x, Input y, Input z) {
    const double a = in(x), b = in(y), c = in(z);
    const double error = std::abs(a * a + b * b + c * c - 1);
    if (std::abs(error - 1e-3) < 1e-6) unclear = true;
    return error <= 1e-3;  // false for NaN and infinity
  };
  const auto in_unit_interval = [](float u) { return u >= 0 && u < 1; };
  const unsigned bits = bit(call.operation);
  bool valid = unit(kX, kY, kZ);
  if (input_fields()[kOx].operations & bits) valid &= unit(kOx, kOy, kOz);
  if (input_fields()[kU1].operations & bits) {
    valid &= in_unit_interval(in(kU1)) && in_unit_interval(in(kU2));
    if (uses_u3({}, call.sampler)) valid &= in_unit_interval(in(kU3));
  }
  for (const Input alpha : {kAlphaX, kAlphaY}) valid &= in(alpha) >= 0 && in(alpha) <= 10;
  if (unclear) return Kind::unclear;
  if (!valid) return Kind::invalid;
  return std::min(in(kAlphaX), in(kAlphaY)) < 1e-4f ? Kind::smooth : Kind::ordinary;
}

class Robustness : public testing::TestWithParam<Call> {
 protected:
  static void check(const Lanes& lanes) {
    const Call& call = GetParam();
    const Answer answer = run_call(call, lanes);
    ASSERT_EQ(answer.statistics.lanes(), lanes.count);
    const auto out = [&](Output output, std::size_t lane) { return answer.out[output][lane]; };
    const auto has = [&](Output output) { return !answer.out[output].empty(); };
    std::size_t wrong = 0;
    for (std::size_t lane = 0; lane < lanes.count && wrong < 5; ++lane) {
      const auto status = static_cast<LaneStatus>(answer.status[lane]);
      const Kind kind = kind_of(call, lanes, lane);
      bool right = true;
      const auto expect = [&](bool condition, const char* what) {
        if (condition) return;
        right = false;
        ADD_FAILURE() << what << ", lane " << lane << ", status " << facetwise::name(status);
      };
      for (const auto& column : answer.out)
        if (!column.empty()) expect(std::isfinite(column[lane]), "not finite");
      for (const Output output : {kPdf, kWeight, kValue, kMasking, kArea, kShare})
        if (has(output)) expect(out(output, lane) >= 0, "negative");
      if (has(kWeight) && call.sampler != Sampler::ndf) expect(out(kWeight, lane) <= 1.00001f, "weight above 1");
      if (has(kMasking)) expect(out(kMasking, lane) <= 1 && out(kShare, lane) <= 1, "share above 1");
      switch (kind) {
        case Kind::unclear: break;
        case Kind::invalid:
          expect(status == LaneStatus::invalid, "should be invalid");
          for (const auto& column : answer.out)
            if (!column.empty()) expect(column[lane] == 0, "an invalid lane's output is not 0");
          break;
        case Kind::smooth:
          expect(status == LaneStatus::smooth, "should be smooth");
          if (has(kPdf)) expect(out(kPdf, lane) == 0, "a delta's pdf is not 0");
          if (has(kValue)) expect(out(kValue, lane) == 0, "a delta's value is not 0");
          if (has(kMz)) expect(out(kMz, lane) == 1 && out(kMx, lane) == 0, "a mirror's normal is not n");
          if (has(kOutX))
            expect(out(kOutX, lane) == -lanes.in[kX][lane] && out(kOutZ, lane) == lanes.in[kZ][lane],
                   "not the mirror direction");
          if (has(kWeight)) expect(out(kWeight, lane) == (lanes.in[kZ][lane] > 0 ? 1 : 0), "a mirror's weight");
          break;
        case Kind::ordinary:
          expect(status == LaneStatus::accepted || status == LaneStatus::occluded, "should be ordinary");
          if (has(kMz)) expect(out(kMz, lane) > 0, "m_z is not positive");
          if (has(kOutZ)) {
            const bool below = out(kOutZ, lane) <= 0;
            if (call.sampler != Sampler::ndf) expect(below == (status == LaneStatus::occluded), "occlusion");
            if (call.sampler == Sampler::exact || (lanes.in[kZ][lane] <= 0 && call.sampler != Sampler::ndf))
              expect(!below, "occluded");
            const double x = out(kOutX, lane), y = answer.out[1][lane], z = out(kOutZ, lane);
            const double i2 = std::pow(lanes.in[kX][lane], 2.0) + std::pow(lanes.in[kY][lane], 2.0) +
                              std::pow(lanes.in[kZ][lane], 2.0);
            expect(std::abs(x * x + y * y + z * z - i2) < 1e-5, "|o| is not |i|");
          }
          if (status == LaneStatus::occluded) {
            if (has(kPdf)) expect(out(kPdf, lane) == 0, "an occluded lane's pdf is not 0");
            if (has(kWeight)) expect(out(kWeight, lane) == 0, "an occluded lane's weight is not 0");
            if (has(kValue)) expect(out(kValue, lane) == 0, "an occluded lane's value is not 0");
          } else if (call.operation == Operation::sample_reflection || call.operation == Operation::sample_normal) {
            expect(out(kPdf, lane) > 0, "an accepted sample's pdf is 0");
          }
          break;
      }
      wrong += !right;
    }
  }
};

TEST_P(Robustness, AdversarialLanes) { check(adversarial_lanes(kLanes, 21)); }

TEST_P(Robustness, AnyBitPattern) {
  // Half of the lanes have one input of arbitrary bits, the rest arbitrary bits in all.
  Lanes lanes = ordinary_lanes(kLanes / 4, 23);
  for (std::size_t k = 0; k < lanes.in.size(); ++k)
    for (std::size_t lane = 0; lane < lanes.count; ++lane)
      if (lane % 2 == 0 || hash(24, lane) % lanes.in.size() == k)
        lanes.in[k][lane] = std::bit_cast<float>(static_cast<std::uint32_t>(hash(25 + k, lane)));
  check(lanes);
}

TEST_P(Robustness, EdgesOfEveryInput) {
  // Every combination of a few directions, roughnesses and random numbers at their limits.
  constexpr float kBelowOne = 0x1.fffffep-1f, kSteep = 0x1.fffffep-1f;
  const std::vector<std::array<float, 3>> directions = {{0, 0, 1},
                                                        {0, 0, -1},
                                                        {1, 0, 0},
                                                        {0, -1, -0.0f},
                                                        {1, 0, 1e-30f},
                                                        {1, 0, -1e-30f},
                                                        {1, 0, 1e-40f},
                                                        {0.6f, 0, 0.8f},
                                                        {0.6f, 0, -0.8f},
                                                        {1e-20f, 0, 1},
                                                        {1e-20f, 1e-20f, -1},
                                                        {3e-8f, 0, -1},
                                                        {1e-4f, 0, -1},
                                                        {0, 1e-2f, -kSteep},
                                                        {1.0004f, 0, 1e-4f},
                                                        {0.0f, 0.0f, 1.0004f},
                                                        {0, 0, -0.9996f},
                                                        {0, 0, -1.0004f}};
  const std::vector<std::pair<float, float>> alphas = {{1e-4f, 1e-4f}, {1e-4f, 10},  {10, 1e-4f}, {10, 10},
                                                       {1, 1},         {0.3f, 0.3f}, {0.01f, 2},  {4, 4}};
  const std::vector<float> us = {0, 1e-45f, 1e-38f, 0x1p-24f, 0.25f, 0.5f, 0.75f, kBelowOne};
  Lanes lanes;
  lanes.in.resize(input_fields().size());
  for (const auto& i : directions)
    for (const auto& o : directions)
      for (const auto& [ax, ay] : alphas)
        for (const float u1 : us)
          for (const float u2 : us) {
            const float u3 = us[lanes.count % us.size()];
            const float values[] = {i[0], i[1], i[2], ax, ay, o[0], o[1], o[2], u1, u2, u3};
            static_assert(std::size(values) == std::size(input::kPlain));
            for (std::size_t k = 0; k < std::size(values); ++k) lanes.in[input::kPlain[k]].push_back(values[k]);
            ++lanes.count;
          }
  // What only some models have.
  for (const auto& [column, value] : {std::pair{input::mean_slope_x, 0.1f}, std::pair{input::mean_slope_y, -0.2f},
                                      std::pair{input::slope_correlation, 0.3f}, std::pair{input::eta, 1.5f},
                                      std::pair{input::f0, 0.04f}, std::pair{input::f90, 1.0f}})
    lanes.in[column].assign(lanes.count, value);
  check(lanes);
}

TEST_P(Robustness, ABadLaneDisturbsNoOther) {
  const Lanes bad = adversarial_lanes(20'000, 31), good = ordinary_lanes(20'000, 31);
  const Answer with = run_call(GetParam(), bad), without = run_call(GetParam(), good);
  std::size_t untouched = 0;
  for (std::size_t lane = 0; lane < bad.count; ++lane) {
    const auto same_input = [&](const auto& column) {
      const std::size_t k = &column - bad.in.data();
      return std::bit_cast<std::uint32_t>(column[lane]) == std::bit_cast<std::uint32_t>(good.in[k][lane]);
    };
    if (!std::all_of(bad.in.begin(), bad.in.end(), same_input)) continue;
    ++untouched;
    ASSERT_EQ(with.status[lane], without.status[lane]);
    for (std::size_t k = 0; k < with.out.size(); ++k) {
      if (with.out[k].empty()) continue;
      ASSERT_EQ(with.out[k][lane], without.out[k][lane]) << output_fields()[k].name;
    }
  }
  EXPECT_GT(untouched, bad.count / 2);
  EXPECT_LT(untouched, bad.count);
}

std::string test_name(const testing::TestParamInfo<Call>& info) {
  std::string name = call_name(info.param);
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c == '/' || c == '-'; }, '_');
  return name;
}
INSTANTIATE_TEST_SUITE_P(Calls, Robustness, testing::ValuesIn(plain_calls()), test_name);

}  // namespace
}  // namespace facetwise::test
