// SPDX-License-Identifier: Apache-2.0
// Calls that run while their caller goes on: the next batch is made while earlier ones are computed, or on their way to servers.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <future>
#include <mutex>
#include <thread>
#include <vector>

#include "absl/status/statusor.h"
#include "facetwise/engine.h"

namespace facetwise {

// An engine's calls as futures, at most `window` of them at once: one more waits in run() until another has ended, so that a
// stream of batches needs `window` sets of columns and no more. Any number of threads may share one.
//
//   AsyncEngine async(*engine, 2);
//   std::future<absl::StatusOr<Statistics>> pending[2];
//   for (int k = 0; more(); ++k) {                        // two sets of columns, in turn
//     if (pending[k % 2].valid()) use(columns[k % 2], pending[k % 2].get());
//     pending[k % 2] = async.run(Operation::sample_reflection, batch(columns[k % 2]));
//   }
class AsyncEngine {
 public:
  // `engine` must outlive it; window: 1 or more (less is taken as 1).
  explicit AsyncEngine(Engine& engine, int window = 4);
  ~AsyncEngine();  // when all calls have ended
  AsyncEngine(const AsyncEngine&) = delete;
  AsyncEngine& operator=(const AsyncEngine&) = delete;

  // As Engine's. What the batch or compaction refers to must stay as it is until the future is ready.
  std::future<absl::StatusOr<Statistics>> run(Operation operation, const Batch& batch);
  std::future<absl::StatusOr<std::size_t>> compact(const Compaction& compaction);

 private:
  template <class Result>
  std::future<Result> begin(std::function<Result()> call);
  void work();

  Engine& engine_;
  std::mutex mutex_;
  std::condition_variable begun_, ended_;
  std::deque<std::function<void()>> calls_;  // that no thread has taken
  std::size_t in_flight_ = 0;                // with those that have
  bool ends_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace facetwise
