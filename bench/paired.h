// SPDX-License-Identifier: Apache-2.0
// Ratios of times that hold on a noisy machine: both are measured in turn, A B B A, and the median of the
// rounds' ratios is taken. Rounds are short, so that what disturbs them seldom hits only one side, and their
// order turns, so that nothing periodic always hits the same one.
#pragma once

#include <algorithm>
#include <chrono>
#include <vector>

namespace facetwise::bench {

struct Paired {
  double a = 0, b = 0;  // median seconds of one call
  double ratio = 0;     // median of a / b
};

inline double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Seconds of one call, over `calls` calls.
template <class Clock = std::chrono::steady_clock, class Call>
double time_calls(const Call& call, int calls) {
  const auto start = Clock::now();
  for (int k = 0; k < calls; ++k) call();
  return std::chrono::duration<double>(Clock::now() - start).count() / calls;
}

// Calls that take `seconds`, at least one.
template <class Clock = std::chrono::steady_clock, class Call>
int calls_for(const Call& call, double seconds) {
  call();
  const double once = std::max(time_calls<Clock>(call, 1), 1e-9);
  const int trial = static_cast<int>(std::clamp(seconds / once / 4, 1.0, 1e6));
  return static_cast<int>(std::clamp(seconds / time_calls<Clock>(call, trial), 1.0, 1e6));
}

// Each side runs `seconds` a round, but at least once. `rounds` is odd.
template <class Clock = std::chrono::steady_clock, class A, class B>
Paired measure_paired(const A& a, const B& b, int rounds, double seconds) {
  const int calls_a = calls_for<Clock>(a, seconds), calls_b = calls_for<Clock>(b, seconds);
  std::vector<double> times_a, times_b, ratios;
  for (int round = 0; round < rounds; ++round) {
    if (round % 2 == 0) times_a.push_back(time_calls<Clock>(a, calls_a));
    times_b.push_back(time_calls<Clock>(b, calls_b));
    if (round % 2 != 0) times_a.push_back(time_calls<Clock>(a, calls_a));
    ratios.push_back(times_a.back() / times_b.back());
  }
  return {median_of(times_a), median_of(times_b), median_of(ratios)};
}

}  // namespace facetwise::bench
