// SPDX-License-Identifier: Apache-2.0
#include "table/densities.h"

#include <cmath>
#include <numbers>

#include "gtest/gtest.h"
#include "support/counts.h"

namespace facetwise::test {

double ggx(double x, double y) {
  const double t = 1 + x * x + y * y;
  return 1 / (std::numbers::pi * t * t);
}

double beckmann(double x, double y) { return std::exp(-(x * x + y * y)) / std::numbers::pi; }

double skewed(double x, double y) {
  const double a = (x + 0.3 * y - 0.2) / 0.8, b = (y + 0.1) / 0.5;
  const double body = std::exp(-std::pow(a * a + b * b + 0.05, 0.8)) * (1.3 + std::tanh(2 * x + y));
  const double tail = 0.15 * std::pow(1 + x * x + 2 * y * y, -2.2) * (1 + 0.5 * y / std::sqrt(1 + y * y));
  return body + tail;
}

std::shared_ptr<const SlopeTable> build(const SlopeDensity& p22, const SlopeTable::Options& options) {
  auto table = SlopeTable::build(p22, options);
  EXPECT_TRUE(table.ok()) << table.status();
  return table.ok() ? *table : nullptr;
}

const SlopeTable& ggx_table() {
  static const auto table = build(ggx, {.radial = true});
  return *table;
}
const SlopeTable& beckmann_table() {
  static const auto table = build(beckmann, {.radial = true});
  return *table;
}
const SlopeTable& skewed_table() {
  // An emulator would take a minute for the default.
  static const SlopeTable::Options small{.grid = 257, .incidence = 33, .slopes = 65, .uniforms = 64, .azimuths = 64};
  static const auto table = build(skewed, kQuick ? small : SlopeTable::Options{});
  return *table;
}
const SlopeTable& coarse_table() {
  static const auto table = build(skewed, {.grid = 65, .incidence = 9, .slopes = 9, .uniforms = 32, .azimuths = 4});
  return *table;
}

}  // namespace facetwise::test
