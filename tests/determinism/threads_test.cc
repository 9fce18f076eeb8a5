// SPDX-License-Identifier: Apache-2.0
// Threads change nothing: neither how many, nor whose arena, nor other calls at the same time.
#include <thread>

#include "determinism/compare.h"
#include "support/counts.h"
#include "support/hard_lanes.h"
#include "tbb/global_control.h"
#include "tbb/parallel_for.h"
#include "tbb/task_arena.h"

namespace facetwise::test {
namespace {

// Many of the ranges that calls are cut into, and an odd rest.
const std::size_t kLanes = kQuick ? 9'011 : 100'003;

TEST(Threads, AnyNumber) {
  const Lanes lanes = hard_lanes(Kind::mixed, kLanes, 61);
  std::vector<std::uint32_t> active;  // backwards
  for (std::size_t lane = kLanes; lane-- > 0;)
    if (lane % 3 != 0) active.push_back(static_cast<std::uint32_t>(lane));
  for (const Call& call : all_calls()) {
    const Answer expected = compute(call, lanes, {.threads = Threads::one});
    EXPECT_EQ(expected.statistics, recount(expected.status)) << call_name(call);
    for (const std::size_t threads : {1u, 2u, 5u}) {
      SCOPED_TRACE(std::to_string(threads) + " threads");
      const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
      expect_same(call, expected, compute(call, lanes, {.threads = Threads::several}));

      Answer got;
      Batch batch = make_batch(call, lanes, got);
      batch.active = active;
      const Statistics statistics = run_ok(call, batch, {.threads = Threads::several});
      std::vector<std::uint8_t> status;
      for (const std::uint32_t lane : active) {
        expect_same_lane(call, expected, lane, got, lane);
        status.push_back(got.status[lane]);
      }
      EXPECT_EQ(statistics, recount(status)) << call_name(call);
    }
    if (HasFailure()) return;
  }
}

TEST(Threads, CallersArena) {
  const Lanes lanes = hard_lanes(Kind::mixed, kLanes, 62);
  for (const Call& call : all_calls()) {
    const Answer expected = compute(call, lanes, {.threads = Threads::one});
    for (const int threads : {1, 2}) {
      tbb::task_arena arena(threads);
      arena.execute([&] { expect_same(call, expected, compute(call, lanes, {.threads = Threads::several})); });
    }
  }
}

// Calls share nothing: many at once, from tasks of the caller's and from its threads.
TEST(Threads, ConcurrentCalls) {
  const Lanes lanes = hard_lanes(Kind::mixed, 9000, 63);
  const auto& calls = all_calls();
  std::vector<Answer> expected, got(calls.size());
  for (const Call& call : calls) expected.push_back(compute(call, lanes, {.threads = Threads::one}));
  tbb::parallel_for(std::size_t{0}, calls.size(), [&](std::size_t k) { got[k] = compute(calls[k], lanes); });
  for (std::size_t k = 0; k < calls.size(); ++k) expect_same(calls[k], expected[k], got[k]);

  got = std::vector<Answer>(calls.size());
  std::vector<std::thread> threads;
  for (std::size_t first = 0; first < 3; ++first)
    threads.emplace_back([&, first] {
      for (std::size_t k = first; k < calls.size(); k += 3) got[k] = compute(calls[k], lanes);
    });
  for (auto& thread : threads) thread.join();
  for (std::size_t k = 0; k < calls.size(); ++k) expect_same(calls[k], expected[k], got[k]);
}

}  // namespace
}  // namespace facetwise::test
