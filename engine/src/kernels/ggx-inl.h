// SPDX-License-Identifier: Apache-2.0
// GGX: 2 sigma(i) = w_z + nu; D(m) = (M.M)^2 / (|m_hat|^4 pi ax ay).

#if defined(FACETWISE_GGX_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_GGX_INL_H_
#undef FACETWISE_GGX_INL_H_
#else
#define FACETWISE_GGX_INL_H_
#endif

#include "src/kernels/ggx_cone-inl.h"
#include "src/kernels/sampler-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

struct Ggx : DistributionTraits {
  static constexpr bool kQuick = true;
  static constexpr bool kHasShareUnoccluded = true;

  template <class D, class I>
  static HWY_INLINE void Area(D d, I& i) {
    i.two_sigma = i.nu + i.wz;
    // Behind the surface w_z + nu cancels: A / (nu - w_z).
    if (!i.all_front) i.two_sigma = Select(i.ahead, i.two_sigma, Max(i.a, Set(d, kSmallestA)) / (i.nu - i.wz));
  }
  template <class D, class I>
  static HWY_INLINE void BiasedArea(D, I& i) {
    i.two_normaliser = i.nu + Abs(i.wz);
  }

  // For a direction o in front of the surface, its z' and A: 2 sigma(o), and 2 sigma(-o) as back / scale.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Areas(D, const I&, V, V, V z, V a, V& front, V& back, V& scale) {
    front = z + Sqrt(Fma(z, z, a));
    back = a;
    scale = front;
  }

  // pi ax ay D(m) for m of any length: q^2 with q = |m|^2 (ax ay)^2 / ((m_x ay)^2 + (m_y ax)^2 + (m_z ax ay)^2). Needs
  // |m|^2 above 2^-40, where nothing underflows.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V Density(D, const I& i, V mx, V my, V mz, V m2, V) {
    Centre(i, mx, my, mz);
    const V axy = i.ax * i.ay;
    const V x = mx * i.ay, y = my * i.ax, z = mz * axy;
    const V q = m2 * (axy * axy) / Dot(x, y, z, x, y, z);
    return q * q;
  }

  // pi P22 of a standard slope.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V Profile(D d, const I&, V x, V y, V) {
    const V one = Set(d, 1.0f), c = one / (one + Fma(x, x, y * y));
    return c * c;
  }

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void DrawSlope(D d, const I&, V u1, V u2, V& x, V& y) {
    V sin, cos;
    SinCosTurn(d, u2, sin, cos);
    const V r = Sqrt(u1 / (Set(d, 1.0f) - u1));
    x = r * cos;
    y = r * sin;
  }
  // r^2 of the slopes of which a share u is within r, given 1 - u too; that share for r^2, and the one beyond.
  template <class D, class V = Vec<D>>
  static HWY_INLINE V SquaredRadius(D, V u, V rest) {
    return u / rest;
  }
  template <class D, class V = Vec<D>>
  static HWY_INLINE V Within(D d, V r2, V& beyond) {
    beyond = Set(d, 1.0f) / (Set(d, 1.0f) + r2);
    return r2 * beyond;
  }

  // V-cavity behind. 2 H: with k = |i_z|, r1^2 = A + k^2, r3^2 = A + 9 k^2,
  // H = (r1 - k + r3 - 3 k) / (r1 + r3), the differences by their conjugates.
  template <class D, class I, class V = Vec<D>>
  static HWY_NOINLINE void TwoHit(D d, const I& i, V& two_hit, V&) {
    const V a = Max(i.a, Set(d, kSmallestA));
    const V k = Abs(i.z), k3 = Set(d, 3.0f) * k;
    const V r1 = Sqrt(Fma(k, k, a)), r3 = Sqrt(Fma(k3, k3, a));
    const V two_a = a + a;
    two_hit = (two_a / (r1 + k) + two_a / (r3 + k3)) / (r1 + r3);
  }
  // Tokuyoshi 2021, listings 1 to 3, for c < 0. With a share 2 s / H the normal, drawn in proportion to m_hat_z, faces
  // the direction with 3 c instead of c; else it is a visible one that does not. Both as in `heitz`
  // (ggx_samplers-inl.h) with another s; the second ends at L = -(1 + 2 c^2) / r, r^2 = 1 + 8 c^2.
  template <class D, class I, class V = Vec<D>>
  static HWY_NOINLINE void DrawBehindCavity(D d, const I& i, V u1, V u2, V& u3, V& x, V& y, V& im) {
    const V one = Set(d, 1.0f), half = Set(d, 0.5f), two = Set(d, 2.0f), three = Set(d, 3.0f);
    const V a = Max(i.a, Set(d, kSmallestA));
    const V horizontal = Sqrt(a), nu = Sqrt(Fma(i.z, i.z, a));
    const Azimuth<D> azimuth(d, i.wx, i.wy, horizontal, i.a < Set(d, kSmallestA));
    const V k = Abs(i.z) / nu, s = horizontal / nu;  // -c and the sine
    const V k2 = k * k, s2 = s * s;
    const V r = Sqrt(Fma(Set(d, 8.0f), k2, one));
    const V facing = half * s2 / (r * Fma(three, k, r));
    const V other = two * k2 * s2 / (r * (Fma(two, k2, one) + r));
    const V probability = Min(Set(d, 4.0f) * facing / i.two_sigma, one);
    const auto first = u3 < probability;
    const V share = Select(first, probability, one - probability);
    u3 = Min(Select(first, u3, u3 - probability) / Max(share, Set(d, kTiny)), Set(d, kLargestBelowOne));

    const DiscChord<D> disc(d, u1, u2);
    const V big_r = disc.big_r, b = disc.b, p = disc.p;
    const V part = Select(first, facing, other);
    const V t2 = NegFma(part, b, big_r);
    const V up = Sqrt(part * b * Fma(one - part, b, p));  // sqrt(R^2 - t2^2)

    // First: m_hat = t2 e + up n. Second: m_hat = t2 (k e + s n) + up (s e - k n), in whose z
    // t2 s - up k = (t2 - R k)(t2 + R k) / (t2 s + up k), t2 - R k = R (|L| - k) + part p.
    const V gap = s2 * (one / (one + k) - Set(d, 4.0f) * k2 / (r * (Fma(two, k2, one) + r)));
    const V second_z = Fma(big_r, gap, part * p) * Fma(big_r, k, t2) / Fma(t2, s, up * k);
    const V along = Select(first, t2, Fma(t2, k, up * s));
    const V z = Max(Select(first, up, second_z), Set(d, kHorizon));
    const V inverse = Neg(one / z);
    azimuth.Turn(along * inverse, disc.t1 * inverse, x, y);
    // By the slope itself, so that o is its reflection.
    im = NegFma(i.wx, x, NegFma(i.wy, y, i.wz));
  }

  // K / sigma(i).
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V ShareUnoccluded(D d, const I& i) {
    return ShareInCone(d, i);
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
