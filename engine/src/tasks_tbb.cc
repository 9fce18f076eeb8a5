// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "src/tasks.h"
#include "tbb/blocked_range.h"
#include "tbb/parallel_for.h"
#include "tbb/task_arena.h"

namespace facetwise {

void for_each_part(std::size_t n, absl::FunctionRef<void(std::size_t, std::size_t)> body) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n),
                    [body](const auto& range) { body(range.begin(), range.end()); });
}

void isolated(absl::FunctionRef<void()> body) { tbb::this_task_arena::isolate(body); }

void with_threads(std::size_t threads, absl::FunctionRef<void()> body) {
  tbb::task_arena(static_cast<int>(std::min<std::size_t>(threads, 1024))).execute(body);
}

}  // namespace facetwise
