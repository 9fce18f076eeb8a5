// SPDX-License-Identifier: Apache-2.0
// The lane functions: near those in double, and the same bits on every target and in every width.
#include <cstddef>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "table/lanes_test.cc"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
#include "hwy/highway.h"
#include "src/math/slope_table-inl.h"

#ifndef FACETWISE_TABLE_LANES
#define FACETWISE_TABLE_LANES
namespace facetwise::test {

// Columns of n lanes, n a multiple of twice the widest vector.
struct Columns {
  const float *cos_theta, *sin_theta, *cos_phi, *sin_phi, *u1, *u2;
  float *x, *y, *density, *queried, *mx, *my, *mz, *normal_density, *normal_queried, *p22, *area;
};

}  // namespace facetwise::test
#endif

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

template <class D>
void AllFunctions(const SlopeTableView& view, std::size_t n, const test::Columns& to) {
  const D d{};
  for (std::size_t k = 0; k < n; k += Lanes(d)) {
    const auto load = [&](const float* from) HWY_ATTR { return LoadU(d, from + k); };
    const Vec<D> ct = load(to.cos_theta), st = load(to.sin_theta), cp = load(to.cos_phi), sp = load(to.sin_phi);
    const Vec<D> u1 = load(to.u1), u2 = load(to.u2);
    Vec<D> x, y, density, mx, my, mz, normal_density;
    DrawVisibleSlope(d, view, ct, st, cp, sp, u1, u2, x, y, density);
    DrawVisibleNormal(d, view, ct, st, cp, sp, u1, Set(d, 1.0f) - u1, u2, mx, my, mz, normal_density);
    StoreU(x, d, to.x + k);
    StoreU(y, d, to.y + k);
    StoreU(density, d, to.density + k);
    StoreU(VisibleSlopeDensity(d, view, ct, st, cp, sp, x, y), d, to.queried + k);
    StoreU(mx, d, to.mx + k);
    StoreU(my, d, to.my + k);
    StoreU(mz, d, to.mz + k);
    StoreU(normal_density, d, to.normal_density + k);
    StoreU(VisibleNormalDensity(d, view, ct, st, cp, sp, mx, my, mz), d, to.normal_queried + k);
    StoreU(P22(d, view, x, y), d, to.p22 + k);
    StoreU(ProjectedArea(d, view, ct, st, cp, sp), d, to.area + k);
  }
}

using Function = void (*)(const SlopeTableView&, std::size_t, const test::Columns&);
extern const Function kAllFunctions[3];
const Function kAllFunctions[3] = {AllFunctions<hn::ScalableTag<float>>, AllFunctions<Twice<hn::ScalableTag<float>>>,
                                   AllFunctions<hn::CappedTag<float, 1>>};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include <bit>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "gtest/gtest.h"
#include "support/counts.h"
#include "support/philox.h"
#include "table/densities.h"

namespace facetwise::test {
namespace {

struct Version {
  std::string name;
  void (*run)(const SlopeTableView&, std::size_t, const Columns&);
};

void add_versions(std::int64_t target, const char* name, const N_SCALAR::Function (&functions)[3],
                  std::vector<Version>& versions) {
  if (target != HWY_SCALAR && (hwy::SupportedTargets() & target) == 0) return;
  static constexpr const char* kWidths[] = {", vectors", ", pairs", ", one lane"};
  for (int k = 0; k < 3; ++k) versions.push_back({std::string(name) + kWidths[k], functions[k]});
}

std::vector<Version> all_versions() {
  std::vector<Version> versions;
#if HWY_TARGETS & HWY_AVX3
  add_versions(HWY_AVX3, "avx3", N_AVX3::kAllFunctions, versions);
#endif
#if HWY_TARGETS & HWY_AVX2
  add_versions(HWY_AVX2, "avx2", N_AVX2::kAllFunctions, versions);
#endif
#if HWY_TARGETS & HWY_NEON
  add_versions(HWY_NEON, "neon", N_NEON::kAllFunctions, versions);
#endif
  add_versions(HWY_SCALAR, "scalar", N_SCALAR::kAllFunctions, versions);
  return versions;
}

std::vector<const SlopeTable*> tables() {
  std::vector<const SlopeTable*> tables = {&ggx_table(), &coarse_table()};
  if (!kQuick) tables.insert(tables.end(), {&beckmann_table(), &skewed_table()});
  return tables;
}

constexpr int kInputs = 6, kOutputs = 11;
struct Lanes {
  std::vector<float> in[kInputs], out[kOutputs];
  std::vector<double> theta, phi;

  explicit Lanes(std::size_t n) : theta(n), phi(n) {
    for (auto& column : in) column.resize(n);
    for (auto& column : out) column.resize(n);
    for (std::size_t k = 0; k < n; ++k) {
      const auto u = generated(5, 0, k), v = generated(5, 1, k);
      theta[k] = 3.1415 * v[0], phi[k] = 6.2831 * v[1];
      const double values[kInputs] = {
          std::cos(theta[k]), std::sin(theta[k]), std::cos(phi[k]), std::sin(phi[k]), u[0], u[1]};
      for (int column = 0; column < kInputs; ++column) in[column][k] = static_cast<float>(values[column]);
    }
  }
  std::size_t size() const { return theta.size(); }
  void run(const Version& version, const SlopeTable& table) {
    version.run(table.view(), size(),
                {in[0].data(), in[1].data(), in[2].data(), in[3].data(), in[4].data(), in[5].data(), out[0].data(),
                 out[1].data(), out[2].data(), out[3].data(), out[4].data(), out[5].data(), out[6].data(),
                 out[7].data(), out[8].data(), out[9].data(), out[10].data()});
  }
};

TEST(TableLanes, SameBits) {
  const auto versions = all_versions();
  ASSERT_GE(versions.size(), 3u);
  for (const SlopeTable* table : tables()) {
    Lanes first(kQuick ? 512 : 8192);
    first.run(versions[0], *table);
    for (std::size_t v = 1; v < versions.size(); ++v) {
      Lanes other(first.size());
      other.run(versions[v], *table);
      for (int column = 0; column < kOutputs; ++column)
        for (std::size_t k = 0; k < first.size(); ++k)
          ASSERT_EQ(std::bit_cast<std::uint32_t>(first.out[column][k]),
                    std::bit_cast<std::uint32_t>(other.out[column][k]))
              << versions[v].name << ", column " << column << ", lane " << k;
    }
  }
}

// Slopes that rounding puts into the next cell have another density: few.
TEST(TableLanes, NearDouble) {
  const Version version = all_versions()[0];
  for (const SlopeTable* table : tables()) {
    SCOPED_TRACE(table->description());
    Lanes lanes(kQuick ? 1024 : 32768);
    lanes.run(version, *table);
    int slopes = 0, densities = 0, queried = 0, normals = 0, p22s = 0;
    double area = 0;
    for (std::size_t k = 0; k < lanes.size(); ++k) {
      const double theta = lanes.theta[k], phi = lanes.phi[k], x = lanes.out[0][k], y = lanes.out[1][k];
      const auto drawn = table->draw(theta, phi, lanes.in[4][k], lanes.in[5][k]);
      const double squared = 1 + x * x + y * y;
      // The angle between normals.
      const double apart = std::sqrt((std::pow(x - drawn.x, 2) + std::pow(y - drawn.y, 2)) / squared);
      if (!(apart < 1e-4)) ++slopes;
      const double density = lanes.out[2][k];
      if (!(std::abs(density / drawn.density - 1) < 2e-3)) ++densities;
      if (!(std::abs(lanes.out[3][k] / density - 1) < 2e-3)) ++queried;
      if (!(std::abs(lanes.out[8][k] / lanes.out[7][k] - 1) < 2e-3)) ++normals;
      const double p22 = table->p22(x, y);
      if (!(std::abs(lanes.out[9][k] - p22) <= 1e-5 * p22 + 1e-7 / (squared * squared))) ++p22s;
      const double exact = table->tabulated_area(theta, phi);
      if (exact > 1e-4) area = std::max(area, std::abs(lanes.out[10][k] / exact - 1));
      ASSERT_NEAR(std::hypot(lanes.out[4][k], lanes.out[5][k], lanes.out[6][k]), 1, 1e-6);
    }
    const int few = static_cast<int>(lanes.size() / 200);
    EXPECT_LE(slopes, few);
    EXPECT_LE(densities, few);
    EXPECT_LE(queried, few);
    EXPECT_LE(normals, few);
    EXPECT_LE(p22s, few);
    std::printf("of %zu: slopes %d, densities %d, queried %d and %d, p22 %d apart; area %.2g\n", lanes.size(), slopes,
                densities, queried, normals, p22s, area);
    EXPECT_LE(area, 1e-4);
  }
}

// Lanes that mean nothing read inside the tables; a sanitizer would tell.
TEST(TableLanes, Garbage) {
  const float hard[] = {0, -0.0f, 1, -1, std::nanf(""), INFINITY, -INFINITY, 1e38f, -1e38f, 1e-45f, 2, 0x1.fffffep-1f};
  for (const Version& version : all_versions())
    for (const SlopeTable* table : tables()) {
      Lanes lanes(kQuick ? 512 : 4096);
      for (std::size_t k = 0; k < lanes.size(); ++k)
        for (int column = 0; column < kInputs; ++column)
          if (const auto pick = philox4x32_10({static_cast<std::uint32_t>(k), 0, 0, 0}, {1, 0})[0] >> (4 * column) & 15;
              pick < std::size(hard))
            lanes.in[column][k] = hard[pick];
      lanes.run(version, *table);
    }
}

}  // namespace
}  // namespace facetwise::test
#endif  // HWY_ONCE
