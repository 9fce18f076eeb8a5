// SPDX-License-Identifier: Apache-2.0
// Sine and cosine of a whole turn's fraction.

#if defined(FACETWISE_SINCOS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_SINCOS_INL_H_
#undef FACETWISE_SINCOS_INL_H_
#else
#define FACETWISE_SINCOS_INL_H_
#endif

#include "src/math/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// sin(2 pi u) and cos(2 pi u) for u in [0, 1). Largest error 9e-8; exact at multiples of a quarter.
// Range reduction is exact: 2 pi u = pi/2 (quadrant + r), r in [-1/2, 1/2]. The polynomials interpolate at
// Chebyshev nodes in r^2 on [0, 1/4] (errors 4.9e-9 and 1.9e-10 before rounding).
template <class D, class V = Vec<D>>
HWY_INLINE void SinCosTurn(D d, V u, V& sin, V& cos) {
  // Adding 1.5 * 2^23 rounds to the nearest integer, which is then the low bits of the sum.
  const V magic = Set(d, 12582912.0f), four = Set(d, 4.0f);
  const V rounded = Fma(u, four, magic);
  const V r = Fms(u, four, rounded - magic);
  const V y = r * r;

  V s = Set(d, -0.0046021176159932635f);
  s = Fma(s, y, Set(d, 0.07968020776898675f));
  s = Fma(s, y, Set(d, -0.6459634769234417f));
  s = Fma(s, y, Set(d, 1.570796321945507f)) * r;

  V c = Set(d, 0.0009067349218241515f);
  c = Fma(c, y, Set(d, -0.020861526786172185f));
  c = Fma(c, y, Set(d, 0.2536694102403011f));
  c = Fma(c, y, Set(d, -1.2337005493729984f));
  c = Fma(c, y, Set(d, 1.0f));

  // An odd quadrant swaps; bit 1 of the quadrant negates the sine, of the next quadrant the cosine.
  const Rebind<uint32_t, D> du{};
  const auto quadrant = BitCast(du, rounded);
  const auto odd = RebindMask(d, TestBit(quadrant, Set(du, 1u)));
  const V sign = SignBit(d);
  const V sin_sign = And(BitCast(d, ShiftLeft<30>(quadrant)), sign);
  const V next = BitCast(d, ShiftLeft<30>(quadrant + Set(du, 1u)));
  const V cos_sign = And(next, sign);
  sin = Xor(Select(odd, c, s), sin_sign);
  cos = Xor(Select(odd, s, c), cos_sign);
}

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
