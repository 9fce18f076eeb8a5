// SPDX-License-Identifier: Apache-2.0
// Samplers for V-cavity masking, of distributions that draw slopes.

#if defined(FACETWISE_VCAVITY_SAMPLERS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_VCAVITY_SAMPLERS_INL_H_
#undef FACETWISE_VCAVITY_SAMPLERS_INL_H_
#else
#define FACETWISE_VCAVITY_SAMPLERS_INL_H_
#endif

#include "src/kernels/slopes-inl.h"
#include "src/kernels/vcavity-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// Visible normals: one of a normal and its mirror image, by how much they face i (Heitz & d'Eon 2014, section 3);
// behind, the distribution's DrawBehindCavity (Tokuyoshi 2021, section 2.3).
struct CavityVisible : SlopeNormals, VisibleNormals {
  static constexpr bool kUsesU3 = true;

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V TwoN(D d, const I& i, V, V, V mz, V im) {
    return VCavity::VisibleTwoN(d, i, mz, im);
  }

  // u3 becomes what the choice leaves of it.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Draw(D d, const I& i, V u1, V u2, V& u3, Drawn<D>& drawn) {
    const V zero = Zero(d), below_one = Set(d, kLargestBelowOne);
    V x, y;
    I::Distribution::DrawSlope(d, i, u1, u2, x, y);
    const V across = Fma(i.wx, x, i.wy * y);
    const V a1 = Max(i.wz - across, zero), a2 = Max(i.wz + across, zero);
    const V at = u3 * (a1 + a2);
    const auto mirrored = And(at >= a1, a2 > zero);
    const V sign = IfThenElseZero(mirrored, SignBit(d));
    V im = Select(mirrored, a2, a1);
    const V left = Min(Max(Select(mirrored, at - a1, at) / Max(im, Set(d, kSmallestIm)), zero), below_one);
    x = Xor(x, sign);
    y = Xor(y, sign);
    if (!i.all_front) {
      V bx, by, bim, bu3 = u3;
      I::Distribution::DrawBehindCavity(d, i, u1, u2, bu3, bx, by, bim);
      x = Select(i.front, x, bx);
      y = Select(i.front, y, by);
      im = Select(i.front, im, bim);
      u3 = Select(i.front, left, bu3);
    } else {
      u3 = left;
    }
    FromSlope(d, i, x, y, drawn);
    drawn.im = Max(im, Set(d, kSmallestIm));
    drawn.two_n = TwoN(d, i, drawn.mx, drawn.my, drawn.mz, drawn.im);
  }
};

// Reflections that are not occluded, for radial distributions with V-cavity in front: docs/math.md. Along the azimuth
// e the slopes r e with reflections above the surface end at R on the side that faces i, and at 1 / (a R) on the other.
template <class D>
struct CavityLimits {
  using V = Vec<D>;
  V q, near, within, beyond;  // q.e, the nearer limit, the share within R and the one beyond
  // e: of standard slopes.
  template <class I>
  HWY_INLINE CavityLimits(D d, const I& i, V ex, V ey, V& far2) {
    const V iz = Select(i.front, Max(i.z, Set(d, kTiny)), Set(d, 1.0f));
    const V x = i.ax * ex, y = i.ay * ey;
    const V a = Fma(x, x, y * y);
    q = Fma(i.wx, ex, i.wy * ey) / iz;
    const V sum = Abs(q) + Sqrt(Fma(q, q, a));
    near = Set(d, 1.0f) / sum;
    const V far = Min(sum / a, Set(d, 1e15f));
    far2 = far * far;
    within = I::Distribution::Within(d, far2, beyond);
  }
};

struct CavityExact : SamplerTraits, SlopeNormals {
  static constexpr bool kUsesU3 = true;
  static constexpr bool kExact = true;
  static constexpr bool kNormals = false;

  // U_R i.m / (m_z w), w = 2 beyond the nearer limit, else min(i.m / (m_z i_z), 2).
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V TwoNOf(D, const I& i, const CavityLimits<D>& limits, V r, V mz, V im) {
    const V n = im / (mz + mz);
    const V both = Max(n, i.z);
    return (limits.within + limits.within) * Select(r < limits.near, both, n);
  }
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V TwoN(D d, const I& i, V mx, V my, V mz, V im) {
    const V one = Set(d, 1.0f), zero = Zero(d);
    const V x = mx * i.ay, y = my * i.ax;  // slopes times -m_z ax ay
    const V length = Sqrt(Fma(x, x, y * y));
    const auto vertical = length < Set(d, 1e-18f);
    const V scale = one / Select(vertical, one, length);
    V far2;
    const CavityLimits<D> limits(d, i, Select(vertical, one, x * scale), Select(vertical, zero, y * scale), far2);
    const V r = length / (mz * (i.ax * i.ay));
    return Select(i.front, TwoNOf(d, i, limits, r, mz, im), CavityVisible::TwoN(d, i, mx, my, mz, im));
  }

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Draw(D d, const I& i, V u1, V u2, V& u3, Drawn<D>& drawn) {
    const V one = Set(d, 1.0f);
    V ex, ey, far2;
    SinCosTurn(d, u1, ey, ex);
    const CavityLimits<D> limits(d, i, ex, ey, far2);
    // 1 - u2 within = (1 - u2) + u2 beyond
    const V r = Sqrt(I::Distribution::SquaredRadius(d, u2 * limits.within, Fma(u2, limits.beyond, one - u2)));
    // i faces slopes with q r < 0.
    const V steep = Abs(limits.q) * r;
    const auto flipped = And(r < limits.near, u3 + u3 < one - steep);
    const V towards = Xor(SignBit(d), And(limits.q, SignBit(d)));
    const V sign = Xor(towards, IfThenElseZero(flipped, SignBit(d)));
    const V x = Xor(r * ex, sign), y = Xor(r * ey, sign);
    FromSlope(d, i, x, y, drawn);
    drawn.im = Max(i.z * Select(flipped, one - steep, one + steep), Set(d, kSmallestIm));
    drawn.two_n = TwoNOf(d, i, limits, r, one, drawn.im);
    if (!i.all_front) {
      Drawn<D> behind;
      V rest = u3;
      CavityVisible::Draw(d, i, u1, u2, rest, behind);
      drawn.KeepWhere(i.front, behind);
    }
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
