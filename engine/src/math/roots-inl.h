// SPDX-License-Identifier: Apache-2.0
// Inverse roots of odd order.

#if defined(FACETWISE_ROOTS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_ROOTS_INL_H_
#undef FACETWISE_ROOTS_INL_H_
#else
#define FACETWISE_ROOTS_INL_H_
#endif

#include "src/math/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// The exponent in x's bits times -fraction, for `magic` = (1 + fraction) times that of 1 (tuned).
template <class D, class V = Vec<D>>
HWY_INLINE V RootGuess(D d, V x, V fraction, std::int32_t magic) {
  const Rebind<std::int32_t, D> di{};
  return BitCast(d, Set(di, magic) - ConvertTo(di, ConvertTo(d, BitCast(di, x)) * fraction));
}

// x^(-1/3) for x in [2^-60, 2^60], to 1.2e-5: for a start. Newton's method for 1 / y^3 = x needs no division; the first
// guess divides the exponent in the bits.
template <class D, class V = Vec<D>>
HWY_INLINE V RoughInverseCubeRoot(D d, V x) {
  const V third = Set(d, 1.0f / 3.0f), four_thirds = Set(d, 4.0f / 3.0f);
  V y = RootGuess(d, x, third, 0x54A20000);
  const V scaled = x * third;
  for (int step = 0; step < 2; ++step) y = y * NegFma(scaled, y * y * y, four_thirds);
  return y;
}

// x^(-1/5) in the same way, relative error 2e-7.
template <class D, class V = Vec<D>>
HWY_INLINE V InverseFifthRoot(D d, V x) {
  const V fifth = Set(d, 0.2f), six_fifths = Set(d, 1.2f);
  V y = RootGuess(d, x, fifth, 0x4C2B8000);
  const V scaled = x * fifth;
  for (int step = 0; step < 3; ++step) {
    const V y2 = y * y;
    y = y * NegFma(scaled, y2 * y2 * y, six_fifths);
  }
  return y;
}

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
