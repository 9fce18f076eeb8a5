// SPDX-License-Identifier: Apache-2.0
// The published samplers of GGX with Smith masking: ndf, heitz, cap, bounded.

#if defined(FACETWISE_GGX_SAMPLERS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_GGX_SAMPLERS_INL_H_
#undef FACETWISE_GGX_SAMPLERS_INL_H_
#else
#define FACETWISE_GGX_SAMPLERS_INL_H_
#endif

#include "src/kernels/ggx-inl.h"
#include "src/kernels/sampler-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// m_hat_z (times nu, for half vectors) is kept above this; its square does not underflow.
inline constexpr float kSmallestZ = 0x1p-62f;

// Normals with density D(m) m_z (Walter 2007, Eqs. 35, 36): p(o) = D(m) m_z / (4 |i.m|).
struct GgxNdf : SamplerTraits, UnitNormals {
  static constexpr bool kReadsArea = false;
  static constexpr bool kVisible = false;
  static constexpr bool kShifted = false;

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V TwoN(D, const I&, V, V, V mz, V im) {
    return (im + im) / mz;
  }

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Draw(D d, const I& i, V u1, V u2, V&, Drawn<D>& drawn) {
    V sin, cos;
    SinCosTurn(d, u2, sin, cos);
    const V r = Sqrt(u1);
    const V hx = r * cos, hy = r * sin, hz = Sqrt(Set(d, 1.0f) - u1);
    Unstretch(i, hx, hy, hz, drawn);
    drawn.im = Dot(i.wx, i.wy, i.wz, hx, hy, hz);
    drawn.two_n = TwoN(d, i, drawn.mx, drawn.my, drawn.mz, drawn.im);
  }
};

// Visible normals by the projected hemisphere: Heitz 2018. With e = w_xy / |w_xy|, s = (1 + c) / 2:
//   m_hat = t1 (-e_y, e_x, 0) + t2 (-c e_x, -c e_y, s_hat) + t_w w / nu,
//   t1 = r cos phi,  R^2 = 1 - t1^2,  t2 = R - s (R - r sin phi),  t_w^2 = R^2 - t2^2.
// t_w^2 is DiscChord's R^2 - t2^2.
struct Heitz : VisibleNormals, UnitNormals {
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Draw(D d, const I& i, V u1, V u2, V&, Drawn<D>& drawn) {
    const V zero = Zero(d), one = Set(d, 1.0f), half = Set(d, 0.5f);
    const Incidence<D> w(d, i);
    const DiscChord<D> disc(d, u1, u2);
    const V c = w.c, s_hat = w.s, b = disc.b, p = disc.p;
    const V s = half * i.two_sigma * w.inverse_nu;
    const V t2 = half * NegFma(c, b, p);  // R - s b
    const V rest_s = one - s;
    const V tw = Sqrt(s * b * Fma(rest_s, b, p));

    const V radial_xy = Fma(tw, s_hat, Neg(t2 * c));
    const V hx = Fma(radial_xy, w.ex, Neg(disc.t1 * w.ey)), hy = Fma(radial_xy, w.ey, disc.t1 * w.ex);
    // m_hat_z = t2 s_hat + t_w c; where the terms' signs differ it cancels, and is s p X / (|t2| s_hat + t_w |c|) with
    // X = 2R |c| + s p behind (c <= 0), X = s b - 2R (1 - s) in front.
    V hz = Fma(t2, s_hat, tw * c);
    const auto cancels = Or(Not(i.ahead), t2 < zero);
    if (!AllFalse(d, cancels)) {
      const V two_r = disc.big_r + disc.big_r, sum = Fma(Abs(t2), s_hat, tw * Abs(c));
      const V x = Select(i.ahead, NegFma(two_r, rest_s, s * b), Fma(two_r, Abs(c), s * p));
      hz = Select(cancels, s * p * x / sum, hz);
    }
    hz = Max(hz, Set(d, kSmallestZ));
    Unstretch(i, hx, hy, hz, drawn);
    // nu t_w, but by M itself, so that o is its reflection to the last digits.
    drawn.im = Max(Dot(i.wx, i.wy, i.wz, hx, hy, hz), Set(d, kSmallestIm));
    drawn.two_n = i.two_normaliser;
  }
};

// A point of the spherical cap o_hat_z in (1 - t / nu, 1], and m_hat = (i_hat + o_hat) nu. Everything is kept
// nu times as large, so that nothing has to be divided by nu. `above` is what the cap leaves out of the
// visible one: nu + i_z - t.
template <class D, class I, class V = Vec<D>>
HWY_INLINE void DrawFromCap(D d, const I& i, V t, V above, V u1, V u2, Drawn<D>& drawn) {
  V sin, cos;
  SinCosTurn(d, u2, sin, cos);
  const V height = t * u1;  // nu (1 - o_hat_z)
  const V radius = Sqrt(height * (i.nu + i.nu - height));
  const V hx = Fma(radius, cos, i.wx), hy = Fma(radius, sin, i.wy);
  V hz = Fma(t, Set(d, 1.0f) - u1, above);             // nu + i_z - height, without cancellation
  if (!i.all_front) hz = Max(hz, Set(d, kSmallestZ));  // t can be very small
  Unstretch(i, hx, hy, hz, drawn);
  // Equal to |m_hat|^2 / 2, but by M itself, so that o is its reflection even where m_hat is short.
  drawn.im = Dot(i.wx, i.wy, i.wz, hx, hy, hz);
  // Where A is not what w has (ggx-inl.h, kSmallestA).
  if (!i.all_front) {
    const V half_hh = Dot(hx, hy, hz, hx, hy, hz) * Set(d, 0.5f);
    drawn.im = Select(Or(i.ahead, i.a >= Set(d, kSmallestA)), drawn.im, half_hh);
  }
}

// Visible normals by a spherical cap: Dupuy & Benyoub 2023.
struct Cap : VisibleNormals, HalfVectors {
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Draw(D d, const I& i, V u1, V u2, V&, Drawn<D>& drawn) {
    DrawFromCap(d, i, i.two_sigma, Zero(d), u1, u2, drawn);
    drawn.two_n = i.two_normaliser;
  }
};

// Reflections by a smaller cap: Eto & Tokuyoshi 2023. For i_z > 0 the cap ends at -k c,
//   k = (1 - a^2) s^2 / (s^2 + a^2 i_z^2),  s = 1 + sgn(1 - a) sin(theta)                          (Eq. 5)
// with a = alpha where it is isotropic, else min(alpha_x, alpha_y, 1) (Eq. 6). With S = 1 + sin(theta) and
// 1 - sin(theta) = i_z^2 / S both signs have the same form: S^2 and i_z^2 change places. So do
// 1 - k = a^2 (S^2 + i_z^2) / (the same denominator).
struct Bounded : SamplerTraits, HalfVectors {
  static constexpr bool kNormals = false;

  template <class I, class V>
  static HWY_INLINE V Normaliser(const I& i, V t) {
    return i.all_front ? t : Select(i.front, t, i.two_normaliser);
  }

  // t: nu + k i_z. above: (1 - k) i_z.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Bound(D d, const I& i, V& t, V& above) {
    const V one = Set(d, 1.0f);
    const V z2 = i.z * i.z;
    const V sum = one + Sqrt(Fma(i.x, i.x, i.y * i.y));
    const V sum2 = sum * sum;
    V a = Min(i.ax, i.ay), p = sum2, q = z2;
    const auto rough = Max(i.ax, i.ay) > one;
    if (!AllFalse(d, rough)) {
      a = Select(i.ax == i.ay, a, Min(a, one));
      const auto swapped = a > one;
      p = Select(swapped, z2, sum2);
      q = Select(swapped, sum2, z2);
    }
    const V a2 = a * a;
    const V scale = i.z / Fma(a2, q, p);
    // 1 - a^2 as (1 - a)(1 + a): no cancellation near 1.
    t = Fma((one - a) * (one + a) * p, scale, i.nu);
    above = a2 * (sum2 + z2) * scale;
    if (!i.all_front) {
      t = Select(i.front, t, i.two_sigma);
      above = IfThenElseZero(i.front, above);
    }
  }

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V TwoN(D d, const I& i, V, V, V, V) {
    V t, above;
    Bound(d, i, t, above);
    return Normaliser(i, t);
  }

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Draw(D d, const I& i, V u1, V u2, V&, Drawn<D>& drawn) {
    V t, above;
    Bound(d, i, t, above);
    DrawFromCap(d, i, t, above, u1, u2, drawn);
    drawn.two_n = Normaliser(i, t);
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
