// SPDX-License-Identifier: Apache-2.0
// How near the drawn slopes are to the visible ones, by size of table; printed for docs/tables.md.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <string>

#include "gtest/gtest.h"
#include "support/counts.h"
#include "table/cells.h"
#include "table/densities.h"

namespace facetwise::test {
namespace {

constexpr double kIncidence[][2] = {{0, 0}, {0.4, 0.7}, {0.9, 2.1}, {1.3, 3.6}, {1.55, 5.1}, {1.9, 0.2}, {2.6, 1.5}};

// Less than that a test of 2 10^5 samples pools.
constexpr double kSmallestCell = 5e-5;

struct Accuracy {
  double distance = 0;  // chi-square, over 256 cells: how much a test grows by each sample, at most
  double variance = 0;  // of the weight visible / drawn, at most
  double area = 0;      // relative error of the tabulated area, at most
};

Accuracy measure(const SlopeTable& table, const SlopeDensity& p22) {
  Accuracy accuracy;
  for (const auto& incidence : kIncidence) {
    const double theta = incidence[0], phi = incidence[1];
    const Cells cells(theta, phi);
    auto exact = cells.visible(p22, 16);
    const double area = std::accumulate(exact.begin(), exact.end(), 0.0);
    const auto drawn = cells.integrals([&](double x, double y) { return table.drawn_density(theta, phi, x, y); }, 16);
    double distance = 0;
    for (std::size_t k = 0; k < exact.size(); ++k)
      if (exact[k] > kSmallestCell * area) distance += std::pow(drawn[k] - exact[k] / area, 2) / (exact[k] / area);
    const double c = std::cos(theta), s = std::sin(theta);
    const auto squares = cells.integrals(
        [&](double x, double y) {
          const double seen = std::max(c - s * (std::cos(phi) * x + std::sin(phi) * y), 0.0) * p22(x, y) / area;
          return seen * seen / table.drawn_density(theta, phi, x, y);
        },
        16);
    accuracy.distance = std::max(accuracy.distance, distance);
    accuracy.variance = std::max(accuracy.variance, std::accumulate(squares.begin(), squares.end(), 0.0) - 1);
    accuracy.area =
        std::max(accuracy.area, std::abs(table.tabulated_area(theta, phi) / table.projected_area(theta, phi) - 1));
  }
  return accuracy;
}

void report(const char* name, const SlopeDensity& p22, const SlopeTable::Options& options) {
  const auto start = std::chrono::steady_clock::now();
  const auto table = build(p22, options);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const Accuracy accuracy = measure(*table, p22);
  const SlopeTableView& v = table->view();
  std::printf("| %s | %d x %d x %d x %d | %.2f MB | %.2f s | %.1e | %.1e | %.1e |\n", name, v.azimuths, v.incidence,
              v.slopes, v.uniforms, static_cast<double>(table->bytes()) / 1e6, seconds, accuracy.distance,
              accuracy.variance, accuracy.area);
}

TEST(Accuracy, Printed) {
  if (!long_run()) GTEST_SKIP() << "FACETWISE_LONG=1 prints docs/tables.md's table";
  for (const std::uint32_t n : {16u, 32u, 64u, 128u})
    for (const bool is_ggx : {true, false})
      report(is_ggx ? "GGX" : "Beckmann", is_ggx ? ggx : beckmann,
             {.radial = true, .incidence = n + 1, .slopes = n + 1, .uniforms = n});
  report("GGX", ggx, {.radial = true});
  report("Beckmann", beckmann, {.radial = true});
  // 128: the default.
  for (const std::uint32_t n : {16u, 32u, 64u, 128u, 256u})
    report("skewed", skewed, {.incidence = n / 2 + 1, .slopes = n + 1, .uniforms = n, .azimuths = n});
}

}  // namespace
}  // namespace facetwise::test
