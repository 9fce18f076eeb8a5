// SPDX-License-Identifier: Apache-2.0
#include "app/load.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>
#include <thread>

#include "app/errors.h"

namespace facetwise::app {
namespace {

using Clock = std::chrono::steady_clock;

// sample_reflection by `bounded`, every input a column, pdf and direction back: what a renderer sends.
class Call {
 public:
  explicit Call(std::size_t lanes) : columns_(11, std::vector<float>(lanes)) {
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      const float t = (static_cast<float>(lane) + 0.5f) / static_cast<float>(lanes);
      const float values[] = {std::sqrt(1 - t * t), 0, t, 0.1f + 0.8f * t, 0.9f - 0.8f * t, t, 1 - t};
      for (std::size_t k = 0; k < std::size(values); ++k) columns_[k][lane] = values[k];
    }
    batch_.lanes = lanes;
    batch_.sampler = Sampler::bounded;
    batch_.incident = {columns_[0], columns_[1], columns_[2]};
    batch_.alpha_x = columns_[3], batch_.alpha_y = columns_[4];
    batch_.u1 = columns_[5], batch_.u2 = columns_[6];
    batch_.out.outgoing = {columns_[7], columns_[8], columns_[9]};
    batch_.out.pdf = columns_[10];
  }
  absl::Status run(Engine& engine) const { return engine.sample_reflection(batch_).status(); }

 private:
  std::vector<std::vector<float>> columns_;
  Batch batch_;
};

}  // namespace

double LoadResult::percentile(double p) const {
  if (microseconds.empty()) return 0;
  const auto rank = static_cast<std::size_t>(std::ceil(p * static_cast<double>(microseconds.size())));
  return microseconds[std::clamp<std::size_t>(rank, 1, microseconds.size()) - 1];
}

absl::StatusOr<LoadResult> run_load(const LoadOptions& options, const std::function<void(double)>& progress,
                                    const std::atomic<bool>& stop) {
  std::vector<std::unique_ptr<Engine>> engines;
  for (int n = 0; n < options.connections + options.beside; ++n) {
    auto engine = connect(options.servers, options.connection);
    if (!engine.ok()) return engine.status();
    engines.push_back(*std::move(engine));
  }
  const auto count = static_cast<std::size_t>(std::ceil(options.rate * options.seconds));
  LoadResult result;
  std::mutex mutex;  // of the result
  std::atomic<std::size_t> next = 0;
  std::atomic<bool> over = false;
  std::vector<std::thread> callers, beside;
  const Call first(options.lanes);
  for (int n = 0; n < options.connections; ++n)  // what is slow only once
    if (auto status = first.run(*engines[static_cast<std::size_t>(n)]); !status.ok()) return status;

  std::atomic<std::size_t> beside_calls = 0;
  std::atomic<int> at_work = 0;
  for (int n = 0; n < options.beside; ++n)
    beside.emplace_back([&, engine = engines[static_cast<std::size_t>(options.connections + n)].get()] {
      const Call call(options.beside_lanes);
      bool answered = call.run(*engine).ok();
      ++at_work;
      for (; !over && answered; ++beside_calls) answered = call.run(*engine).ok();
    });
  while (at_work < options.beside && !stop) std::this_thread::sleep_for(std::chrono::milliseconds(10));

  const std::size_t beside_before = beside_calls;
  const auto begin = Clock::now();
  const auto due = [&](std::size_t k) {
    return begin + std::chrono::duration_cast<Clock::duration>(
                       std::chrono::duration<double>(static_cast<double>(k) / options.rate));
  };
  for (int n = 0; n < options.connections; ++n)
    callers.emplace_back([&, engine = engines[static_cast<std::size_t>(n)].get()] {
      const Call call(options.lanes);
      for (std::size_t k; !stop && (k = next++) < count;) {
        std::this_thread::sleep_until(due(k));
        const auto status = call.run(*engine);
        const double taken = std::chrono::duration<double, std::micro>(Clock::now() - due(k)).count();
        const std::lock_guard lock(mutex);
        if (status.ok()) {
          result.microseconds.push_back(taken);
        } else if (result.failed++ == 0) {
          result.error = message(status);
        }
      }
    });
  while (!stop && next < count + static_cast<std::size_t>(options.connections)) {
    progress(std::min(1.0, static_cast<double>(next) / static_cast<double>(count)));
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  for (std::thread& caller : callers) caller.join();
  result.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  result.beside_lanes_per_second =
      static_cast<double>((beside_calls - beside_before) * options.beside_lanes) / result.seconds;
  over = true;
  for (std::thread& caller : beside) caller.join();
  progress(1);
  std::sort(result.microseconds.begin(), result.microseconds.end());
  return result;
}

}  // namespace facetwise::app
