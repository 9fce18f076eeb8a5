// SPDX-License-Identifier: Apache-2.0
// What the server's calls share, without gRPC: room, limits and turns, by many threads at once. ThreadSanitizer sees all of
// it, which it does not where gRPC, whose locks it does not know, hands a call from one thread to another.
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

#include "src/admission.h"
#include "src/compute.h"
#include "src/task.h"

namespace facetwise {
namespace {

using namespace std::chrono_literals;

Task<bool> room(Admission::Stay& stay) { co_return co_await stay.room(); }

Task<bool> computed(Compute& compute, std::size_t lanes, std::vector<std::atomic<int>>& seen, std::size_t stop_at) {
  co_await compute.turn(lanes > 100'000);
  const auto piece = [&](std::size_t begin, std::size_t end, const Execution&) {
    for (std::size_t lane = begin; lane < end; ++lane) seen[lane].fetch_add(1, std::memory_order_relaxed);
    return end < stop_at;
  };
  auto each = compute.each(lanes, piece);
  co_await each;
  co_return true;
}

TEST(Turns, EveryLaneOnceWhateverElseComputes) {
  Compute compute(3, {});
  std::vector<std::thread> callers;
  for (const std::size_t lanes : {0u, 1u, 1000u, 16'384u, 16'385u, 700'000u, 1'000'003u})
    callers.emplace_back([&compute, lanes] {
      for (int n = 0; n < 3; ++n) {
        std::vector<std::atomic<int>> seen(lanes);
        EXPECT_TRUE(wait_for(computed(compute, lanes, seen, lanes + 1)));
        for (const auto& count : seen) ASSERT_EQ(count, 1);
      }
    });
  for (std::thread& caller : callers) caller.join();
}

TEST(Turns, EndWhereACallNeedsNoMore) {
  Compute compute(2, {});
  constexpr std::size_t kLanes = 3'000'000;
  std::vector<std::atomic<int>> seen(kLanes);
  EXPECT_TRUE(wait_for(computed(compute, kLanes, seen, 1)));
  EXPECT_EQ(seen[0], 1);
  EXPECT_EQ(seen[kLanes - 1], 0);
}

// As a stream between two messages.
struct Pause {
  bool await_ready() const { return false; }
  void await_suspend(std::coroutine_handle<> call) { waiting = call; }
  void await_resume() const {}
  std::atomic<std::coroutine_handle<>> waiting{nullptr};
};

Task<bool> waits_after_a_turn(Compute& compute, Pause& pause) {
  co_await compute.turn(false);
  co_await pause;
  co_return true;
}

TEST(Turns, OfCallsThatWaitForTheirClientLeaveAllThreadsToOthers) {
  Compute compute(2, {});
  Pause pauses[2];
  std::vector<std::thread> idle;
  for (Pause& pause : pauses) idle.emplace_back([&] { EXPECT_TRUE(wait_for(waits_after_a_turn(compute, pause))); });
  for (Pause& pause : pauses)
    while (pause.waiting.load() == nullptr) std::this_thread::yield();
  while (!compute.idle()) std::this_thread::yield();
  // A long call is alone: its pieces are large, and on all threads.
  std::atomic<int> pieces = 0, spread = 0;
  const auto large = [&]() -> Task<bool> {
    co_await compute.turn(true);
    auto each = compute.each(2'000'000, [&](std::size_t, std::size_t, const Execution& execution) {
      ++pieces;
      spread += execution.threads != Threads::one;
      return true;
    });
    co_await each;
    co_return true;
  };
  EXPECT_TRUE(wait_for(large()));
  EXPECT_EQ(spread, pieces);
  EXPECT_EQ(pieces, 8);
  for (Pause& pause : pauses) pause.waiting.load().resume();
  for (std::thread& thread : idle) thread.join();
}

TEST(Room, IsNeverGivenToMoreThanFit) {
  // Half of 16 messages.
  Admission admission({.calls = 100, .open = 100, .bytes = 16'000, .message_bytes = 1000, .patience = 10s});
  std::atomic<int> inside = 0, most = 0, done = 0;
  std::vector<std::thread> callers;
  for (int n = 0; n < 20; ++n)
    callers.emplace_back([&] {
      for (int k = 0; k < 100; ++k) {
        Admission::Stay stay(
            admission, [] {}, "");
        ASSERT_TRUE(stay.enter().ok());
        ASSERT_TRUE(wait_for(room(stay)));
        const int now = ++inside;
        for (int before = most; now > before && !most.compare_exchange_weak(before, now);) {
        }
        std::this_thread::yield();
        --inside;
        stay.leave_room();
        ++done;
      }
    });
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(done, 2000);
  EXPECT_LE(most, 8);
  EXPECT_EQ(admission.load().open, 0);
}

TEST(Room, IsSharedBetweenPeers) {
  Admission admission({.calls = 100, .open = 100, .bytes = 16'000, .message_bytes = 1000, .patience = 10s});
  std::vector<std::unique_ptr<Admission::Stay>> greedy;
  for (int n = 0; n < 4; ++n) {
    greedy.push_back(std::make_unique<Admission::Stay>(
        admission, [] {}, "greedy"));
    ASSERT_TRUE(greedy.back()->enter().ok() && wait_for(room(*greedy.back())));
  }
  // Its fifth waits, though there is room: another's does not.
  Admission::Stay fifth(
      admission, [] {}, "greedy"),
      other(
          admission, [] {}, "other");
  ASSERT_TRUE(fifth.enter().ok() && other.enter().ok());
  std::atomic<bool> has_room = false;
  std::thread waits([&] { has_room = wait_for(room(fifth)); });
  EXPECT_TRUE(wait_for(room(other)));
  EXPECT_FALSE(has_room);
  greedy.pop_back();
  waits.join();
  EXPECT_TRUE(has_room);
}

TEST(Room, CancelledCallsGoOnWithoutIt) {
  Admission admission({.calls = 100, .open = 100, .bytes = 5000, .message_bytes = 1000, .patience = 10s});
  Admission::Stay first(
      admission, [] {}, ""),
      second(
          admission, [] {}, "");
  ASSERT_TRUE(first.enter().ok() && second.enter().ok() && wait_for(room(first)));
  std::thread waits([&] { EXPECT_FALSE(wait_for(room(second))); });
  std::this_thread::sleep_for(20ms);
  second.cancelled();
  waits.join();
  EXPECT_FALSE(wait_for(room(second))) << "nor later";
}

// Who waits longest for its client is cancelled when another wants room; who computes is not.
TEST(Room, IsTakenFromThoseThatWaitForTheirClient) {
  Admission admission({.calls = 100, .open = 100, .bytes = 5000, .message_bytes = 1000, .patience = 50ms});
  std::atomic<int> cancelled = 0;
  {
    Admission::Stay idle(
        admission, [&] { ++cancelled; }, "");
    ASSERT_TRUE(idle.enter().ok() && wait_for(room(idle)));
    const Admission::Waiting waiting(idle, Admission::Client::sends, 100s);
    std::this_thread::sleep_for(200ms);
    EXPECT_EQ(cancelled, 0) << "nobody wants it";
    Admission::Stay wants(
        admission, [] {}, "");
    ASSERT_TRUE(wants.enter().ok());
    std::thread waits([&] { EXPECT_TRUE(wait_for(room(wants))); });
    while (cancelled == 0) std::this_thread::sleep_for(1ms);
    idle.cancelled();
    idle.leave_room();
    waits.join();
    EXPECT_EQ(cancelled, 1);
  }
  // Too long by itself.
  Admission::Stay slow(
      admission, [&] { ++cancelled; }, "");
  const Admission::Waiting waiting(slow, Admission::Client::receives, 1ms);
  while (cancelled == 1) std::this_thread::sleep_for(1ms);
}

TEST(Limits, HoldWhatTheySay) {
  Admission admission({.calls = 1, .open = 2, .bytes = 5000, .message_bytes = 1000, .patience = 10s});
  Admission::Stay one(
      admission, [] {}, ""),
      two(
          admission, [] {}, ""),
      three(
          admission, [] {}, "");
  EXPECT_TRUE(one.enter().ok() && two.enter().ok());
  EXPECT_EQ(three.enter().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE(one.work().ok());
  EXPECT_EQ(two.work().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE(one.hold(3000).ok());
  EXPECT_EQ(two.hold(1001).code(), absl::StatusCode::kResourceExhausted);
  one.hold_no_more_than(2999);
  EXPECT_TRUE(two.hold(1001).ok());
  one.release();
  EXPECT_TRUE(two.work().ok());
  admission.close();
  EXPECT_EQ(three.enter().code(), absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace facetwise
