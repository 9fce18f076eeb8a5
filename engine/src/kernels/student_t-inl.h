// SPDX-License-Identifier: Apache-2.0
// Student-t of gamma = 3: pi P22 = 8 / (2 + r^2)^3. With slopes measured by sqrt(2) alpha it is 2 / (1 + r^2)^3, the
// normals of a sphere weighted by 2 m_hat_z^2, and all is algebraic: for a w that is stretched so, of length nu, 2 sigma = (nu +
// w_z)^2 / (2 nu).

#if defined(FACETWISE_STUDENT_T_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_STUDENT_T_INL_H_
#undef FACETWISE_STUDENT_T_INL_H_
#else
#define FACETWISE_STUDENT_T_INL_H_
#endif

#include "src/kernels/slopes-inl.h"
#include "src/math/roots-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

struct StudentT : SlopeDistribution<StudentT>, DistributionTraits {
  static constexpr bool kLongChains = true;

  // nu + z, and nu itself, for w stretched by sqrt(2) more; behind by its conjugate.
  template <class D, class V = Vec<D>>
  static HWY_INLINE V Sum(D d, V z, V a, V& nu) {
    const V a2 = Max(a + a, Set(d, kSmallestA));
    nu = Sqrt(Fma(z, z, a2));
    const V larger = nu + Abs(z);
    return Select(z > Zero(d), larger, a2 / larger);
  }
  template <class D>
  struct Kept {
    Vec<D> nu, sum;  // of w, as Sum() gives them
    HWY_INLINE Kept() {}
    template <class I>
    HWY_INLINE Kept(D d, const I& i) : sum(Sum(d, i.wz, i.a, nu)) {}
  };
  template <class D, class I>
  static HWY_INLINE void Area(D d, I& i) {
    i.kept = Kept<D>(d, i);
    i.two_sigma = i.kept.sum * i.kept.sum / (i.kept.nu + i.kept.nu);
  }
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void BiasedArea(D d, I& i) {
    V nu;
    const V sum = Sum(d, Abs(i.wz), i.a, nu);
    i.two_normaliser = sum * sum / (nu + nu);
  }
  // nu - z is 2 A / (nu + z).
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Areas(D d, const I&, V, V, V z, V a, V& front, V& back, V& scale) {
    V nu;
    const V sum = Sum(d, z, a, nu), a2 = a + a;
    back = a2 * a2;
    scale = (nu + nu) * (sum * sum);
    front = sum * sum / (nu + nu);
  }

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V Profile(D d, const I&, V x, V y, V) {
    const V two = Set(d, 2.0f);
    const V c = two / (two + Fma(x, x, y * y));
    return c * c * c;
  }

  // Share of slopes within r: 1 - (1 + r^2 / 2)^-2.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void DrawSlope(D d, const I&, V u1, V u2, V& x, V& y) {
    PolarSlope(d, Sqrt(SquaredRadius(d, u1, Set(d, 1.0f) - u1)), u2, x, y);
  }
  template <class D, class V = Vec<D>>
  static HWY_INLINE V SquaredRadius(D, V u, V rest) {
    const V v = Sqrt(rest);
    return (u + u) / Fma(v, v, v);
  }
  // That share for r^2, and what is beyond.
  template <class D, class V = Vec<D>>
  static HWY_INLINE V Within(D d, V r2, V& beyond) {
    const V half = r2 * Set(d, 0.5f), v = Set(d, 1.0f) / (Set(d, 1.0f) + half);
    beyond = v * v;
    return half * Fma(v, v, v);  // 1 - v^2 = (1 - v)(1 + v), 1 - v = half v
  }

  // In the frame stretched by sqrt(2) alpha, x = (t - 1/t) / 2; x's largest value has t = T = (1 + c) / s. The share
  // below t = T z is
  //   F(z) = z^3 ((T^2 - 1) z (3 + T^2 z^2) + 4) (1 + T^2) / (1 + T^2 z^2)^3,
  // solved by one step of Householder's third order, and another in the tails and for T < 1: error of F 3e-7, and of float
  // 8e-7. It starts from the solutions for T = 1 and T = infinity in q = (t^2 - 1) / (t^2 + 1), between which it is fitted in
  // s and in the q for T = 1; for T < 1 from that solution in z. Given x, y's share is that of a fixed density.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void DrawVisible(D d, const I& i, V horizontal, V u1, V u2, V& x, V& y, V& im) {
    DrawVisible(d, i.kept, i.wz, horizontal, u1, u2, x, y, im);
  }
  template <class D, class V = Vec<D>>
  static HWY_NOINLINE void DrawVisible(D d, const Kept<D>& kept, V wz, V horizontal, V u1, V u2, V& x, V& y, V& im) {
    const V zero = Zero(d), one = Set(d, 1.0f), half = Set(d, 0.5f), root2 = Set(d, kRoot2);
    const V sum = kept.sum, nu = kept.nu;
    // Nearer to straight down the share changes by 1e-7 at most.
    const V t_max = Min(sum / (root2 * Max(horizontal, Set(d, kSmallestHorizontal))), Set(d, 0x1p22f));
    const V t2 = t_max * t_max;
    const V one_t2 = one + t2, inverse_one_t2 = one / one_t2;

    const V u = Max(u1, Set(d, 0x1p-26f)), rest = one - u;
    const V inverse_root = RoughInverseCubeRoot(d, u);
    const V s1 = u * inverse_root * inverse_root;  // cube root
    const V q1 = Sqrt(Max(NegFma(s1, s1, one), zero));
    const V root = Sqrt(Min(u, rest) * Set(d, 4.0f / 3.0f));
    const V end = Fma(root * root,
                      Fma(root, Fma(root, Set(d, 0.162819401f), Set(d, -0.0240250002f)), Set(d, 0.185360655f)), root);
    const auto lower = u < half;
    // 1 + q for T = 1 and T = infinity
    const V from = s1 * s1 / (one + q1), to = Select(lower, end, Set(d, 2.0f) - end);
    const V c = Max((t2 - one) * inverse_one_t2, zero), s = (t_max + t_max) * inverse_one_t2;
    const V bend0 = Fma(q1, Fma(q1, Set(d, 1.130053f), Set(d, 0.19003615f)), Set(d, 0.01235261f));
    const V bend1 = Fma(q1, Fma(q1, Set(d, -0.76910435f), Set(d, 0.05782772f)), Set(d, -0.00966852f));
    const V onep = Fma(NegFma(c * s, Fma(s, bend1, bend0), c), to - from, from);
    V z = onep / (Sqrt(onep * (Set(d, 2.0f) - onep)) * Max(t_max, one));
    z = Min(z, Set(d, 1.0f - 0x1p-12f));
    z = Householder(d, z, u, t2, one_t2);
    const auto again = Or(Min(u, rest) < Set(d, 0x1p-10f), t_max < one);
    if (!AllFalse(d, again)) z = Select(again, Householder(d, z, u, t2, one_t2), z);
    const V t = t_max * z, inverse_t = one / t;
    x = root2 * half * (t - inverse_t);
    // w_z - horizontal x = nu (1 - z)(T^2 z + 1) / (z (1 + T^2)); near straight down, where T is not w's, by the slope.
    im = nu * ((one - z) * Fma(t2, z, one)) * (t_max * inverse_t * inverse_one_t2);
    im = Select(t_max > Set(d, 64.0f), Max(NegFma(horizontal, x, wz), zero), im);
    // y = sqrt(1 + x^2) times a number with density ~ (1 + y^2)^-3.
    y = root2 * half * (t + inverse_t) * Conditional(d, u2);
  }

  // One step from z towards F(z) = u.
  template <class D, class V = Vec<D>>
  static HWY_INLINE V Householder(D d, V z, V u, V t2, V one_t2) {
    const V one = Set(d, 1.0f), half = Set(d, 0.5f), quarter = Set(d, 0.25f);
    const V zz = z * z, t2z = t2 * z;
    const V inverse_b = one / Fma(t2, zz, one);
    const V scale = one_t2 * (inverse_b * inverse_b * inverse_b);
    const V f = NegFma(zz * z * Fma((t2 - one) * z, Fma(t2z, z, Set(d, 3.0f)), Set(d, 4.0f)), scale, u);
    // F' = 12 z w (1 + T^2) / b^4 with w = z (1 - z)(T^2 z + 1). The first and second derivative of log F', times w
    // and w^2: `bend`, `bend2`.
    const V gone = one - z, linear = t2z + one;
    const V a0 = gone * linear, a1 = z * linear, a2 = t2z * gone, w = z * a0;
    const V slope = Set(d, 12.0f) * w * w * z * (scale * inverse_b);  // F' w
    const V inner = Set(d, 8.0f) * t2 * inverse_b * w;
    const V bend = NegFma(inner, z, a0 + a0 - a1 + a2);
    const V bend2 =
        Fma(inner * w, Fma(t2z * z, inverse_b + inverse_b, Neg(one)), Neg(Fma(a0 + a0, a0, Fma(a1, a1, a2 * a2))));
    const V slope2 = slope * slope;
    const V third = Fma(bend, bend, bend2) * Set(d, 1.0f / 6.0f);
    const V denominator = Fma(f * f, third, Fma(bend * slope, f, slope2));
    const V change = w * f * Fma(half * bend, f, slope) / Max(denominator, Set(d, 0.2f) * slope2);
    // Where rounding decides how near to 1 it is, one step does not go so near that the next cannot come back.
    return Min(Max(z + change, z * quarter), NegFma(quarter, gone, one));
  }

  // V-cavity behind. With k = |i_z| / sqrt(A), n(k)^2 = 2 + k^2 and sigma(-i) / sqrt(A) = 1 / D(k), D(k) = n (n + k)^2,
  // H = (1 / D(k) - 1 / D(3 k)) / k. By D = 2 n (1 + k^2) + 2 k (2 + k^2) the difference D(3 k) - D(k) is k times a sum
  // of positive terms.
  template <class D, class I, class V = Vec<D>>
  static HWY_NOINLINE void TwoHit(D d, const I& i, V& two_hit, V&) {
    const Behind<D> at(d, i);
    const V difference = Fma(Set(d, 16.0f) * at.k, at.n3 + Fma(at.k, at.k, Set(d, 1.0f)) / (at.n1 + at.n3),
                             Fma(Set(d, 52.0f), at.k * at.k, Set(d, 8.0f)));
    const V hit = difference / at.d3 / at.d1;
    two_hit = hit + hit;
  }
  // Tokuyoshi 2021, listings 1 and 4: the first part are slopes below -3 k, the second visible ones from -3 k to -k.
  template <class D, class I, class V = Vec<D>>
  static HWY_NOINLINE void DrawBehindCavity(D d, const I& i, V u1, V u2, V& u3, V& x, V& y, V& im) {
    const V one = Set(d, 1.0f), two = Set(d, 2.0f), three = Set(d, 3.0f), four = Set(d, 4.0f);
    const Behind<D> at(d, i);
    // The share of slopes below -3 k is q^2 (3 - q) / 4, q = 1 - 3 k / n(3 k).
    const V q3 = two / (at.n3 * (at.n3 + three * at.k));
    const V beyond = q3 * q3 * (three - q3) * Set(d, 0.25f);
    const V probability = Min(four * beyond / i.two_sigma, one);
    const auto first = u3 < probability;
    const V share = Select(first, probability, one - probability);
    u3 = Min(Select(first, u3, u3 - probability) / Max(share, Set(d, kTiny)), Set(d, kLargestBelowOne));

    // First: q for the share u1 of those below -3 k, by Newton's method. In units of q3, which may be tiny:
    // z^2 (3 - q3 z) = u1 (3 - q3).
    const V low = Max(u1, Set(d, 0x1p-26f));
    const V right = low * (three - q3);
    V z = Sqrt(right / (three - q3 * Sqrt(low)));
    for (int step = 0; step < 2; ++step) {
      const V f = Fma(z * z, NegFma(q3, z, three), Neg(right));
      z = z - f / (three * z * NegFma(q3, z, two));
    }
    const V q = q3 * Min(z, one);
    // x = -sqrt(2) s / sqrt(1 - s^2), s = 1 - q
    const V root2 = Set(d, kRoot2);
    const V wide = one / Sqrt(q * (two - q));  // sqrt(1 + x^2 / 2)
    const V first_x = Neg(Max(root2 * (one - q) * wide, three * at.k));
    const V first_y = root2 * wide * Conditional(d, u2);
    // Second: of all visible slopes those above -3 k: shares above that at -3 k, D(k) (1 / D(3 k) + 2 k beyond).
    const V at3 = at.d1 * Fma(two * at.k, beyond, one / at.d3);
    const V u = Min(Fma(u1, one - at3, at3), Set(d, kLargestBelowOne));
    V second_x, second_y, second_im;
    DrawVisible(d, Kept<D>(d, i), i.wz, at.root, u, u2, second_x, second_y, second_im);
    // Rounding may put it beyond -3 k.
    second_x = Max(second_x, Neg(three * at.k));
    second_im = Min(second_im, two * Abs(i.z));

    Azimuth<D>(d, i.wx, i.wy, at.root, i.a < Set(d, kSmallestA))
        .Turn(Select(first, first_x, second_x), Select(first, first_y, second_y), x, y);
    im = Select(first, at.root * Neg(first_x + at.k), second_im);
  }

 private:
  static constexpr float kRoot2 = 1.41421356f;
  // k, n and D at k and 3 k; sqrt(A).
  template <class D>
  struct Behind {
    using V = Vec<D>;
    V root, k, n1, n3, d1, d3;
    template <class I>
    HWY_INLINE Behind(D d, const I& i) {
      const V two = Set(d, 2.0f);
      root = Sqrt(Max(i.a, Set(d, kSmallestA)));
      k = Abs(i.z) / root;
      const V k3 = Set(d, 3.0f) * k;
      n1 = Sqrt(Fma(k, k, two));
      n3 = Sqrt(Fma(k3, k3, two));
      const V sum1 = n1 + k, sum3 = n3 + k3;
      d1 = n1 * sum1 * sum1;
      d3 = n3 * sum3 * sum3;
    }
  };
  // The y with density 8 / (3 pi (1 + y^2)^3) and share u below. Both tails fall with y^-5: y is (1 - u)^(-1/5) -
  // u^(-1/5) times a smooth function of (4 u (1 - u))^(1/5), fitted by a polynomial. Error of the share 2e-7.
  template <class D, class V = Vec<D>>
  static HWY_INLINE V Conditional(D d, V u) {
    const V low = Max(u, Set(d, 0x1p-26f)), high = Set(d, 1.0f) - u;
    const V of_low = InverseFifthRoot(d, low), of_high = InverseFifthRoot(d, high);
    const V k = Set(d, 1.31950791f) / (of_low * of_high);  // times 4^(1/5)
    V p = Set(d, -0.0154215065f);
    p = Fma(p, k, Set(d, 0.057050321f));
    p = Fma(p, k, Set(d, -0.0578400181f));
    p = Fma(p, k, Set(d, -0.0240463937f));
    p = Fma(p, k, Set(d, 0.0371487362f));
    p = Fma(p, k, Set(d, 0.0521361166f));
    p = Fma(p, k, Set(d, 0.531557542f));
    p = Fma(p, k, Set(d, 0.701406545f));
    return p * (of_high - of_low);
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
