// SPDX-License-Identifier: Apache-2.0
// What a table holds: the density, normalised, and its projected area; and what is refused.
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "gtest/gtest.h"
#include "support/counts.h"
#include "table/densities.h"

namespace facetwise::test {
namespace {

using std::numbers::pi;

TEST(SlopeTable, GgxIsExact) {
  const SlopeTable& table = ggx_table();
  for (const double x : {0.0, 0.3, -2.0, 50.0, 3000.0})
    for (const double y : {0.0, -0.7, 9.0}) EXPECT_NEAR(table.p22(x, y) / ggx(x, y), 1, 1e-6) << x << " " << y;
  for (double theta = 0; theta < 3.14; theta += 0.1) {
    const double area = (1 + std::cos(theta)) / 2;
    EXPECT_NEAR(table.projected_area(theta, 0.3) / area, 1, 5e-6) << theta;
    EXPECT_NEAR(table.tabulated_area(theta, 0.3) / area, 1, 5e-6) << theta;
  }
}

TEST(SlopeTable, BeckmannsArea) {
  const SlopeTable& table = beckmann_table();
  for (const double x : {0.0, 0.3, -1.0, 2.0}) EXPECT_NEAR(table.p22(x, 0.1) / beckmann(x, 0.1), 1, 1e-4) << x;
  for (double theta = 0.05; theta < 2.4; theta += 0.1) {
    // Walter et al. 2007, before their rational fit.
    const double a = 1 / std::tan(theta);
    const double area = std::sin(theta) * (a * (1 + std::erf(a)) + std::exp(-a * a) / std::sqrt(pi)) / 2;
    EXPECT_NEAR(table.projected_area(theta, 0) / area, 1, 1e-4) << theta;
    EXPECT_NEAR(table.tabulated_area(theta, 0) / area, 1, 1e-4) << theta;
  }
}

// Of a density without closed form: the table of areas against quadrature, and one of m_z over all normals.
TEST(SlopeTable, SkewedArea) {
  const SlopeTable& table = skewed_table();
  EXPECT_NEAR(table.projected_area(0, 0), 1, 1e-5);
  for (const double theta : {0.0, 0.5, 1.0, 1.4, 1.6, 2.0})
    for (const double phi : {0.1, 1.7, 3.0, 4.4})
      EXPECT_NEAR(table.tabulated_area(theta, phi) / table.projected_area(theta, phi), 1, kQuick ? 1e-3 : 2e-4)
          << theta << " " << phi;
}

// A radial table and one with azimuths of the same density.
TEST(SlopeTable, RadialAndNot) {
  const auto table = build(beckmann, {.incidence = 9, .slopes = 9, .uniforms = 16, .azimuths = 16});
  EXPECT_FALSE(table->radial());
  for (const double theta : {0.3, 1.0, 1.8})
    EXPECT_NEAR(table->tabulated_area(theta, 2.0) / beckmann_table().tabulated_area(theta, 0), 1, 1e-3);
  for (const double x : {0.2, 1.1}) EXPECT_NEAR(table->p22(x, -0.4) / beckmann_table().p22(x, -0.4), 1, 1e-3);
}

TEST(SlopeTable, SameWithAnyThreads) {
  SlopeTable::Options options{.incidence = 9, .slopes = 9, .uniforms = 16, .azimuths = 8};
  double last = 0;
  options.progress = [&](double fraction) {
    EXPECT_GE(fraction, last);
    last = fraction;
  };
  const auto table = build(skewed, options);
  EXPECT_EQ(last, 1);
  options.progress = nullptr;
  options.threads = 1;
  const auto other = build(skewed, options);
  EXPECT_EQ(table->id(), other->id());
  EXPECT_EQ(table->serialise(), other->serialise());
  options.slopes = 10;
  EXPECT_NE(build(skewed, options)->id(), table->id());
}

TEST(SlopeTable, SizesStayBelowTheirLimits) {
  EXPECT_LE(ggx_table().bytes(), std::size_t{8} << 20);
  EXPECT_LE(skewed_table().bytes(), std::size_t{64} << 20);
}

std::string refusal(const SlopeDensity& p22, const SlopeTable::Options& options = {.radial = true}) {
  return std::string(SlopeTable::build(p22, options).status().message());
}

TEST(SlopeTable, RefusesWhatIsNoDensity) {
  const double infinity = std::numeric_limits<double>::infinity(), nan = std::nan("");
  EXPECT_EQ(refusal(nullptr), "p22: empty");
  EXPECT_EQ(refusal([](double, double) { return 0.0; }), "p22: 0 at every slope of the grid");
  EXPECT_EQ(refusal([&](double x, double) { return x > 0 ? 1.0 : nan; }), "p22: not finite at slope (0, 0): nan");
  EXPECT_EQ(refusal([&](double x, double) { return x > 0 ? 1.0 : infinity; }), "p22: not finite at slope (0, 0): inf");
  EXPECT_EQ(refusal([](double x, double) { return x > 0 ? 1.0 : -2.0; }), "p22: negative at slope (0, 0): -2");
  EXPECT_EQ(refusal([](double, double) { return 1e300; }).find("p22: its projected area is not finite: 1e+300 at"), 0u);
  // Not even at one node of many.
  int calls = 0;
  EXPECT_NE(refusal([&](double x, double y) { return ++calls == 40'000 ? nan : ggx(x, y); }, {}).find("not finite"),
            std::string::npos);
}

TEST(SlopeTable, RefusesWhatIsNotRadial) {
  EXPECT_EQ(refusal([](double x, double y) { return ggx(x, 1.1 * y); }).find("radial: p22 is "), 0u);
  EXPECT_EQ(refusal([](double x, double y) { return ggx(x + 0.1, y); }).find("radial: p22 is "), 0u);
}

TEST(SlopeTable, WhatTheDensityThrowsPasses) {
  EXPECT_THROW((void)SlopeTable::build([](double, double) -> double { throw 7; }, {}), int);
}

TEST(SlopeTable, RefusesSizes) {
  EXPECT_EQ(refusal(ggx, {.radial = true, .uniforms = 24}), "uniforms: 24; a power of two is possible");
  EXPECT_EQ(refusal(ggx, {.radial = true, .incidence = 1}), "incidence: 1; from 2 to 8193 is possible");
  EXPECT_EQ(refusal(ggx, {.azimuths = 6}), "azimuths: 6; a multiple of 4 is possible");
  EXPECT_NE(refusal(ggx, {.slopes = 8193, .uniforms = 4096, .azimuths = 4096}).find("at most 1 GiB"),
            std::string::npos);
}

TEST(SlopeTable, OfAGrid) {
  constexpr std::size_t kN = 201;
  std::vector<double> values(kN * kN);
  const auto slope = [](std::size_t k) { return static_cast<double>(k) * 8 / (kN - 1) - 4; };
  for (std::size_t row = 0; row < kN; ++row)
    for (std::size_t column = 0; column < kN; ++column)
      values[row * kN + column] = 7 * beckmann(slope(column) - 0.3, slope(row) / 0.6);
  const SlopeTable::Options options{.incidence = 5, .slopes = 5, .uniforms = 16, .azimuths = 8};
  const auto table = SlopeTable::from_grid(values, kN, kN, {-4, 4}, {-4, 4}, options);
  ASSERT_TRUE(table.ok()) << table.status();
  for (const double x : {-0.5, 0.3, 1.0})
    for (const double y : {-0.4, 0.2})
      EXPECT_NEAR((*table)->p22(x, y) / (beckmann(x - 0.3, y / 0.6) / 0.6), 1, 2e-3) << x << " " << y;

  const auto refused = [&](std::span<const double> v, std::size_t nx, std::size_t ny, double to) {
    return std::string(SlopeTable::from_grid(v, nx, ny, {-4, to}, {-4, 4}, options).status().message());
  };
  EXPECT_EQ(refused(values, kN, kN + 1, 4), "values: 40401 values for 201 times 202 slopes");
  EXPECT_EQ(refused(values, kN, 1, 4), "values: 201 times 1 slopes; at least 2 times 2 are needed");
  EXPECT_EQ(refused(values, kN, kN, -4), "x: from -4 to -4; a finite range that rises is needed");
  values[77] = -1;
  EXPECT_EQ(refused(values, kN, kN, 4), "values[77]: -1; densities are finite and not negative");
}

}  // namespace
}  // namespace facetwise::test
