// SPDX-License-Identifier: Apache-2.0
// The bits of a lane do not depend on how the batch that it is in was passed, split or run.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <numeric>

#include "support/call.h"
#include "support/counts.h"

namespace facetwise::test {
namespace {

class Invariance : public testing::TestWithParam<Call> {
 protected:
  static constexpr std::size_t kLanes = 1500;
  const Lanes lanes_ = adversarial_lanes(kLanes, 9);
  const Answer whole_ = run_call(GetParam(), lanes_);

  static Lanes part(const Lanes& lanes, std::size_t begin, std::size_t end) {
    Lanes part;
    part.count = end - begin;
    for (const auto& column : lanes.in) part.in.emplace_back(column.begin() + begin, column.begin() + end);
    return part;
  }
  // Whether lanes [begin, ...) of the whole are the part's.
  void expect_part(const Answer& answer, std::size_t begin) const {
    for (std::size_t k = 0; k < answer.out.size(); ++k) {
      if (answer.out[k].empty()) continue;
      EXPECT_EQ(std::memcmp(answer.out[k].data(), whole_.out[k].data() + begin, 4 * answer.out[k].size()), 0)
          << output_fields()[k].name << " from lane " << begin << ", " << answer.status.size() << " lanes";
    }
    EXPECT_TRUE(std::equal(answer.status.begin(), answer.status.end(), whole_.status.begin() + begin));
  }
};

TEST_P(Invariance, AnySplit) {
  for (std::size_t length = 0; length <= 67; ++length) {
    const std::size_t begin = (length * 37) % (kLanes - 67);
    expect_part(run_call(GetParam(), part(lanes_, begin, begin + length)), begin);
  }
  for (std::size_t begin = 0, length = 1; begin + length <= kLanes; begin += length, length = length * 2 + 1)
    expect_part(run_call(GetParam(), part(lanes_, begin, begin + length)), begin);
}

TEST_P(Invariance, StatisticsCountTheStatuses) {
  Statistics count;
  for (const std::uint8_t status : whole_.status) {
    switch (static_cast<LaneStatus>(status)) {
      case LaneStatus::accepted: ++count.accepted; break;
      case LaneStatus::occluded: ++count.occluded; break;
      case LaneStatus::smooth: ++count.smooth; break;
      case LaneStatus::invalid: ++count.invalid; break;
    }
  }
  EXPECT_EQ(count, whole_.statistics);
  EXPECT_GT(count.invalid, 0u);
  EXPECT_GT(count.smooth, 0u);
}

// Arrays of structures: all columns, inputs and outputs, as members, one float after a misaligned start.
TEST_P(Invariance, ColumnsAsMembersOfStructures) {
  const std::size_t inputs = lanes_.in.size(), members = inputs + output_fields().size() + 3;
  std::vector<float> memory(members * kLanes + 1, std::numeric_limits<float>::quiet_NaN());
  float* first = memory.data() + 1;
  Answer answer;
  Batch batch = make_batch(GetParam(), lanes_, answer);
  for (std::size_t k = 0; k < inputs; ++k) {
    auto& column = input_fields()[k].column(batch);
    for (std::size_t lane = 0; lane < kLanes; ++lane) first[members * lane + k] = lanes_.in[k][lane];
    if (column.present()) column = {first + k, kLanes, members * sizeof(float)};
  }
  for (std::size_t k = 0; k < output_fields().size(); ++k) {
    auto& column = output_fields()[k].column(batch);
    if (column.present()) column = {first + inputs + k, kLanes, members * sizeof(float)};
  }
  batch.out.status = {reinterpret_cast<std::uint8_t*>(first + members - 1) + 1, kLanes, members * sizeof(float)};
  const auto statistics = run(GetParam().operation, batch);
  ASSERT_TRUE(statistics.ok()) << statistics.status();
  EXPECT_EQ(*statistics, whole_.statistics);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    for (std::size_t k = 0; k < output_fields().size(); ++k) {
      if (!whole_.out[k].empty()) {
        ASSERT_EQ(std::memcmp(first + members * lane + inputs + k, &whole_.out[k][lane], 4), 0) << lane;
      }
    }
    ASSERT_EQ(batch.out.status[lane], whole_.status[lane]);
  }
}

TEST_P(Invariance, ActiveLanesInAnyOrderAndNoOthers) {
  std::vector<std::uint32_t> active;
  for (std::uint32_t lane = 0; lane < kLanes; ++lane)
    if (hash(3, lane) % 3 == 0) active.push_back(lane);
  std::sort(active.begin(), active.end(), [](auto a, auto b) { return hash(4, a) < hash(4, b); });
  Answer answer;
  Batch batch = make_batch(GetParam(), lanes_, answer);
  batch.active = active;
  const auto statistics = run(GetParam().operation, batch);
  ASSERT_TRUE(statistics.ok()) << statistics.status();
  EXPECT_EQ(statistics->lanes(), active.size());
  std::vector<bool> is_active(kLanes);
  for (const std::uint32_t lane : active) is_active[lane] = true;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    EXPECT_EQ(answer.status[lane], is_active[lane] ? whole_.status[lane] : 77);
    for (std::size_t k = 0; k < answer.out.size(); ++k) {
      if (answer.out[k].empty()) continue;
      const float untouched = -7.0f;
      ASSERT_EQ(std::memcmp(&answer.out[k][lane], is_active[lane] ? &whole_.out[k][lane] : &untouched, 4), 0);
    }
  }
}

TEST_P(Invariance, OneValueForAllLanes) {
  for (std::size_t k = 0; k < lanes_.in.size(); ++k) {
    if (!reads(GetParam(), input_fields()[k])) continue;
    for (const float value : kQuick ? std::vector{0.3f} : std::vector{0.3f, 0.0f, 1.0f, 5e-5f}) {
      Lanes expanded = lanes_;
      std::fill(expanded.in[k].begin(), expanded.in[k].end(), value);
      Answer answer;
      Batch batch = make_batch(GetParam(), lanes_, answer);
      input_fields()[k].column(batch) = value;
      const auto statistics = run(GetParam().operation, batch);
      ASSERT_TRUE(statistics.ok()) << statistics.status();
      answer.statistics = *statistics;
      EXPECT_TRUE(same_bits(answer, run_call(GetParam(), expanded))) << input_fields()[k].name << " = " << value;
    }
  }
}

TEST_P(Invariance, OutputsOverInputs) {
  // Each output takes the place of an input, as far as there are inputs.
  Lanes lanes = lanes_;
  Answer answer;
  Batch batch = make_batch(GetParam(), lanes, answer);
  std::vector<std::pair<std::size_t, std::size_t>> places;
  std::size_t k = 0;
  for (std::size_t out = 0; out < output_fields().size(); ++out) {
    if (!output_fields()[out].column(batch).present()) continue;
    while (k < lanes.in.size() && !input_fields()[k].column(batch).present()) ++k;
    if (k == lanes.in.size()) break;
    output_fields()[out].column(batch) = lanes.in[k];
    places.emplace_back(out, k++);
  }
  const auto statistics = run(GetParam().operation, batch);
  ASSERT_TRUE(statistics.ok()) << statistics.status();
  for (const auto& [out, in] : places)
    EXPECT_EQ(std::memcmp(lanes.in[in].data(), whole_.out[out].data(), 4 * kLanes), 0) << output_fields()[out].name;
}

TEST_P(Invariance, OutputsLeftOut) {
  for (std::size_t left_out = 0; left_out < output_fields().size(); ++left_out) {
    if (whole_.out[left_out].empty()) continue;
    Answer answer;
    Batch batch = make_batch(GetParam(), lanes_, answer);
    output_fields()[left_out].column(batch) = {};
    batch.out.status = {};
    ASSERT_EQ(*run(GetParam().operation, batch), whole_.statistics);
    for (std::size_t k = 0; k < answer.out.size(); ++k) {
      if (k == left_out || answer.out[k].empty()) continue;
      EXPECT_EQ(std::memcmp(answer.out[k].data(), whole_.out[k].data(), 4 * kLanes), 0);
    }
    EXPECT_EQ(answer.out[left_out], std::vector<float>(kLanes, -7.0f));
  }
}

std::string test_name(const testing::TestParamInfo<Call>& info) {
  std::string name = call_name(info.param);
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c == '/' || c == '-'; }, '_');
  return name;
}
INSTANTIATE_TEST_SUITE_P(Calls, Invariance, testing::ValuesIn(all_calls()), test_name);

}  // namespace

}  // namespace facetwise::test
