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

  // w_z / sqrt(A) and sqrt(A).
  template <class D, class V = Vec<D>>
  static HWY_INLINE V Cotangent(D d, V z, V a, V& root) {
    root = Sqrt(Max(a, Set(d, kSmallestA)));
    return z / root;
  }
  // 2 sigma for |z|: sigma(w) - w_z = sigma(-w).
  template <class D, class V = Vec<D>>
  static HWY_INLINE V FrontArea(D d, V k, V root, V tail) {
    k = Abs(k);
    return Fma(root * tail, Gauss(d, k), (root + root) * k);
  }

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Area(D d, I& i) {
    V root, erfcx, tail;
    const V k = Cotangent(d, i.wz, i.a, root);
    ErfcxAndTail(d, Abs(k), erfcx, tail);
    i.two_sigma = FrontArea(d, k, root, tail);
    i.shift = Zero(d);
    if (!i.all_front) {
      i.two_sigma = Select(i.ahead, i.two_sigma, root * tail);
      i.shift = IfThenElseZero(Not(i.ahead), k * k);
    }
  }
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void BiasedArea(D d, I& i) {
    V root, erfcx, tail;
    const V k = Cotangent(d, i.wz, i.a, root);
    ErfcxAndTail(d, Abs(k), erfcx, tail);
    i.two_normaliser = FrontArea(d, k, root, tail);
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
  static HWY_INLINE void DrawVisible(D d, const I&, V c, V s, V u1, V u2, V& x, V& y, V& gap) {
    const V one = Set(d, 1.0f);
    const V k = c / Max(s, Set(d, kVertical));
    V t;
    VisibleSlope(d, k, u1, x, t);
    gap = Select(k > one, Max(NegFma(s, x, c), Zero(d)), s * t);
    y = NormalSlope(d, u2, one - u2);
  }

  // The x with a share u of the visible slopes below, and t = k - x; their density is (k - x) e^(-x^2), x < k. With X =
  // |x| and the functions of erf-inl.h, the integral below x is
  //   (1/2) e^(-X^2) (tail(X) + t erfcx(X)) for x < 0,   k - (1/2) e^(-X^2) (t erfcx(X) - tail(X)) for x > 0,
  // and in all k + (1/2) e^(-k^2) tail(k), for k < 0 (1/2) e^(-k^2) tail(-k), by which e^(-X^2) is then divided
  // before it is formed: k^2 - X^2 = -t (t - 2 k). Of x and t the smaller is kept to all digits: x for k > 1. Three
  // Halley steps; error of the share 1e-6.
  template <class D, class V = Vec<D>>
  static HWY_NOINLINE void VisibleSlope(D d, V k, V u, V& x, V& t) {
    const V zero = Zero(d), one = Set(d, 1.0f), half = Set(d, 0.5f);
    u = Max(u, Set(d, 0x1p-26f));
    const V rest = one - u;
    // Beyond 1e6 a slope's distribution does not change, in units of its own spread.
    k = Min(Max(k, Set(d, -1e7f)), Set(d, 1e7f));
    const V abs_k = Abs(k);
    V erfcx, tail;
    ErfcxAndTail(d, abs_k, erfcx, tail);
    const auto front = k > zero;
    const bool all_front = AllTrue(d, front);  // of k, which may be 0 where w_z is not

    // The start. In front: the share of all slopes that are below x is u for k = infinity, and fitted for k -> 0.
    V inverse_total;
    {
      const V share = NegFma(half * Gauss(d, abs_k), erfcx, one);
      const V lambda = one / Fma(abs_k, Fma(abs_k, Set(d, 0.291728f), Set(d, 0.201865f)), one);
      const V root = Sqrt(rest);
      const V p = share * u * NegFma(lambda * root, NegFma(Set(d, 0.0583548f), rest, Set(d, 0.815317f)), one);
      x = NormalSlope(d, p, one - p);
      t = Max(k - x, IfThenElseZero(k < Set(d, 3.0f), Set(d, 0.526524f) * root));
      inverse_total = one / Fma(half * Gauss(d, abs_k), tail, abs_k);
    }
    // Behind: t^2 = -log u for k = 0, and 2 |k| t - log(1 + 2 |k| t) = -log u for k = -infinity.
    if (!all_front) {
      const V l = Neg(Log(d, u));
      const V far = l + Log(d, one + Fma(Set(d, 0.9f), l, Sqrt(l + l)));
      const V weight = abs_k / (abs_k + Set(d, 0.6f));
      const V sum = Fma(weight, far - l, l);
      t = Select(front, t, sum / (abs_k + Sqrt(Fma(abs_k, abs_k, sum))));
      inverse_total = Select(front, inverse_total, Set(d, 2.0f) / tail);
    }
    t = Max(t, Set(d, 1e-20f));
    const auto by_x = k > one;
    x = Select(And(by_x, k >= Set(d, 3.0f)), x, k - t);
    const V k_in_exponent = IfThenElseZero(Not(front), abs_k);
    for (int step = 0; step < 3; ++step) {
      V e, r;
      ErfcxAndTail(d, Abs(x), e, r);
      // x^2 - k^2 behind, x^2 in front
      const V exponent = Select(front, x * x, t * Fma(Set(d, 2.0f), k_in_exponent, t));
      const V gauss = Exp(d, Neg(exponent));
      const V te = t * e;
      const V below = half * gauss * (r + te), above = NegFma(half * gauss, te - r, k);
      const V f = Fma(Select(x > zero, above, below), inverse_total, Neg(u));
      // dF/dt = -slope
      const V slope = Set(d, kInverseRootPi) * t * gauss * inverse_total;
      const V ratio = f / Max(slope, Set(d, 1e-30f));
      const V bend = Fma(Set(d, 2.0f), x, one / t);
      const V change = ratio / Max(Fma(half * ratio, bend, one), Set(d, 0.3f));
      const V least = t * Set(d, 0.2f);
      x = Select(by_x, Min(x - change, k - least), x);
      t = Select(by_x, Max(k - x, Set(d, 1e-9f)), Max(t + change, least));
      x = Select(by_x, x, k - t);
    }
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
    VisibleSlope(d, Neg(k), Min(u, Set(d, kLargestBelowOne)), visible, gap);
    gap = Min(gap, two * k);
    const V along = Select(first, first_x, Neg(k + gap));
    const V across = NormalSlope(d, u2, one - u2);

    Azimuth<D>(d, i.wx, i.wy, root, i.a < Set(d, kSmallestA)).Turn(along, across, x, y);
    im = root * Select(first, Neg(along + k), gap);
  }

 private:
  // c_n (1 - 9^n), n = 8 ... 1.
  static constexpr float kHitSeries[] = {40.1562682f, -41.1859085f, 37.8576909f, -30.8465431f,
                                         22.0302599f, -13.6910006f, 7.52252778f, -4.51351667f};
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
