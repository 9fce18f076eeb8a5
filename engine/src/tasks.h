// SPDX-License-Identifier: Apache-2.0
// The threads that the library has: oneTBB's (tasks_tbb.cc), or the caller's alone where it is built without (tasks_alone.cc).
#pragma once

#include <cstddef>

#include "absl/functional/function_ref.h"

namespace facetwise {

// Calls body(begin, end) on ranges that make up [0, n), at once on the threads of the caller's TBB arena.
void for_each_part(std::size_t n, absl::FunctionRef<void(std::size_t, std::size_t)> body);

// Calls `body`; while it waits for its parts, its thread takes up no other task of the caller's.
void isolated(absl::FunctionRef<void()> body);

// Calls `body` in an arena of that many threads.
void with_threads(std::size_t threads, absl::FunctionRef<void()> body);

}  // namespace facetwise
