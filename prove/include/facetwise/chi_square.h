// SPDX-License-Identifier: Apache-2.0
// Pearson's chi-square test of counts against expected counts.
#pragma once

#include <cstdint>
#include <span>

namespace facetwise {

// Q(a, x) = Gamma(a, x) / Gamma(a), a > 0, x >= 0; relative error below 1e-10.
double upper_incomplete_gamma(double a, double x);

struct ChiSquare {
  double statistic = 0;
  int degrees = 0;     // of freedom: cells after pooling, less one
  double p_value = 1;  // 1 where no degree of freedom is left
};

// Cells that expect less than `smallest` are pooled. Both spans have one value per cell, every sample is in
// one of the cells, and sum(expected) = sum(counts) up to rounding.
ChiSquare chi_square(std::span<const std::uint64_t> counts, std::span<const double> expected, double smallest = 10);

// The level of each of `tests` independent tests with which any of them fails a right hypothesis with
// probability `any`.
double sidak(double any, int tests);

}  // namespace facetwise
