// SPDX-License-Identifier: Apache-2.0
#include "machine_limits.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <barrier>
#include <chrono>
#include <cstring>
#include <thread>
#include <vector>

#include "peak.h"

namespace facetwise::bench {
namespace {

struct Copy {
  const float* inputs[kMostColumns];
  float* outputs[kMostColumns];
  int input_count, output_count;
  Target target;
  CopyOrder order;

  void run(std::size_t begin, std::size_t end) const {
    if (order != CopyOrder::one_by_one) {
      copy_columns(target, inputs, input_count, outputs, output_count, begin, end, order == CopyOrder::streaming);
      return;
    }
    for (int k = 0; k < output_count; ++k)
      std::memcpy(outputs[k] + begin, inputs[k] + begin, (end - begin) * sizeof(float));
    float sum = 0;
    for (int k = output_count; k < input_count; ++k) sum += read_column(target, inputs[k], begin, end);
    static std::atomic<float> sink;
    sink.store(sum, std::memory_order_relaxed);
  }
};

}  // namespace

std::function<void()> make_copy(const Columns& columns, int inputs, int outputs, std::size_t batch, Target target,
                                bool all_threads, CopyOrder order) {
  Copy copy{};
  for (int k = 0; k < inputs; ++k) copy.inputs[k] = columns.input(k);
  for (int k = 0; k < outputs; ++k) copy.outputs[k] = columns.output(k);
  copy.input_count = inputs;
  copy.output_count = outputs;
  copy.target = target;
  copy.order = order;
  constexpr std::size_t kUnit = 1024;
  if (!all_threads || batch < 2 * kUnit) return [copy, batch] { copy.run(0, batch); };
  return [copy, batch] {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, (batch + kUnit - 1) / kUnit, 8), [&](const auto& range) {
      copy.run(range.begin() * kUnit, std::min(range.end() * kUnit, batch));
    });
  };
}

FmaLimit measure_fma(Target target, int threads) {
  using Clock = std::chrono::steady_clock;
  constexpr std::uint64_t kRounds = 2'000'000;  // some milliseconds
  constexpr int kRuns = 9;
  FmaLimit limit{.target = target, .threads = threads, .flops_per_second = 0};
  std::vector<double> rates(static_cast<std::size_t>(threads) * kRuns);
  std::barrier together(threads);
  const auto work = [&](int thread) {
    for (int run = 0; run < kRuns; ++run) {
      together.arrive_and_wait();
      float sink = 0;
      const auto start = Clock::now();
      const std::uint64_t flops = multiply_add(target, kRounds, sink);
      const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
      // The sum is finite, and looking at it keeps the work.
      rates[static_cast<std::size_t>(run * threads + thread)] = sink < 1e9f ? static_cast<double>(flops) / seconds : 0;
    }
  };
  {
    std::vector<std::jthread> workers;
    for (int thread = 1; thread < threads; ++thread) workers.emplace_back(work, thread);
    work(0);
  }
  for (int run = 0; run < kRuns; ++run) {
    double sum = 0;
    for (int thread = 0; thread < threads; ++thread) sum += rates[static_cast<std::size_t>(run * threads + thread)];
    limit.flops_per_second = std::max(limit.flops_per_second, sum);
  }
  return limit;
}

}  // namespace facetwise::bench
