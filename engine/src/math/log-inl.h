// SPDX-License-Identifier: Apache-2.0
// Natural logarithm.

#if defined(FACETWISE_LOG_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_LOG_INL_H_
#undef FACETWISE_LOG_INL_H_
#else
#define FACETWISE_LOG_INL_H_
#endif

#include "src/math/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// log(x) for normal positive x; relative error 1e-7, near 1 too. One of Highway's tags, no pairs.
template <class D, class V = Vec<D>>
HWY_INLINE V Log(D d, V x) {
  const Rebind<int32_t, D> di{};
  // x = 2^n m with m in [sqrt(1/2), sqrt(2)).
  const auto bits = BitCast(di, x) - Set(di, 0x3F3504F3);
  const auto exponent = ShiftRight<23>(bits);
  const V f = BitCast(d, BitCast(di, x) - ShiftLeft<23>(exponent)) - Set(d, 1.0f);
  const V n = ConvertTo(d, exponent);
  // (log(1 + f) - f + f^2 / 2) / f^3, error 3e-8.
  V p = Set(d, 0.0697161147f);
  p = Fma(p, f, Set(d, -0.114797338f));
  p = Fma(p, f, Set(d, 0.116854199f));
  p = Fma(p, f, Set(d, -0.124256873f));
  p = Fma(p, f, Set(d, 0.142490576f));
  p = Fma(p, f, Set(d, -0.166678023f));
  p = Fma(p, f, Set(d, 0.200007157f));
  p = Fma(p, f, Set(d, -0.24999997f));
  p = Fma(p, f, Set(d, 0.333333312f));
  const V f2 = f * f;
  const V low = Fma(n, Set(d, 1.42860677e-6f), f * f2 * p);
  const V rest = NegFma(Set(d, 0.5f), f2, low);
  return Fma(n, Set(d, 0.693145752f), f + rest);
}

// log(1 + x) for x in [0, 1e30]; relative error 2e-7. What rounding 1 + x does to it is undone by the quotient.
template <class D, class V = Vec<D>>
HWY_INLINE V Log1p(D d, V x) {
  const V one = Set(d, 1.0f), sum = one + x, whole = sum - one;
  const auto tiny = whole <= Zero(d);
  return Select(tiny, x, Log(d, sum) * (x / Select(tiny, one, whole)));
}

// -log(1 - u) for u in [0, 1); relative error 2e-7.
template <class D, class V = Vec<D>>
HWY_INLINE V NegLog1m(D d, V u) {
  const V one = Set(d, 1.0f), rest = one - u, whole = one - rest;
  const auto tiny = whole <= Zero(d);
  return Select(tiny, u, Neg(Log(d, rest)) * (u / Select(tiny, one, whole)));
}

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
