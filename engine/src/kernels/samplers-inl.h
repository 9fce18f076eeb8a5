// The published samplers of GGX with Smith masking: ndf, heitz, cap, bounded. `exact` has its own file.
//
// A sampler draws M = L m_hat and says by what N the density is normalised: p(o) = D(m) / (4 N). For visible
// normals N = sigma(i). Its traits:
//   kUnit       m_hat is not a half vector w + nu o_hat, for which |m_hat|^2 = 2 i.M
//   kVisible    i.m > 0 always
//   kUsesU3     u3 is read
//   kNIsSigma   N = sigma(i)
//   kShifted    N is times exp(shift), as sigma is (surface-inl.h)
//   kOwnShift   N is times e^(shift) of the sample's own
//   kExact      for i_z > 0 no reflection is occluded; o_z is raised to kRim
//   kNormals    serves normals and transmission too, not reflections alone

#if defined(FACETWISE_SAMPLERS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_SAMPLERS_INL_H_
#undef FACETWISE_SAMPLERS_INL_H_
#else
#define FACETWISE_SAMPLERS_INL_H_
#endif

#include "facetwise/model.h"
#include "src/kernels/ggx-inl.h"
#include "src/kernels/smith-inl.h"
#include "src/math/sincos-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// i.M of visible normals is kept above this, where rounding could make it 0 or negative. `ndf` rejects below.
inline constexpr float kSmallestIm = 0x1p-84f;
// rho = 2 i.M / M.M is |m_hat|^2 / M.M for half vectors, at least 1 / (largest alpha)^2. It is kept above half of
// that where m_hat is so short that i.M is nothing but rounding.
template <class S>
inline constexpr float kSmallestRho = 0.5f / (kLargestAlpha * kLargestAlpha);
// |L| is at most the largest alpha and the longest mean slope and 1.
template <class Distribution, class Masking>
inline constexpr float kSmallestRho<Surface<Distribution, Masking, true>> = 0.5f / (160.0f * 160.0f);
// Likewise m_hat_z (times nu, for half vectors); its square does not underflow.
inline constexpr float kSmallestZ = 0x1p-62f;

template <class D>
struct Drawn {
  using V = Vec<D>;
  HWY_INLINE Drawn() {}
  V mx, my, mz;  // M
  V mm;          // M . M
  V im;          // i . M = w . m_hat
  V two_n;       // 2 N
  V sx, sy;      // standard slopes, of the samplers that draw them
  V shift;       // 2 N is times e^(shift), of samplers with kOwnShift
};

// Fills in M and M.M from m_hat.
template <class D, class I, class V = Vec<D>>
HWY_INLINE void Unstretch(const I& i, V hx, V hy, V hz, Drawn<D>& drawn) {
  Unstretch(i, hx, hy, hz, drawn.mx, drawn.my);
  drawn.mz = hz;
  drawn.mm = Dot(drawn.mx, drawn.my, drawn.mz, drawn.mx, drawn.my, drawn.mz);
}

// pi ax ay D(m), as numerator and denominator: (M.M)^2 / |m_hat|^4. rho = 2 i.M / M.M.
struct UnitNormals {
  static constexpr bool kUnit = true;
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Density(D d, const I&, const Drawn<D>& drawn, V, V& numerator, V& denominator) {
    numerator = drawn.mm * drawn.mm;
    denominator = Set(d, 1.0f);
  }
};
struct HalfVectors {
  static constexpr bool kUnit = false;
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Density(D d, const I&, const Drawn<D>&, V rho, V& numerator, V& denominator) {
    numerator = Set(d, 1.0f);
    denominator = rho * rho;
  }
};

// Normals with density D(m) m_z (Walter 2007, Eqs. 35, 36): p(o) = D(m) m_z / (4 |i.m|).
struct GgxNdf : UnitNormals {
  static constexpr bool kUsesU3 = false;
  static constexpr bool kVisible = false;
  static constexpr bool kNIsSigma = false;
  static constexpr bool kShifted = false;
  static constexpr bool kExact = false;
  static constexpr bool kNormals = true;

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

// What samplers of all visible normals share: N = sigma(i).
struct VisibleNormals {
  static constexpr bool kUsesU3 = false;
  static constexpr bool kVisible = true;
  static constexpr bool kNIsSigma = true;
  static constexpr bool kShifted = true;
  static constexpr bool kExact = false;
  static constexpr bool kNormals = true;

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V TwoN(D, const I& i, V, V, V, V) {
    return i.tn;
  }
};

// Visible normals by the projected hemisphere: Heitz 2018. With e = w_xy / |w_xy|, s = (1 + c) / 2:
//   m_hat = t1 (-e_y, e_x, 0) + t2 (-c e_x, -c e_y, s_hat) + t_w w / nu,
//   t1 = r cos phi,  R^2 = 1 - t1^2,  t2 = R - s (R - r sin phi),  t_w^2 = R^2 - t2^2.
// R - r sin phi and R + r sin phi have the product 1 - u1, so that neither needs to cancel; with
// b = R - r sin phi, p = R + r sin phi: t_w^2 = s b (p + (1 - s) b).
struct Heitz : VisibleNormals, UnitNormals {
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Draw(D d, const I& i, V u1, V u2, V&, Drawn<D>& drawn) {
    const V zero = Zero(d), one = Set(d, 1.0f), half = Set(d, 0.5f);
    V sin, cos;
    SinCosTurn(d, u2, sin, cos);

    // Straight up or down e is (1, 0).
    const V horizontal = Sqrt(Fma(i.wx, i.wx, i.wy * i.wy));
    const auto vertical = horizontal < Set(d, 1e-15f);
    const V scale = one / Select(vertical, one, horizontal);
    const V ex = Select(vertical, one, i.wx * scale), ey = Select(vertical, zero, i.wy * scale);
    const V inverse_nu = one / i.nu;
    const V c = i.wz * inverse_nu, s_hat = horizontal * inverse_nu;
    const V s = half * i.t * inverse_nu;

    const V r = Sqrt(u1);
    const V t1 = r * cos, radial = r * sin;
    const V rest = one - u1;
    const V big_r = Sqrt(Max((one - t1) * (one + t1), rest));
    const V larger = big_r + Abs(radial), smaller = rest / larger;
    const auto upper = radial > zero;
    const V b = Select(upper, smaller, larger), p = Select(upper, larger, smaller);
    const V t2 = half * NegFma(c, b, p);  // R - s b
    const V rest_s = one - s;
    const V tw = Sqrt(s * b * Fma(rest_s, b, p));

    const V radial_xy = Fma(tw, s_hat, Neg(t2 * c));
    const V hx = Fma(radial_xy, ex, Neg(t1 * ey)), hy = Fma(radial_xy, ey, t1 * ex);
    // m_hat_z = t2 s_hat + t_w c; where the terms' signs differ it cancels, and is s p X / (|t2| s_hat + t_w |c|) with
    // X = 2R |c| + s p behind (c <= 0), X = s b - 2R (1 - s) in front.
    V hz = Fma(t2, s_hat, tw * c);
    const auto cancels = Or(Not(i.ahead), t2 < zero);
    if (!AllFalse(d, cancels)) {
      const V two_r = big_r + big_r, sum = Fma(Abs(t2), s_hat, tw * Abs(c));
      const V x = Select(i.ahead, NegFma(two_r, rest_s, s * b), Fma(two_r, Abs(c), s * p));
      hz = Select(cancels, s * p * x / sum, hz);
    }
    hz = Max(hz, Set(d, kSmallestZ));
    Unstretch(i, hx, hy, hz, drawn);
    // nu t_w, but by M itself, so that o is its reflection to the last digits.
    drawn.im = Max(Dot(i.wx, i.wy, i.wz, hx, hy, hz), Set(d, kSmallestIm));
    drawn.two_n = i.tn;
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
  V hz = Fma(t, Set(d, 1.0f) - u1, above);  // nu + i_z - height, without cancellation
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
    DrawFromCap(d, i, i.t, Zero(d), u1, u2, drawn);
    drawn.two_n = i.tn;
  }
};

// Reflections by a smaller cap: Eto & Tokuyoshi 2023. For i_z > 0 the cap ends at -k c,
//   k = (1 - a^2) s^2 / (s^2 + a^2 i_z^2),  s = 1 + sgn(1 - a) sin(theta)                          (Eq. 5)
// with a = alpha where it is isotropic, else min(alpha_x, alpha_y, 1) (Eq. 6). With S = 1 + sin(theta) and
// 1 - sin(theta) = i_z^2 / S both signs have the same form: S^2 and i_z^2 change places. Likewise
// 1 - k = a^2 (S^2 + i_z^2) / (the same denominator).
struct Bounded : HalfVectors {
  static constexpr bool kUsesU3 = false;
  static constexpr bool kVisible = true;
  static constexpr bool kNIsSigma = false;
  static constexpr bool kShifted = true;
  static constexpr bool kExact = false;
  static constexpr bool kNormals = false;

  template <class I, class V>
  static HWY_INLINE V Normaliser(const I& i, V t) {
    return i.all_front ? t : Select(i.front, t, i.tn);
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
      t = Select(i.front, t, i.t);
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
