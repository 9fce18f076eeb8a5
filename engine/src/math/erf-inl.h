// SPDX-License-Identifier: Apache-2.0
// The normal distribution's integrals. e^(-x^2) / sqrt(pi) is the density of Beckmann's slopes.

#if defined(FACETWISE_ERF_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_ERF_INL_H_
#undef FACETWISE_ERF_INL_H_
#else
#define FACETWISE_ERF_INL_H_
#endif

#include "src/math/exp-inl.h"
#include "src/math/log-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

inline constexpr float kInverseRootPi = 0.564189584f;

// For x >= 0: erfcx = e^(x^2) erfc(x), relative error 4e-7, and tail = 1 / sqrt(pi) - x erfcx, 8e-7, which falls with
// 1 / x^2 and would cancel. Polynomials in (x - 2) / (x + 2), interpolated at Chebyshev nodes, for the
// functions times 1 + 2 x and (1 + 3 x / 2)^2. Beyond 1e9 they stay.
template <class D, class V = Vec<D>>
HWY_INLINE void ErfcxAndTail(D d, V x, V& erfcx, V& tail) {
  const V one = Set(d, 1.0f), two = Set(d, 2.0f);
  x = Min(x, Set(d, 1e9f));
  const V a = x + two, b = Fma(two, x, one), c = Fma(Set(d, 1.5f), x, one);
  // One division for three.
  const V bc = b * c;
  const V inverse = one / (a * bc);
  const V t = (x - two) * (bc * inverse);
  const V inverse_b = a * c * inverse, inverse_c = a * b * inverse;
  V p = Set(d, 0.000165867579f);
  p = Fma(p, t, Set(d, -0.000182478015f));
  p = Fma(p, t, Set(d, -0.00140835775f));
  p = Fma(p, t, Set(d, 0.0010404808f));
  p = Fma(p, t, Set(d, 0.00870021721f));
  p = Fma(p, t, Set(d, -0.00794070691f));
  p = Fma(p, t, Set(d, -0.0542159009f));
  p = Fma(p, t, Set(d, 0.164035273f));
  p = Fma(p, t, Set(d, -0.166030604f));
  p = Fma(p, t, Set(d, -0.0927630388f));
  p = Fma(p, t, Set(d, 1.27697838f));
  erfcx = p * inverse_b;
  V q = Set(d, 0.0005176976f);
  q = Fma(q, t, Set(d, -1.13884118e-05f));
  q = Fma(q, t, Set(d, -0.00352188117f));
  q = Fma(q, t, Set(d, -0.0010107651f));
  q = Fma(q, t, Set(d, 0.015413204f));
  q = Fma(q, t, Set(d, 0.00669487866f));
  q = Fma(q, t, Set(d, -0.0672326413f));
  q = Fma(q, t, Set(d, 0.0185704915f));
  q = Fma(q, t, Set(d, 0.202346549f));
  q = Fma(q, t, Set(d, -0.279163451f));
  q = Fma(q, t, Set(d, -0.112261032f));
  q = Fma(q, t, Set(d, 0.854371627f));
  tail = q * (inverse_c * inverse_c);
}

// e^(-x^2), relative error 1.5e-7, 0 for |x| > 8, so that products with it are not denormal, which processors are slow at (nor what is split
// from x^2). x^2 is split, so that the exponent's rounding loses no digits.
template <class D, class V = Vec<D>>
HWY_INLINE V Gauss(D d, V x) {
  const auto visible = Abs(x) <= Set(d, 8.0f);
  x = Max(Min(Abs(x), Set(d, 8.0f)), Set(d, 0x1p-20f));
  const V x2 = x * x;
  const V e = Exp(d, Neg(x2));
  return IfThenElseZero(visible, NegFma(e, Fms(x, x, x2), e));
}

// The share of slopes below x, (1/2) erfc(-x); relative error 5e-7 above 1e-28.
template <class D, class V = Vec<D>>
HWY_INLINE V ShareBelow(D d, V x) {
  V erfcx, tail;
  ErfcxAndTail(d, Abs(x), erfcx, tail);
  const V beyond = Set(d, 0.5f) * Gauss(d, x) * erfcx;
  return Select(x < Zero(d), beyond, Set(d, 1.0f) - beyond);
}

// The x with a share u below it, given rest = 1 - u too: the smaller one decides, so that tails keep their
// digits. With y = 1 - 2 u and w = -log(1 - y^2), x / y is smooth in w and, in the tail, in its root (Giles 2010).
// Error of the share 2e-7, relative 1.5e-4 in the tails down to 1e-18; beyond, x is finite.
template <class D, class V = Vec<D>>
HWY_INLINE V NormalSlope(D d, V u, V rest) {
  const V low = Max(Min(u, rest), Set(d, 1e-18f));
  const V y = NegFma(Set(d, 2.0f), low, Set(d, 1.0f));
  const V w = Neg(Log(d, Set(d, 4.0f) * NegFma(low, low, low)));
  const V s = w - Set(d, 2.5f), t = Sqrt(Max(w, Set(d, 5.0f))) - Set(d, 4.0f);
  V p = Set(d, 3.56180843e-07f);
  p = Fma(p, s, Set(d, -3.1733454e-06f));
  p = Fma(p, s, Set(d, -4.53346292e-06f));
  p = Fma(p, s, Set(d, 0.000217219992f));
  p = Fma(p, s, Set(d, -0.00125327819f));
  p = Fma(p, s, Set(d, -0.00417599262f));
  p = Fma(p, s, Set(d, 0.246640388f));
  p = Fma(p, s, Set(d, 1.50140909f));
  V q = Set(d, 1.08927924e-05f);
  q = Fma(q, t, Set(d, -7.09540308e-05f));
  q = Fma(q, t, Set(d, 0.000141034516f));
  q = Fma(q, t, Set(d, -7.15471983e-05f));
  q = Fma(q, t, Set(d, 0.000136934429f));
  q = Fma(q, t, Set(d, -0.000875176698f));
  q = Fma(q, t, Set(d, 0.00138640936f));
  q = Fma(q, t, Set(d, 1.00948668f));
  q = Fma(q, t, Set(d, 3.83976971f));
  const V x = Select(w < Set(d, 5.0f), p, q) * y;
  return Select(u < rest, Neg(x), x);
}

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
