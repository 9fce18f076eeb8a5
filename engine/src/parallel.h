// SPDX-License-Identifier: Apache-2.0
// How a call's lanes spread over threads.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>

#include "facetwise/target.h"
#include "src/tasks.h"

namespace facetwise {

// Fewer lanes than these (some microseconds) stay on their thread.
inline constexpr std::size_t kLanesWorthThreads = 8192;

// Whether a call spreads over threads. TBB's threads look for work for about 130 microseconds, then sleep, and waking
// one takes 30 or more. So calls that are done sooner, of fewer lanes than `worth_waking`, spread if the last call that
// could have spread ended a moment ago: in a loop all but the first do.
class Threading {
 public:
  Threading(std::size_t positions, std::size_t worth_waking, const Execution& execution)
      : may_spread_(execution.threads != Threads::one && positions > kLanesWorthThreads),
        spreads_(may_spread_ && (execution.threads == Threads::several || positions > worth_waking || awake())) {}
  ~Threading() {
    if (may_spread_) last_end_.store(Clock::now().time_since_epoch().count(), std::memory_order_relaxed);
  }
  Threading(const Threading&) = delete;
  Threading& operator=(const Threading&) = delete;

  bool spreads() const { return spreads_; }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::microseconds kAwake{120};
  static bool awake() {
    const Clock::duration last_end{last_end_.load(std::memory_order_relaxed)};
    return Clock::now().time_since_epoch() - last_end < kAwake;
  }
  static inline std::atomic<Clock::rep> last_end_{0};
  const bool may_spread_, spreads_;
};

// Calls body(begin, end) on ranges that make up [0, positions), in the caller's TBB arena. Ranges but the first begin
// at `head` and a multiple of kUnit lanes: whole vectors of every target.
template <class Body>
void for_each_range(std::size_t positions, std::size_t head, const Body& body) {
  constexpr std::size_t kUnit = 2048;  // small, so that a thread that wakes up late still finds work
  const std::size_t units = (positions - head + kUnit - 1) / kUnit;
  for_each_part(units, [&](std::size_t first, std::size_t last) {
    const std::size_t end = head + last * kUnit;
    body(first == 0 ? 0 : head + first * kUnit, end < positions ? end : positions);
  });
}

}  // namespace facetwise
