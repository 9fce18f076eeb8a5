// SPDX-License-Identifier: Apache-2.0
// Long computations that tell how far they are.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <mutex>

#include "src/float_environment.h"
#include "src/tasks.h"

namespace facetwise {

// Runs bodies in parallel and tells how far they are.
class Work {
 public:
  Work(const std::function<void(double)>& progress, double total) : progress_(progress), total_(total) {}

  template <class Body>
  void each(std::size_t n, double cost, const Body& body) {
    for_each_part(n, [&](std::size_t begin, std::size_t end) {
      const FloatEnvironment environment;
      for (std::size_t k = begin; k < end; ++k) {
        body(k);
        tell(cost);
      }
    });
  }

 private:
  void tell(double cost) {
    if (!progress_) return;
    const std::lock_guard lock(mutex_);
    done_ += cost;
    if (done_ < told_ + total_ / 100) return;
    told_ = done_;
    progress_(std::min(done_ / total_, 1.0));
  }

  const std::function<void(double)>& progress_;
  std::mutex mutex_;
  double total_, done_ = 0, told_ = 0;
};

}  // namespace facetwise
