// SPDX-License-Identifier: Apache-2.0
// Exponentials, logarithms and the normal distribution's integrals against long double, to the errors that their headers and
// docs/numerics.md state; the same bits on every target.
#include <cstddef>
#include <cstdint>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "math/error_functions_test.cc"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
#include "hwy/highway.h"
#include "src/math/erf-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

enum : int {
  kExp,
  kExpm1,
  kLog,
  kLog1p,
  kNegLog1m,
  kErfcx,
  kTail,
  kGauss,
  kShareBelow,
  kNormalSlope,
  kNormalSlopeRest
};

// Of n values, n a multiple of the widest vector.
void Function(int which, const float* x, std::size_t n, float* y) {
  using D = hn::ScalableTag<float>;
  const D d{};
  for (std::size_t k = 0; k < n; k += Lanes(d)) {
    const auto in = LoadU(d, x + k);
    auto out = in, other = in;
    switch (which) {
      case kExp: out = Exp(d, in); break;
      case kExpm1: out = Expm1(d, in); break;
      case kLog: out = Log(d, in); break;
      case kLog1p: out = Log1p(d, in); break;
      case kNegLog1m: out = NegLog1m(d, in); break;
      case kErfcx: ErfcxAndTail(d, in, out, other); break;
      case kTail: ErfcxAndTail(d, in, other, out); break;
      case kGauss: out = Gauss(d, in); break;
      case kShareBelow: out = ShareBelow(d, in); break;
      case kNormalSlope: out = NormalSlope(d, in, Set(d, 1.0f) - in); break;
      case kNormalSlopeRest: out = NormalSlope(d, Set(d, 1.0f) - in, in); break;
      default: break;
    }
    StoreU(out, d, y + k);
  }
}

using Run = void (*)(int, const float*, std::size_t, float*);
extern const Run kFunction;
const Run kFunction = Function;

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <functional>
#include <numbers>
#include <vector>

#include "facetwise/engine.h"
#include "gtest/gtest.h"
#include "support/counts.h"

namespace facetwise::test {
namespace {

using N_SCALAR::kErfcx, N_SCALAR::kExp, N_SCALAR::kExpm1, N_SCALAR::kGauss, N_SCALAR::kLog, N_SCALAR::kLog1p,
    N_SCALAR::kNegLog1m, N_SCALAR::kNormalSlope, N_SCALAR::kNormalSlopeRest, N_SCALAR::kShareBelow, N_SCALAR::kTail;
using Real = long double;

std::vector<N_SCALAR::Run> all_targets() {
  std::vector<N_SCALAR::Run> runs = {N_SCALAR::kFunction};
#if HWY_TARGETS & HWY_AVX2
  if (hwy::SupportedTargets() & HWY_AVX2) runs.push_back(N_AVX2::kFunction);
#endif
#if HWY_TARGETS & HWY_AVX3
  if (hwy::SupportedTargets() & HWY_AVX3) runs.push_back(N_AVX3::kFunction);
#endif
#if HWY_TARGETS & HWY_NEON
  if (hwy::SupportedTargets() & HWY_NEON) runs.push_back(N_NEON::kFunction);
#endif
  return runs;
}

// Values from low to high, evenly spread in the floats between them where `by_floats`, else evenly.
std::vector<float> values(float low, float high, bool by_floats) {
  const std::size_t n = kQuick ? 1 << 14 : 1 << 20;
  std::vector<float> x(n);
  std::uint32_t from = 0, to = 0;
  std::memcpy(&from, &low, 4);
  std::memcpy(&to, &high, 4);
  for (std::size_t k = 0; k < n; ++k) {
    const double t = static_cast<double>(k) / static_cast<double>(n - 1);
    const auto bits = static_cast<std::uint32_t>(from + t * (static_cast<double>(to) - from) + 0.5);
    if (by_floats)
      std::memcpy(&x[k], &bits, 4);
    else
      x[k] = static_cast<float>(low + t * (static_cast<double>(high) - low));
  }
  return x;
}

// The largest of error(x, y), after finding the same bits on every target.
double largest(int which, const std::vector<float>& x, const std::function<Real(Real, Real)>& error) {
  std::vector<float> y(x.size()), other(x.size());
  const auto runs = all_targets();
  runs.front()(which, x.data(), x.size(), y.data());
  for (const auto run : runs) {
    run(which, x.data(), x.size(), other.data());
    EXPECT_EQ(std::memcmp(y.data(), other.data(), 4 * y.size()), 0);
  }
  Real worst = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    const Real e = std::abs(error(x[k], y[k]));
    if (!(e <= worst)) worst = e;
  }
  return static_cast<double>(worst);
}

std::function<Real(Real, Real)> relative(const std::function<Real(Real)>& truth) {
  return [truth](Real x, Real y) {
    const Real t = truth(x);
    return t == 0 ? y : y / t - 1;
  };
}

Real share_below(Real x) { return std::erfc(-x) / 2; }
// e^(x^2) erfc(x): by its continued fraction where the product would underflow.
Real erfcx(Real x) {
  if (x < 20) return std::exp(x * x) * std::erfc(x);
  Real f = x;
  for (int k = 40; k >= 1; --k) f = x + k / (2 * f);
  return std::numbers::inv_sqrtpi_v<Real> / f;
}
// 1 / sqrt(pi) - x erfcx(x), which cancels: its expansion for large x.
Real tail(Real x) {
  if (x < 6) return std::numbers::inv_sqrtpi_v<Real> - x * erfcx(x);
  // erfcx = (1 / (x sqrt(pi))) sum (-1)^k (2 k - 1)!! / (2 x^2)^k
  Real term = 1, sum = 0;
  for (int k = 1; k < 30; ++k) {
    const Real next = -term * (2 * k - 1) / (2 * x * x);
    if (std::abs(next) > std::abs(term)) break;
    sum -= term = next;
  }
  return std::numbers::inv_sqrtpi_v<Real> * sum;
}

TEST(ErrorFunctions, AreAsExactAsStated) {
  struct {
    const char* name;
    int which;
    float low, high;
    bool by_floats;
    std::function<Real(Real, Real)> error;
    double stated;
  } const cases[] = {
      {"Exp", kExp, -86, 88, false, relative([](Real x) { return std::exp(x); }), 1e-7},
      {"Expm1", kExpm1, 1e-30f, 80, true, relative([](Real x) { return std::expm1(x); }), 2.5e-7},
      {"Log", kLog, 0x1p-126f, 3e38f, true, relative([](Real x) { return std::log(x); }), 1e-7},
      {"Log near 1", kLog, 0.5f, 2, false, relative([](Real x) { return std::log(x); }), 1e-7},
      {"Log1p", kLog1p, 1e-30f, 1e30f, true, relative([](Real x) { return std::log1p(x); }), 2e-7},
      {"NegLog1m", kNegLog1m, 1e-30f, 0x1.fffffep-1f, true, relative([](Real x) { return -std::log1p(-x); }), 2e-7},
      {"ErfcxAndTail, erfcx", kErfcx, 1e-10f, 1e9f, true, relative(erfcx), 4e-7},
      {"ErfcxAndTail, tail", kTail, 1e-10f, 1e9f, true, relative(tail), 8e-7},
      {"Gauss", kGauss, 1e-6f, 8, true, relative([](Real x) { return std::exp(-x * x); }), 1.5e-7},
      {"ShareBelow", kShareBelow, -7.9f, 7.9f, false, relative(share_below), 5e-7},
      {"NormalSlope, share", kNormalSlope, 0x1p-24f, 0x1.fffffep-1f, true,
       [](Real u, Real x) { return share_below(x) - u; }, 2e-7},
      {"NormalSlope, tail", kNormalSlope, 1e-18f, 1e-3f, true, relative([](Real u) { return u; }), 0},
      {"NormalSlope, other tail", kNormalSlopeRest, 1e-18f, 1e-3f, true, relative([](Real u) { return u; }), 0},
  };
  for (const auto& c : cases) {
    auto error = c.error;
    double stated = c.stated;
    if (stated == 0) {  // of the share in a tail, relative
      stated = 1.5e-4;
      const bool other = c.which == kNormalSlopeRest;
      error = [other](Real u, Real x) { return share_below(other ? -x : x) / u - 1; };
    }
    const double found = largest(c.which, values(c.low, c.high, c.by_floats), error);
    std::printf("%-24s %.2g (stated %.2g)\n", c.name, found, stated);
    EXPECT_LE(found, stated) << c.name;
    // Not stated much too large either: a coefficient that changes would hide in that.
    if (!kQuick) {
      EXPECT_GE(found, 0.5 * stated) << c.name;
    }
  }
}

// Visible slopes by inversion: the share of visible slopes below what u1 draws is u1.
TEST(ErrorFunctions, VisibleSlopesHaveTheirShare) {
  const std::size_t lanes = kQuick ? 256 : 4096;
  const Real root2 = std::numbers::sqrt2_v<Real>;
  struct Model {
    Distribution distribution;
    // The integral of (c - s x) over the slopes below x.
    std::function<Real(Real c, Real s, Real x)> below;
    double stated;
  };
  const Model models[] = {{Distribution::beckmann,
                           [](Real c, Real s, Real x) {
                             return c * share_below(x) + s * std::exp(-x * x) * std::numbers::inv_sqrtpi_v<Real> / 2;
                           },
                           5e-7},
                          {Distribution::student_t,
                           [&](Real c, Real s, Real x) {
                             const Real y = x / root2, q = y / std::sqrt(1 + y * y);
                             return c * (2 + 3 * q - q * q * q) / 4 + s * root2 / 4 * std::pow(1 + y * y, Real{-1.5});
                           },
                           8e-7}};
  for (const Model& model : models) {
    double worst = 0;
    for (int degrees = 0; degrees <= 89; degrees += 1) {
      const Real theta = degrees * std::numbers::pi_v<Real> / 180, sine = std::sin(theta), cosine = std::cos(theta);
      std::vector<float> u1(lanes), mx(lanes), my(lanes), mz(lanes);
      for (std::size_t k = 0; k < lanes; ++k)
        u1[k] = static_cast<float>((static_cast<double>(k) + 0.5) / static_cast<double>(lanes));
      Batch batch;
      batch.model.distribution = model.distribution;
      batch.sampler = Sampler::visible;
      batch.lanes = lanes;
      batch.incident = {static_cast<float>(sine), 0.0f, static_cast<float>(cosine)};
      batch.alpha_x = batch.alpha_y = 1.0f;
      batch.u1 = u1;
      batch.u2 = 0.5f;
      batch.out.normal = {mx, my, mz};
      ASSERT_TRUE(sample_normal(batch).ok());
      // The kernel sees rounded sine and cosine.
      const Real s = static_cast<float>(sine), c = static_cast<float>(cosine);
      const Real sigma = s == 0 ? c : model.below(c, s, c / s);
      for (std::size_t k = 0; k < lanes; ++k) {
        const Real share = model.below(c, s, -static_cast<Real>(mx[k]) / mz[k]) / sigma;
        worst = std::max(worst, static_cast<double>(std::abs(share - u1[k])));
      }
    }
    std::printf("visible slopes of %s: largest error of the share %.3g (stated %.1g)\n",
                std::string(name(model.distribution)).c_str(), worst, model.stated);
    EXPECT_LE(worst, model.stated);
    EXPECT_GE(worst, model.stated / (kQuick ? 6 : 3)) << "state less";
  }
}

}  // namespace
}  // namespace facetwise::test

#endif  // HWY_ONCE
