// SPDX-License-Identifier: Apache-2.0
// What the machine can do, with the same instructions as the kernels: fused multiply-adds, and reading and
// writing columns side by side.
#pragma once

#include <cstddef>
#include <cstdint>

#include "facetwise/target.h"

namespace facetwise::bench {

// Does `rounds` rounds of independent chains of fused multiply-adds; returns the floating-point operations
// done (a fused multiply-add is two). `sink` receives the chains' sum, so that nothing is left out.
std::uint64_t multiply_add(Target target, std::uint64_t rounds, float& sink);

// The most columns of copy_columns().
inline constexpr int kMostColumns = 16;

// Reads lanes [begin, end) of every input column and writes every output column, one vector of each at a time
// as the kernels do: outputs[k] = inputs[k], and the last output is the sum of the inputs that remain.
// begin and end are multiples of 16. `streaming`: stores go past the caches, on x86; outputs begin at cache lines.
void copy_columns(Target target, const float* const* inputs, int input_count, float* const* outputs, int output_count,
                  std::size_t begin, std::size_t end, bool streaming);

// Reads [begin, end), multiples of 16; returns the sum.
float read_column(Target target, const float* column, std::size_t begin, std::size_t end);

}  // namespace facetwise::bench
