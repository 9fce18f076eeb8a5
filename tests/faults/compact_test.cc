// SPDX-License-Identifier: Apache-2.0
// compact(): accepted lanes, in order, whatever the threads.
#include "facetwise/engine.h"
#include "gtest/gtest.h"
#include "support/call.h"
#include "support/counts.h"
#include "tbb/global_control.h"

namespace facetwise::test {
namespace {

constexpr auto kAccepted = static_cast<std::uint8_t>(LaneStatus::accepted);
constexpr std::uint32_t kUnwrittenIndex = 0xDEADBEEF;
constexpr float kUnwritten = -77.0f;

struct Queue {
  std::vector<std::uint8_t> status;
  std::vector<std::uint32_t> active;
  std::vector<float> values;
};

// `share` of 256 lanes are accepted; the active list has two thirds of them, shuffled.
Queue make_queue(std::size_t lanes, unsigned share, std::uint64_t seed) {
  Queue queue;
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    const std::uint64_t bits = hash(seed, lane);
    queue.status.push_back((bits & 255) < share ? kAccepted : static_cast<std::uint8_t>(1 + (bits >> 8) % 3));
    queue.values.push_back(uniform(seed + 1, lane));
    if (hash(seed + 2, lane) % 3 != 0) queue.active.push_back(static_cast<std::uint32_t>(lane));
  }
  for (std::size_t k = queue.active.size(); k > 1; --k)
    std::swap(queue.active[k - 1], queue.active[hash(seed + 3, k) % k]);
  return queue;
}

void expect_compacted(const Queue& queue, bool active, const Execution& execution) {
  const std::size_t positions = active ? queue.active.size() : queue.status.size();
  std::vector<std::uint32_t> index(positions, kUnwrittenIndex), expected_index;
  std::vector<float> dense(positions, kUnwritten), strided(3 * positions, kUnwritten), constant(positions, kUnwritten);
  for (std::size_t p = 0; p < positions; ++p) {
    const auto lane = active ? queue.active[p] : static_cast<std::uint32_t>(p);
    if (queue.status[lane] == kAccepted) expected_index.push_back(lane);
  }
  const Compaction::DenseColumn columns[] = {
      {queue.values, dense},
      {queue.values, OutputColumn<float>(strided.data(), positions, 12)},
      {2.5f, constant},  // one value for all lanes
  };
  Compaction compaction;
  compaction.lanes = queue.status.size();
  compaction.status = queue.status;
  if (active) compaction.active = queue.active;
  compaction.index = index;
  compaction.columns = columns;
  const auto accepted = compact(compaction, execution);
  ASSERT_TRUE(accepted.ok()) << accepted.status();
  ASSERT_EQ(*accepted, expected_index.size());
  for (std::size_t k = 0; k < positions; ++k) {
    const bool written = k < expected_index.size();
    const float value = written ? queue.values[expected_index[k]] : kUnwritten;
    ASSERT_EQ(index[k], written ? expected_index[k] : kUnwrittenIndex) << k;
    ASSERT_EQ(dense[k], value) << k;
    ASSERT_EQ(strided[3 * k], value) << k;
    ASSERT_EQ(strided[3 * k + 1], kUnwritten);
    ASSERT_EQ(strided[3 * k + 2], kUnwritten);
    ASSERT_EQ(constant[k], written ? 2.5f : kUnwritten) << k;
  }
}

// Sizes around the chunks that it works by (4096 lanes; 64 chunks at most).
TEST(Compact, StableForAnySizeShareAndThreads) {
  const std::vector<std::size_t> sizes =
      kQuick ? std::vector<std::size_t>{0, 1, 2, 63, 4097, 20000, 300'007}
             : std::vector<std::size_t>{0, 1, 2, 63, 4095, 4096, 4097, 8192, 64 * 4096, 64 * 4096 + 1, 300'007};
  for (const std::size_t lanes : sizes)
    for (const unsigned share : {0u, 3u, 128u, 255u, 256u}) {
      if (kQuick && lanes > 20000 && share != 128) continue;
      const Queue queue = make_queue(lanes, share, lanes + share);
      for (const bool active : {false, true}) {
        SCOPED_TRACE(std::to_string(lanes) + " lanes, share " + std::to_string(share));
        expect_compacted(queue, active, {.threads = Threads::one});
        for (const std::size_t threads : {1u, 2u}) {
          const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
          expect_compacted(queue, active, {.threads = Threads::several});
        }
        if (HasFatalFailure()) return;
      }
    }
}

TEST(Compact, OutputsOnRequest) {
  const Queue queue = make_queue(1000, 100, 5);
  Compaction compaction;
  compaction.lanes = 1000;
  compaction.status = queue.status;
  const auto counted = compact(compaction);  // neither an index nor columns: a count
  ASSERT_TRUE(counted.ok());
  EXPECT_EQ(*counted, static_cast<std::size_t>(std::count(queue.status.begin(), queue.status.end(), kAccepted)));
  EXPECT_GT(*counted, 0u);
  EXPECT_EQ(*local_engine()->compact(compaction), *counted);
}

TEST(Compact, OneStatusForAllLanes) {
  std::vector<std::uint32_t> index(50);
  Compaction compaction;
  compaction.lanes = 50;
  compaction.index = index;
  compaction.status = kAccepted;
  EXPECT_EQ(*compact(compaction), 50u);
  EXPECT_EQ(index[49], 49u);
  compaction.status = std::uint8_t{3};
  EXPECT_EQ(*compact(compaction), 0u);
}

TEST(Compact, StridedStatus) {
  const Queue queue = make_queue(5000, 128, 6);
  std::vector<std::uint8_t> spread(5000 * 7, kAccepted);
  for (std::size_t lane = 0; lane < 5000; ++lane) spread[7 * lane] = queue.status[lane];
  std::vector<std::uint32_t> index(5000), expected(5000);
  Compaction compaction;
  compaction.lanes = 5000;
  compaction.status = queue.status;
  compaction.index = expected;
  const auto contiguous = compact(compaction);
  compaction.status = Column<std::uint8_t>(spread.data(), 5000, 7);
  compaction.index = index;
  EXPECT_EQ(*compact(compaction), *contiguous);
  EXPECT_EQ(index, expected);
}

// A wavefront's step: sample, keep what was accepted, and sample again on the list that came out.
TEST(Compact, IndexListIsTheNextCallsActiveList) {
  const Call call{Operation::sample_reflection, Sampler::ndf, Shadowing::correlated};
  const Lanes lanes = adversarial_lanes(20'000, 7);
  const Answer first = run_call(call, lanes);
  std::vector<std::uint32_t> index(lanes.count);
  Compaction compaction;
  compaction.lanes = lanes.count;
  compaction.status = first.status;
  compaction.index = index;
  const auto accepted = compact(compaction);
  ASSERT_TRUE(accepted.ok());
  EXPECT_EQ(*accepted, first.statistics.accepted);
  EXPECT_GT(*accepted, 1000u);
  Answer second;
  Batch batch = make_batch(call, lanes, second);
  batch.active = std::span<const std::uint32_t>(index).first(*accepted);
  const auto statistics = run(call.operation, batch);
  ASSERT_TRUE(statistics.ok());
  EXPECT_EQ(*statistics, (Statistics{.accepted = *accepted}));
}

}  // namespace
}  // namespace facetwise::test
