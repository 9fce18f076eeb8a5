// SPDX-License-Identifier: Apache-2.0
// The machine's limits: copying the same columns, and peak of fused multiply-adds.
#pragma once

#include <functional>

#include "columns.h"
#include "facetwise/bench.h"

namespace facetwise::bench {

inline constexpr int kCopyOrders = 3;
enum class CopyOrder {
  one_by_one,    // column after column: memcpy, and a sum over those that are only read
  side_by_side,  // a vector of each column at a time, as the kernels do
  streaming,     // the same with stores past the caches: quicker beyond them, slower inside
};

// Reads `inputs` columns and writes `outputs` of them (no more than inputs), once, over `batch` lanes (a
// multiple of 16), on one thread or on all of the caller's arena.
std::function<void()> make_copy(const Columns& columns, int inputs, int outputs, std::size_t batch, Target target,
                                bool all_threads, CopyOrder order);

// Peak of `threads` threads that multiply and add at once: the best of a few short runs.
FmaLimit measure_fma(Target target, int threads);

}  // namespace facetwise::bench
