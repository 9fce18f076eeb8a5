// SPDX-License-Identifier: Apache-2.0
// Beckmann: pi P22 = e^(-r^2). With k = w_z / sqrt(A) the projected area is 2 sigma = sqrt(A) (k erfc(-k) + e^(-k^2) /
// sqrt(pi)); for k < 0 it is sqrt(A) e^(-k^2) tail(-k), tail as in erf-inl.h. There densities and areas are kept times
// e^(shift), shift = k^2.

#if defined(FACETWISE_BECKMANN_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_BECKMANN_INL_H_
#undef FACETWISE_BECKMANN_INL_H_
#else
#define FACETWISE_BECKMANN_INL_H_
#endif

#include "src/kernels/slopes-inl.h"
#include "src/math/erf-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

struct Beckmann : SlopeDistribution<Beckmann>, DistributionTraits {
  static constexpr bool kShifts = true;
  static constexpr bool kLongChains = true;

  // What the visible slopes' density along the azimuth depends on: (k - x) e^(-x^2), x < k, for k = |w_z| / sqrt(A).
  template <class D>
  struct Kept {
    using V = Vec<D>;
    V k;
    V beyond;  // share of all slopes above k
    V total;   // sigma / sqrt(A) in front
    HWY_INLINE Kept() {}
    HWY_INLINE Kept(D d, V k_, V erfcx, V tail) : k(k_) {
      const V half_gauss = Set(d, 0.5f) * Gauss(d, k);
      beyond = half_gauss * erfcx;
      total = Fma(half_gauss, tail, k);
    }
    // The share below x.
    HWY_INLINE V ShareBelow(D d, V x) const {
      return Fma(k, facetwise::HWY_NAMESPACE::ShareBelow(d, x), Set(d, 0.5f * kInverseRootPi) * Gauss(d, x)) / total;
    }
  };

  // w_z / sqrt(A) and sqrt(A).
  template <class D, class V = Vec<D>>
  static HWY_INLINE V Cotangent(D d, V z, V a, V& root) {
    root = Max(Sqrt(a), Set(d, kSmallestHorizontal));
    return z / root;
  }

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Area(D d, I& i) {
    V root, erfcx, tail;
    const V k = Abs(Cotangent(d, i.wz, i.a, root));
    ErfcxAndTail(d, k, erfcx, tail);
    i.kept = Kept<D>(d, k, erfcx, tail);
    i.two_sigma = (root + root) * i.kept.total;
    i.shift = Zero(d);
    if (!i.all_front) {
      i.two_sigma = Select(i.ahead, i.two_sigma, root * tail);
      i.shift = IfThenElseZero(Not(i.ahead), k * k);
    }
  }
  // sigma(w) - w_z = sigma(-w).
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void BiasedArea(D d, I& i) {
    V root;
    Cotangent(d, i.wz, i.a, root);
    i.two_normaliser = (root + root) * i.kept.total;
    i.shift = Zero(d);
  }
  // 2 sigma(-o) times e^(shift) of i: both may underflow, their quotient does not.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Areas(D d, const I& i, V, V, V z, V a, V& front, V& back, V& scale) {
    V root, erfcx, tail;
    const V k = Cotangent(d, z, a, root);
    ErfcxAndTail(d, k, erfcx, tail);
    const V scaled = root * tail;
    const V behind = scaled * Gauss(d, k);
    front = Fma(Set(d, 2.0f), z, behind);
    back = behind;
    if (!i.all_front) back = Select(i.shift > Zero(d), scaled * Exp(d, NegFma(k, k, i.shift)), behind);
    scale = Set(d, 1.0f);
  }

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V Profile(D d, const I&, V x, V y, V shift) {
    return Exp(d, shift - Fma(x, x, y * y));
  }

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void DrawSlope(D d, const I&, V u1, V u2, V& x, V& y) {
    PolarSlope(d, Sqrt(NegLog1m(d, u1)), u2, x, y);
  }
  template <class D, class V = Vec<D>>
  static HWY_INLINE V SquaredRadius(D d, V u, V rest) {
    return Select(u < Set(d, 0.5f), NegLog1m(d, Min(u, Set(d, 0.5f))), Neg(Log(d, Max(rest, Set(d, 1e-37f)))));
  }
  template <class D, class V = Vec<D>>
  static HWY_INLINE V Within(D d, V r2, V& beyond) {
    beyond = Exp(d, Neg(r2));
    const V small = Expm1(d, Min(r2, Set(d, 1.0f)));
    return Select(r2 < Set(d, 0.3f), small * beyond, Set(d, 1.0f) - beyond);
  }

  // Visible slopes by inversion: x along the azimuth, y independent of it.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void DrawVisible(D d, const I& i, V horizontal, V u1, V u2, V& x, V& y, V& im) {
    V t;
    FrontSlope(d, i.kept, u1, x, t);
    im = Select(i.kept.k > Set(d, 1.0f), Max(NegFma(horizontal, x, i.wz), Zero(d)), horizontal * t);
    if (!i.all_front) {
      V behind_x;
      BehindSlope(d, i.kept.k, u1, behind_x, t);
      x = Select(i.ahead, x, behind_x);
      im = Select(i.ahead, im, horizontal * t);
    }
    y = NormalSlope(d, u2, Set(d, 1.0f) - u2);
  }

  // The x with a share u of the visible slopes below, and t = k - x. In the share P of all slopes, which are
  // I(P) = e^(-x^2) / sqrt(pi) dense, that of the visible ones is (k P + I(P) / 2) / total. A start in P, fitted in
  // 1 / (1 + k^2 / 4) and sqrt(1 - u), gives x by NormalSlope(); as P is known there, one step of Householder's third
  // order leaves 2e-8, and float 5e-7. Of x and t the smaller is kept to all digits: x for k > 1.
  template <class D, class V = Vec<D>>
  static HWY_NOINLINE void FrontSlope(D d, const Kept<D>& kept, V u, V& x, V& t) {
    const V one = Set(d, 1.0f), half = Set(d, 0.5f), fifth = Set(d, 0.2f);
    u = Max(u, Set(d, 0x1p-26f));
    // Beyond 1e6 a slope's distribution does not change.
    const V far = Set(d, 1e7f), k = Min(kept.k, far), total = Min(kept.total, far);
    const V rest = one - u, root = Sqrt(rest);
    const V near = one / Fma(Set(d, 0.25f) * k, k, one);
    V excess = Set(d, 0.0f);  // P is (share below k) u (1 - excess)
    for (const auto& row : kFrontStart) {
      V p = Set(d, row[0]);
      for (int c = 1; c < 4; ++c) p = Fma(p, near, Set(d, row[c]));
      excess = Fma(excess, root, p);
    }
    excess = excess * (near * root);
    const V share = one - kept.beyond;
    const V p = share * u * (one - excess);
    x = NormalSlope(d, p, Fma(share, Fma(u, excess, rest), kept.beyond));
    t = Max(k - x, half * root);
    const auto by_x = k > one;
    x = Select(by_x, x, k - t);

    // With F the share below x: n = (u - F) total, g = F' t total.
    const V gauss = Set(d, kInverseRootPi) * Gauss(d, x);
    const V n = NegFma(k, p, NegFma(half, gauss, total * u));
    const V g = gauss * (t * t), g2 = g * g, xt = x * t;
    const V third = Fma(xt, xt, NegFma(half * t, t, xt)) * Set(d, 2.0f / 3.0f);
    const V denominator = Fma(n * n, third, NegFma(Fma(Set(d, 2.0f), xt, one), g * n, g2));
    const V change = t * n * NegFma(xt + half, n, g) / Max(denominator, fifth * g2);
    const V least = fifth * t;
    x = Min(x + change, k - least);
    t = Max(t - change, least);
    t = Select(by_x, k - x, t);
    x = Select(by_x, x, k - t);
  }

  // The same behind, for -k. With the functions of erf-inl.h the integral below x is (1/2) e^(-x^2) (tail(-x) + t
  // erfcx(-x)), and in all (1/2) e^(-k^2) tail(k), by which e^(-x^2) is divided before it is formed: x^2 - k^2 =
  // t (t + 2 k). The start is fitted between t^2 = -log u for k = 0 and 2 k t - log(1 + 2 k t) = -log u for k = infinity.
  // Three Halley steps; error of the share 1e-6.
  template <class D, class V = Vec<D>>
  static HWY_NOINLINE void BehindSlope(D d, V k, V u, V& x, V& t) {
    const V one = Set(d, 1.0f), half = Set(d, 0.5f), two = Set(d, 2.0f);
    u = Max(u, Set(d, 0x1p-26f));
    k = Min(k, Set(d, 1e7f));
    V erfcx, tail;
    ErfcxAndTail(d, k, erfcx, tail);
    const V inverse_total = two / tail;
    const V l = Neg(Log(d, u));
    const V far = l + Log(d, one + Fma(Set(d, 0.9f), l, Sqrt(l + l)));
    const V weight = k / (k + Set(d, 0.6f));
    const V sum = Fma(weight, far - l, l);
    t = Max(sum / (k + Sqrt(Fma(k, k, sum))), Set(d, 1e-20f));
    for (int step = 0; step < 3; ++step) {
      V e, r;
      ErfcxAndTail(d, k + t, e, r);
      const V gauss = Exp(d, Neg(t * Fma(two, k, t)));
      const V f = Fma(half * gauss * Fma(t, e, r), inverse_total, Neg(u));
      // dF/dt = -slope
      const V slope = Set(d, kInverseRootPi) * t * gauss * inverse_total;
      const V ratio = f / Max(slope, Set(d, 1e-30f));
      const V bend = NegFma(two, k + t, one / t);
      t = Max(t + ratio / Max(Fma(half * ratio, bend, one), Set(d, 0.3f)), t * Set(d, 0.2f));
    }
    x = Neg(k + t);
  }

  // V-cavity behind, k = |i_z| / sqrt(A): H = (S(k) - S(3 k)) / (2 k) with S(x) = e^(-x^2) tail(x), times e^(k^2). For
  // small k its series, 1 + sum of c_n k^(2 n - 1) (1 - 9^n) / 2, c_n = (-1)^(n + 1) / (sqrt(pi) n! (2 n - 1)).
  template <class D, class I, class V = Vec<D>>
  static HWY_NOINLINE void TwoHit(D d, const I& i, V& two_hit, V& shift) {
    V root, erfcx, tail, erfcx3, tail3;
    const V k = Cotangent(d, Abs(i.z), i.a, root);
    ErfcxAndTail(d, k, erfcx, tail);
    ErfcxAndTail(d, Set(d, 3.0f) * k, erfcx3, tail3);
    const V k2 = k * k;
    const V far = NegFma(Exp(d, Set(d, -8.0f) * k2), tail3, tail) / Max(k, Set(d, 0.01f));
    const V x = Min(k, Set(d, 0.25f)), x2 = x * x;
    V p = Set(d, 0.0f);
    for (const float c : kHitSeries) p = Fma(p, x2, Set(d, c));
    const V near = Fma(x, p, Set(d, 2.0f)) * Exp(d, x2);
    two_hit = Select(k < Set(d, 0.25f), near, far);
    shift = IfThenElseZero(Not(i.front), k2);
  }
  // Tokuyoshi 2021, listings 1, 4 and 5: the first part are slopes below 3 k (k < 0), the second visible ones between 3
  // k and k.
  template <class D, class I, class V = Vec<D>>
  static HWY_NOINLINE void DrawBehindCavity(D d, const I& i, V u1, V u2, V& u3, V& x, V& y, V& im) {
    const V one = Set(d, 1.0f), two = Set(d, 2.0f), half = Set(d, 0.5f);
    V root;
    const V k = Cotangent(d, Abs(i.z), i.a, root);
    const V k3 = Set(d, 3.0f) * k;
    V erfcx3, tail3, erfcx, tail;
    ErfcxAndTail(d, k3, erfcx3, tail3);
    ErfcxAndTail(d, k, erfcx, tail);
    const V fall = Exp(d, Set(d, -8.0f) * k * k);
    // 2 s / H, both times e^(k^2)
    const V probability = Min(two * erfcx3 * fall / i.two_sigma, one);
    const auto first = u3 < probability;
    const V share = Select(first, probability, one - probability);
    u3 = Min(Select(first, u3, u3 - probability) / Max(share, Set(d, kTiny)), Set(d, kLargestBelowOne));

    // First: the share u1 s of all slopes. It may underflow: then x = -3 k - t with t almost exponential.
    const V s = half * erfcx3 * Gauss(d, k3);
    const V low = Max(u1, Set(d, 0x1p-26f));
    const V normal = NormalSlope(d, low * s, one - low * s);
    const V l = Neg(Log(d, low));
    const V beyond = Neg(k3 + l / (k3 + Sqrt(Fma(k3, k3, l))));
    const V first_x = Min(Select(s < Set(d, 1e-14f), beyond, normal), Neg(k3));
    // Second: of all visible slopes those above 3 k: shares above that at 3 k.
    const V at3 = fall * Fma(two * k, erfcx3, tail3) / tail;
    const V u = Fma(u1, one - at3, at3);
    V visible, gap;
    BehindSlope(d, k, Min(u, Set(d, kLargestBelowOne)), visible, gap);
    gap = Min(gap, two * k);
    const V along = Select(first, first_x, Neg(k + gap));
    const V across = NormalSlope(d, u2, one - u2);

    Azimuth<D>(d, i.wx, i.wy, root, i.a < Set(d, kSmallestA)).Turn(along, across, x, y);
    im = root * Select(first, Neg(along + k), gap);
  }

 private:
  // Of sqrt(1 - u): cubed, squared, itself; in each row of 1 / (1 + k^2 / 4) from its fourth power down.
  static constexpr float kFrontStart[3][4] = {{-5.31641293f, 6.12924242f, 1.68662f, -1.89787829f},
                                              {7.18497944f, -8.1968708f, -3.44422722f, 3.47614217f},
                                              {-2.8960855f, 4.8478775f, -0.897981703f, 0.0613693595f}};
  // c_n (1 - 9^n), n = 8 ... 1.
  static constexpr float kHitSeries[] = {40.1562682f, -41.1859085f, 37.8576909f, -30.8465431f,
                                         22.0302599f, -13.6910006f, 7.52252778f, -4.51351667f};
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
