// SPDX-License-Identifier: Apache-2.0
// Exponential function.

#if defined(FACETWISE_EXP_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_EXP_INL_H_
#undef FACETWISE_EXP_INL_H_
#else
#define FACETWISE_EXP_INL_H_
#endif

#include "src/math/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// (e^r - 1 - r) / r^2 for |r| up to 0.35, error 2e-9: interpolated at Chebyshev nodes.
template <class D, class V = Vec<D>>
HWY_INLINE V ExpRest(D d, V r) {
  V p = Set(d, 0.000198919813f);
  p = Fma(p, r, Set(d, 0.00139345419f));
  p = Fma(p, r, Set(d, 0.00833331002f));
  p = Fma(p, r, Set(d, 0.0416664568f));
  p = Fma(p, r, Set(d, 0.166666667f));
  return Fma(p, r, Set(d, 0.5f));
}

// e^x for x up to 88, where it stays; relative error 1e-7. 0 below -86, so that nothing is denormal.
template <class D, class V = Vec<D>>
HWY_INLINE V Exp(D d, V x) {
  const V lowest = Set(d, -86.0f);
  const auto vanishes = x < lowest;
  x = Min(Max(x, lowest), Set(d, 88.0f));
  // x = n log(2) + r, |r| <= log(2) / 2. Adding 1.5 * 2^23 rounds to the nearest integer, which is then the low bits of
  // the sum.
  const V magic = Set(d, 12582912.0f);
  const V rounded = Fma(x, Set(d, 1.44269504f), magic);
  const V n = rounded - magic;
  V r = NegFma(n, Set(d, 0.693145752f), x);
  r = NegFma(n, Set(d, 1.42860677e-6f), r);
  const V p = Fma(r * r, ExpRest(d, r), r) + Set(d, 1.0f);
  const Rebind<uint32_t, D> du{};
  const V scaled = BitCast(d, BitCast(du, p) + ShiftLeft<23>(BitCast(du, rounded)));
  return IfThenElseZero(Not(vanishes), scaled);
}

// e^x - 1 for x >= 0; relative error 2.5e-7.
template <class D, class V = Vec<D>>
HWY_INLINE V Expm1(D d, V x) {
  const V small = Min(x, Set(d, 0.35f));
  return Select(x < Set(d, 0.35f), Fma(small * small, ExpRest(d, small), small), Exp(d, x) - Set(d, 1.0f));
}

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
