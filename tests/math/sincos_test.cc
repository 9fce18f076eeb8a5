// SPDX-License-Identifier: Apache-2.0
// SinCosTurn against double, over every u that the generator can make, and the same bits on every target.
#include <cstddef>
#include <cstdint>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "math/sincos_test.cc"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
#include "hwy/highway.h"
#include "src/math/sincos-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// Of n values, n a multiple of twice the widest vector; by D and by pairs of D.
template <class D>
void SinCosTurns(const float* u, std::size_t n, float* sin, float* cos) {
  const D d{};
  for (std::size_t k = 0; k < n; k += Lanes(d)) {
    Vec<D> s, c;
    SinCosTurn(d, LoadU(d, u + k), s, c);
    StoreU(s, d, sin + k);
    StoreU(c, d, cos + k);
  }
}

using Function = void (*)(const float*, std::size_t, float*, float*);
extern const Function kSinCosTurns[3];
const Function kSinCosTurns[3] = {SinCosTurns<hn::ScalableTag<float>>, SinCosTurns<Twice<hn::ScalableTag<float>>>,
                                  SinCosTurns<hn::CappedTag<float, 1>>};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>
#include <vector>

#include "gtest/gtest.h"
#include "support/counts.h"

namespace facetwise::test {
namespace {

struct Version {
  std::string name;
  void (*run)(const float*, std::size_t, float*, float*);
};

void add_versions(std::int64_t target, const char* name, const N_SCALAR::Function (&functions)[3],
                  std::vector<Version>& versions) {
  if (target != HWY_SCALAR && (hwy::SupportedTargets() & target) == 0) return;
  static constexpr const char* kWidths[] = {", vectors", ", pairs", ", one lane"};
  for (int k = 0; k < 3; ++k) versions.push_back({std::string(name) + kWidths[k], functions[k]});
}

// Those that this CPU has, in every width.
std::vector<Version> all_versions() {
  std::vector<Version> versions;
#if HWY_TARGETS & HWY_AVX3
  add_versions(HWY_AVX3, "avx3", N_AVX3::kSinCosTurns, versions);
#endif
#if HWY_TARGETS & HWY_AVX2
  add_versions(HWY_AVX2, "avx2", N_AVX2::kSinCosTurns, versions);
#endif
#if HWY_TARGETS & HWY_NEON
  add_versions(HWY_NEON, "neon", N_NEON::kSinCosTurns, versions);
#endif
  add_versions(HWY_SCALAR, "scalar", N_SCALAR::kSinCosTurns, versions);
  return versions;
}

// In double, reduced to the nearest quarter exactly.
void truth(float u, double& sin, double& cos) {
  const int quadrant = static_cast<int>(std::floor(4.0 * u + 0.5));
  const double x = 2 * std::numbers::pi * (u - 0.25 * quadrant);
  const double s = std::sin(x), c = std::cos(x);
  switch (quadrant & 3) {
    case 0: sin = s, cos = c; break;
    case 1: sin = c, cos = -s; break;
    case 2: sin = -s, cos = -c; break;
    default: sin = -c, cos = s; break;
  }
}

struct Worst {
  double error = 0, squares = 0;
  float at = 0, squares_at = 0;
  void print(const char* what) const {
    std::printf("%s: largest error %.3g at u = %.9g; largest |sin^2 + cos^2 - 1| %.3g at u = %.9g\n", what, error, at,
                squares, squares_at);
  }
};

// A block of values on every version; the first one's errors go to `worst`.
void check(const std::vector<Version>& versions, const std::vector<float>& u, Worst& worst) {
  const std::size_t n = u.size();
  std::vector<float> sin(n), cos(n), other_sin(n), other_cos(n);
  versions.front().run(u.data(), n, sin.data(), cos.data());
  for (std::size_t k = 0; k < n; ++k) {
    double s, c;
    truth(u[k], s, c);
    const double error = std::max(std::abs(sin[k] - s), std::abs(cos[k] - c));
    const double squares = std::abs(double{sin[k]} * sin[k] + double{cos[k]} * cos[k] - 1);
    if (!(error <= worst.error)) worst.error = error, worst.at = u[k];
    if (!(squares <= worst.squares)) worst.squares = squares, worst.squares_at = u[k];
  }
  const auto bits = [](float value) { return std::bit_cast<std::uint32_t>(value); };
  for (std::size_t v = 1; v < versions.size(); ++v) {
    versions[v].run(u.data(), n, other_sin.data(), other_cos.data());
    for (std::size_t k = 0; k < n; ++k)
      ASSERT_TRUE(bits(sin[k]) == bits(other_sin[k]) && bits(cos[k]) == bits(other_cos[k]))
          << versions[v].name << " differs from " << versions.front().name << " at u = " << u[k];
  }
}

constexpr double kStatedError = 9e-8;  // by sincos-inl.h
constexpr std::size_t kBlock = 1 << 16;

TEST(SinCosTurn, EveryMultipleOfTheGenerator) {
  const auto versions = all_versions();
  ASSERT_GE(versions.size(), 3u);
  const std::uint32_t kStep = kQuick ? 37 : 1;
  Worst worst;
  std::vector<float> u(kBlock);
  for (std::uint32_t first = 0; first < 1u << 24; first += kBlock * kStep) {
    for (std::uint32_t k = 0; k < kBlock; ++k)
      u[k] = static_cast<float>(std::min<std::uint32_t>(first + k * kStep, (1u << 24) - 1)) * 0x1p-24f;
    check(versions, u, worst);
    if (HasFatalFailure()) return;
  }
  worst.print("multiples of 2^-24");
  EXPECT_LE(worst.error, kStatedError);
  // Both off by the error, where |sin| = |cos|.
  EXPECT_LE(worst.squares, 2 * std::numbers::sqrt2 * kStatedError);
}

// A column may hold any u in [0, 1): all exponents down to denormals, and the neighbours of eighths, where
// the reduction changes quadrant.
TEST(SinCosTurn, AnyOtherU) {
  std::vector<float> u;
  const std::uint32_t one = std::bit_cast<std::uint32_t>(1.0f);
  for (std::uint32_t bits = 0; bits < one; bits += kQuick ? 300'007 : 3'001) u.push_back(std::bit_cast<float>(bits));
  for (int eighth = 1; eighth <= 8; ++eighth)
    for (std::uint32_t distance = 1; distance < 200; ++distance) {
      const std::uint32_t bits = std::bit_cast<std::uint32_t>(0.125f * static_cast<float>(eighth));
      u.push_back(std::bit_cast<float>(bits - distance));
      if (eighth < 8) u.push_back(std::bit_cast<float>(bits + distance));
    }
  u.resize((u.size() + 63) / 64 * 64, 0.125f);
  Worst worst;
  check(all_versions(), u, worst);
  worst.print("other u");
  EXPECT_LE(worst.error, kStatedError);
}

TEST(SinCosTurn, QuartersAreExact) {
  const std::vector<float> u(64, 0.0f);
  for (const Version& version : all_versions()) {
    SCOPED_TRACE(version.name);
    const float expected[][3] = {{0, 0, 1}, {-0.0f, 0, 1}, {0.25f, 1, 0}, {0.5f, 0, -1}, {0.75f, -1, 0}};
    for (const auto& [at, sin, cos] : expected) {
      const std::vector<float> same(64, at);
      std::vector<float> s(64), c(64);
      version.run(same.data(), 64, s.data(), c.data());
      EXPECT_EQ(s, std::vector<float>(64, sin)) << at;
      EXPECT_EQ(c, std::vector<float>(64, cos)) << at;
    }
  }
}

}  // namespace
}  // namespace facetwise::test
#endif  // HWY_ONCE
