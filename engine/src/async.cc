// SPDX-License-Identifier: Apache-2.0
#include "facetwise/async.h"

#include <algorithm>
#include <memory>
#include <utility>

namespace facetwise {

AsyncEngine::AsyncEngine(Engine& engine, int window) : engine_(engine) {
  for (int k = 0; k < std::max(window, 1); ++k) threads_.emplace_back([this] { work(); });
}

AsyncEngine::~AsyncEngine() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  begun_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void AsyncEngine::work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    begun_.wait(lock, [this] { return ends_ || !calls_.empty(); });
    if (calls_.empty()) return;
    const std::function<void()> call = std::exchange(calls_.front(), nullptr);
    calls_.pop_front();
    lock.unlock();
    call();
    lock.lock();
    --in_flight_;
    ended_.notify_one();
  }
}

template <class Result>
std::future<Result> AsyncEngine::begin(std::function<Result()> call) {
  // Shared, since a std::function is copied.
  const auto task = std::make_shared<std::packaged_task<Result()>>(std::move(call));
  {
    std::unique_lock lock(mutex_);
    ended_.wait(lock, [this] { return in_flight_ < threads_.size(); });
    ++in_flight_;
    calls_.emplace_back([task] { (*task)(); });
  }
  begun_.notify_one();
  return task->get_future();
}

std::future<absl::StatusOr<Statistics>> AsyncEngine::run(Operation operation, const Batch& batch) {
  return begin<absl::StatusOr<Statistics>>([this, operation, batch] { return engine_.run(operation, batch); });
}

std::future<absl::StatusOr<std::size_t>> AsyncEngine::compact(const Compaction& compaction) {
  return begin<absl::StatusOr<std::size_t>>([this, compaction] { return engine_.compact(compaction); });
}

}  // namespace facetwise
