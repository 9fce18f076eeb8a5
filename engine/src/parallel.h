// How a call's lanes spread over threads.
#pragma once

#include <cstddef>

#include "facetwise/target.h"
#include "tbb/blocked_range.h"
#include "tbb/parallel_for.h"

namespace facetwise {

// Below this many lanes (some microseconds) a call stays on its thread.
inline constexpr std::size_t kLanesWorthThreads = 8192;

inline bool stays_on_thread(std::size_t positions, const Execution& execution) {
  return execution.single_thread || positions <= kLanesWorthThreads;
}

// Calls body(begin, end) on ranges that make up [0, positions), in the caller's TBB arena. Ranges but the first begin
// at `head` and a multiple of kUnit lanes: whole vectors of every target.
template <class Body>
void for_each_range(std::size_t positions, std::size_t head, const Body& body) {
  constexpr std::size_t kUnit = 2048;  // small, so that a thread that wakes up late still finds work
  const std::size_t units = (positions - head + kUnit - 1) / kUnit;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, units), [&](const auto& range) {
    const std::size_t end = head + range.end() * kUnit;
    body(range.begin() == 0 ? 0 : head + range.begin() * kUnit, end < positions ? end : positions);
  });
}

}  // namespace facetwise
