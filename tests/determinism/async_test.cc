// SPDX-License-Identifier: Apache-2.0
// Calls as futures: the same answers as calls, no more at once than the window, and none left behind.
#include "facetwise/async.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

namespace facetwise::test {
namespace {

constexpr std::size_t kLanes = 1000;

Batch batch_of(std::uint64_t seed, std::vector<float>& weight) {
  weight.assign(kLanes, -1);
  Batch batch;
  batch.lanes = kLanes;
  batch.incident = {0.6f, 0.0f, 0.8f};
  batch.alpha_x = batch.alpha_y = 0.5f;
  batch.generator = {.seed = seed};
  batch.out.weight = weight;
  return batch;
}

// Counts how many calls run at once, each for a while.
class CountingEngine final : public Engine {
 public:
  absl::StatusOr<Statistics> run(Operation operation, const Batch& batch) override {
    const int now = ++at_once;
    for (int most = most_at_once; now > most && !most_at_once.compare_exchange_weak(most, now);) {
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    auto result = engine_->run(operation, batch);
    --at_once;
    ++calls;
    return result;
  }
  absl::StatusOr<std::size_t> compact(const Compaction& compaction) override { return engine_->compact(compaction); }

  std::atomic<int> at_once = 0, most_at_once = 0, calls = 0;

 private:
  const std::unique_ptr<Engine> engine_ = local_engine();
};

TEST(Async, AnswersAreThoseOfCalls) {
  CountingEngine engine;
  {
    AsyncEngine async(engine, 3);
    std::vector<std::thread> callers;
    for (int caller = 0; caller < 4; ++caller)
      callers.emplace_back([&, caller] {
        std::vector<std::vector<float>> weights(25);
        std::vector<std::future<absl::StatusOr<Statistics>>> pending;
        for (int k = 0; k < 25; ++k)
          pending.push_back(async.run(Operation::sample_reflection, batch_of(25 * caller + k, weights[k])));
        for (int k = 0; k < 25; ++k) {
          std::vector<float> wanted;
          const auto statistics = sample_reflection(batch_of(25 * caller + k, wanted));
          const auto got = pending[k].get();
          ASSERT_TRUE(got.ok() && statistics.ok());
          EXPECT_EQ(*got, *statistics);
          EXPECT_EQ(weights[k], wanted);
        }
      });
    for (std::thread& caller : callers) caller.join();
  }
  EXPECT_EQ(engine.calls, 100);
  EXPECT_LE(engine.most_at_once, 3);
  EXPECT_GE(engine.most_at_once, 2);
}

TEST(Async, EndsWhenAllCallsHave) {
  CountingEngine engine;
  std::vector<float> weights[5];
  std::future<absl::StatusOr<Statistics>> last;
  {
    AsyncEngine async(engine, 5);
    for (auto& weight : weights) last = async.run(Operation::sample_reflection, batch_of(1, weight));
  }
  EXPECT_EQ(engine.calls, 5);
  EXPECT_EQ(last.wait_for(std::chrono::seconds(0)), std::future_status::ready);
  for (const auto& weight : weights) EXPECT_EQ(weight, weights[0]);
}

TEST(Async, ErrorsAndCompactionCome) {
  CountingEngine engine;
  AsyncEngine async(engine, 0);  // taken as 1
  std::vector<float> weight;
  Batch bad = batch_of(1, weight);
  bad.alpha_x = {weight.data(), 7};
  EXPECT_EQ(async.run(Operation::sample_reflection, bad).get().status().message(), "alpha_x: 7 values for 1000 lanes");
  const std::uint8_t status[] = {0, 1, 0};
  std::uint32_t index[3] = {};
  Compaction compaction;
  compaction.lanes = 3;
  compaction.status = {status, 3};
  compaction.index = {index, 3};
  EXPECT_EQ(async.compact(compaction).get().value(), 2u);
  EXPECT_EQ(index[1], 2u);
}

}  // namespace
}  // namespace facetwise::test
