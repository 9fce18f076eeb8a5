// SPDX-License-Identifier: Apache-2.0
// The machine's limits are measured: they do the work they say, and take the time it takes.
#include "bench/machine_limits.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include "bench/paired.h"
#include "bench/peak.h"

namespace facetwise::bench {
namespace {

TEST(MultiplyAdd, CountsWhatItDoes) {
  for (const Target target : available_targets()) {
    float sink = -1;
    EXPECT_EQ(multiply_add(target, 100, sink), 100u * 12 * 2 * vector_lanes(target)) << name(target);
    // x <- 0.999 x + 0.001 goes to 1 in every one of the twelve chains of every lane.
    multiply_add(target, 20000, sink);
    EXPECT_NEAR(sink, 12.0f * static_cast<float>(vector_lanes(target)), 1e-2f * sink) << name(target);
  }
}

TEST(Fma, WiderTargetsReachMore) {
  const auto targets = available_targets();
  double best = 0, portable = 0;
  for (int k = 0; k < 5; ++k) {  // on a busy machine a measurement may be of another program's making
    best = std::max(best, measure_fma(targets.front(), 1).flops_per_second);
    portable = std::max(portable, measure_fma(Target::scalar, 1).flops_per_second);
  }
  EXPECT_GT(portable, 1e8);
  EXPECT_LT(best, 1e13);
  if (vector_lanes(targets.front()) >= 8) {
    EXPECT_GT(best, 1.5 * portable);
  }
}

TEST(Copy, ReadsAndWritesTheColumns) {
  auto columns = Columns::make(4096);
  ASSERT_TRUE(columns.ok());
  columns->set_roughness(0.3f, 0.2f, 4096);
  for (const CopyOrder order : {CopyOrder::one_by_one, CopyOrder::side_by_side, CopyOrder::streaming})
    for (const bool threads : {false, true})
      for (const auto& [inputs, outputs] : std::vector<std::pair<int, int>>{{7, 4}, {8, 4}, {8, 1}, {6, 3}})
        for (const std::size_t batch : {16u, 4096u}) {
          for (int k = 0; k < outputs; ++k) std::fill_n(columns->output(k), 4096, -7.0f);
          make_copy(*columns, inputs, outputs, batch, Target::best, threads, order)();
          for (int k = 0; k < outputs; ++k) {
            // Side by side, the last output takes in the inputs that are left.
            const bool sum = order != CopyOrder::one_by_one && k == outputs - 1;
            for (std::size_t lane = 0; lane < batch; ++lane) {
              float expected = columns->input(k)[lane];
              if (sum)
                for (int j = outputs; j < inputs; ++j) expected += columns->input(j)[lane];
              ASSERT_NEAR(columns->output(k)[lane], expected, 1e-5f) << inputs << " " << outputs << " " << lane;
            }
            if (batch < 4096) {
              EXPECT_EQ(columns->output(k)[batch], -7.0f);
            }
          }
        }
}

TEST(Columns, SpreadDirectionsAndNumbers) {
  constexpr std::size_t kLanes = 20000;
  auto columns = Columns::make(kLanes);
  ASSERT_TRUE(columns.ok());
  double z = 0, behind = 0;
  std::vector<double> mean(3);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const double x = columns->input(Columns::kIx)[lane], y = columns->input(Columns::kIy)[lane];
    const double iz = columns->input(Columns::kIz)[lane];
    ASSERT_NEAR(x * x + y * y + iz * iz, 1, 1e-6);
    ASSERT_GT(iz, 0);
    z += iz / kLanes;
    behind += columns->input(Columns::kIzBackfacing)[lane] < 0 ? 1.0 / kLanes : 0;
    for (int k = 0; k < 3; ++k) {
      const float u = columns->input(Columns::kU1 + k)[lane];
      ASSERT_TRUE(u >= 0 && u < 1);
      mean[static_cast<std::size_t>(k)] += u / kLanes;
    }
  }
  // Five standard deviations.
  EXPECT_NEAR(z, 0.5, 5 * std::sqrt(1 / 12.0 / kLanes));
  EXPECT_NEAR(behind, 0.1, 5 * std::sqrt(0.09 / kLanes));
  for (const double m : mean) EXPECT_NEAR(m, 0.5, 5 * std::sqrt(1 / 12.0 / kLanes));
}

TEST(Columns, MoreThanTheMemoryIsAnError) {
  EXPECT_EQ(Columns::make(std::size_t{1} << 40).status().code(), absl::StatusCode::kResourceExhausted);
}

// A clock that goes by what is called, and stands still otherwise.
struct CallClock {
  using duration = std::chrono::nanoseconds;
  using time_point = std::chrono::time_point<CallClock, duration>;
  static inline duration passed{};
  static time_point now() { return time_point(passed); }
};

TEST(Paired, RatioIsThatOfUndisturbedRounds) {
  using std::chrono::microseconds;
  int calls_a = 0, calls_b = 0;
  // Every 100 calls, A is held up for as long as all of them take.
  const auto a = [&] { CallClock::passed += microseconds(++calls_a % 100 == 0 ? 30000 : 300); };
  const auto b = [&] {
    ++calls_b;
    CallClock::passed += microseconds(100);
  };
  const Paired pair = measure_paired<CallClock>(a, b, 15, 0.003);
  EXPECT_NEAR(pair.ratio, 3, 1e-9);
  EXPECT_NEAR(pair.a, 300e-6, 1e-12);
  EXPECT_NEAR(pair.b, 100e-6, 1e-12);
  // Both sides ran about 3 ms a round.
  EXPECT_NEAR(calls_a, 15 * 10, 30);
  EXPECT_NEAR(calls_b, 15 * 30, 90);
}

}  // namespace
}  // namespace facetwise::bench
