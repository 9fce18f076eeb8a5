// SPDX-License-Identifier: Apache-2.0
#include "determinism/compare.h"

#include <bit>
#include <cstdio>
#include <numeric>
#include <string>
#include <utility>

namespace facetwise::test {
namespace {

std::uint32_t bits(float value) { return std::bit_cast<std::uint32_t>(value); }

std::string with_bits(float value) {
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, "%.9g [%08x]", value, bits(value));
  return buffer;
}

}  // namespace

Answer blank_answer(const Call& call, std::size_t count) {
  Lanes none;
  none.count = count;
  none.in.resize(input_fields().size());
  Answer answer;
  make_batch(call, none, answer);
  return answer;
}

Statistics run_ok(const Call& call, const Batch& batch, const Execution& execution) {
  const auto statistics = run(call.operation, batch, execution);
  EXPECT_TRUE(statistics.ok()) << call_name(call) << ": " << statistics.status();
  return statistics.ok() ? *statistics : Statistics{};
}

Answer compute(const Call& call, const Lanes& lanes, const Execution& execution) {
  Answer answer;
  const Batch batch = make_batch(call, lanes, answer);
  answer.statistics = run_ok(call, batch, execution);
  return answer;
}

void expect_same_lane(const Call& call, const Answer& expected, std::size_t expected_lane, const Answer& got,
                      std::size_t got_lane) {
  for (std::size_t k = 0; k < output_fields().size(); ++k) {
    if (!writes(call, output_fields()[k])) continue;
    const float a = expected.out[k][expected_lane], b = got.out[k][got_lane];
    if (bits(a) == bits(b)) continue;
    ADD_FAILURE() << call_name(call) << ": " << output_fields()[k].name << " is " << with_bits(b) << " in lane "
                  << got_lane << ", " << with_bits(a) << " is expected (lane " << expected_lane << ")";
    return;
  }
  EXPECT_EQ(int{expected.status[expected_lane]}, int{got.status[got_lane]})
      << call_name(call) << ": status in lane " << got_lane;
  if (!expected.event.empty()) {
    EXPECT_EQ(int{expected.event[expected_lane]}, int{got.event[got_lane]})
        << call_name(call) << ": event in lane " << got_lane;
  }
}

void expect_same(const Call& call, const Answer& expected, const Answer& got) {
  if (same_bits(expected, got)) return;
  EXPECT_EQ(expected.statistics, got.statistics) << call_name(call);
  ASSERT_EQ(expected.status.size(), got.status.size());
  for (std::size_t lane = 0; lane < expected.status.size(); ++lane) {
    expect_same_lane(call, expected, lane, got, lane);
    if (testing::Test::HasFailure()) return;  // the first difference is the one to look at
  }
  ADD_FAILURE() << call_name(call) << ": not the same columns";
}

Lanes pick(const Lanes& lanes, const std::vector<std::uint32_t>& which) {
  Lanes picked;
  picked.count = which.size();
  for (const auto& column : lanes.in) {
    auto& to = picked.in.emplace_back();
    for (const std::uint32_t lane : which) to.push_back(column[lane]);
  }
  return picked;
}

Lanes slice(const Lanes& lanes, std::size_t begin, std::size_t count) {
  Lanes part;
  part.count = count;
  for (const auto& column : lanes.in) part.in.emplace_back(column.data() + begin, column.data() + begin + count);
  return part;
}

std::vector<std::uint32_t> shuffled(std::size_t count, std::uint64_t seed) {
  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0u);
  for (std::size_t k = count; k > 1; --k) std::swap(order[k - 1], order[hash(seed, k) % k]);
  return order;
}

Statistics recount(const std::vector<std::uint8_t>& status) {
  Statistics statistics;
  for (const std::uint8_t value : status) {
    switch (static_cast<LaneStatus>(value)) {
      case LaneStatus::accepted: ++statistics.accepted; break;
      case LaneStatus::occluded: ++statistics.occluded; break;
      case LaneStatus::smooth: ++statistics.smooth; break;
      case LaneStatus::invalid: ++statistics.invalid; break;
      default: ADD_FAILURE() << "status " << int{value} << " means nothing";
    }
  }
  return statistics;
}

}  // namespace facetwise::test
