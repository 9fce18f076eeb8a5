// SPDX-License-Identifier: Apache-2.0
// Samplers by slopes, for distributions that are no stretched sphere: m_hat = (-x, -y, 1) for a standard slope (x, y).

#if defined(FACETWISE_SLOPES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_SLOPES_INL_H_
#undef FACETWISE_SLOPES_INL_H_
#else
#define FACETWISE_SLOPES_INL_H_
#endif

#include "src/kernels/sampler-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// What a distribution has that is given by Profile(d, i, x, y, shift) = pi P22(x, y) exp(shift) of standard slopes.
template <class Policy>
struct SlopeDistribution {
  // pi ax ay D(m) exp(shift) for m of any length up to 2: Profile |m|^4 / m_z^4. At the horizon m_z is taken as 2^-30.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V Density(D d, const I& i, V mx, V my, V mz, V m2, V shift) {
    Centre(i, mx, my, mz);
    const V inverse = Set(d, 1.0f) / Max(mz, Set(d, kHorizon));
    const V q = m2 * (inverse * inverse);
    return Policy::Profile(d, i, Neg(mx * inverse) / i.ax, Neg(my * inverse) / i.ay, shift) * q * q;
  }
};

// Slopes of length r in the direction of a whole turn's fraction u.
template <class D, class V = Vec<D>>
HWY_INLINE void PolarSlope(D d, V r, V u, V& x, V& y) {
  V sin, cos;
  SinCosTurn(d, u, sin, cos);
  x = r * cos;
  y = r * sin;
}

// M and M.M from a slope.
template <class D, class I, class V = Vec<D>>
HWY_INLINE void FromSlope(D d, const I& i, V x, V y, Drawn<D>& drawn) {
  drawn.sx = x;
  drawn.sy = y;
  Unstretch(i, Neg(x), Neg(y), Set(d, 1.0f), drawn);
}

struct SlopeNormals {
  static constexpr bool kUnit = true;
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Density(D d, const I& i, const Drawn<D>& drawn, V, V& numerator, V& denominator) {
    numerator = I::Distribution::Profile(d, i, drawn.sx, drawn.sy, i.shift) * drawn.mm * drawn.mm;
    denominator = Set(d, 1.0f);
  }
};

// Normals with density D(m) m_z, by DrawSlope(d, i, u1, u2, x, y).
struct SlopeNdf : SamplerTraits, SlopeNormals {
  static constexpr bool kReadsArea = false;
  static constexpr bool kVisible = false;
  static constexpr bool kShifted = false;

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Density(D d, const I& i, const Drawn<D>& drawn, V, V& numerator, V& denominator) {
    numerator = I::Distribution::Profile(d, i, drawn.sx, drawn.sy, Zero(d)) * drawn.mm * drawn.mm;
    denominator = Set(d, 1.0f);
  }
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V TwoN(D, const I&, V, V, V mz, V im) {
    return (im + im) / mz;
  }
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Draw(D d, const I& i, V u1, V u2, V&, Drawn<D>& drawn) {
    V x, y;
    I::Distribution::DrawSlope(d, i, u1, u2, x, y);
    FromSlope(d, i, x, y, drawn);
    drawn.im = NegFma(i.wx, x, NegFma(i.wy, y, i.wz));
    drawn.two_n = drawn.im + drawn.im;
  }
};

// Visible normals by the distribution's DrawVisible(d, i, horizontal, u1, u2, x, y, im), with x along the azimuth and
// im = w_z - horizontal x, horizontal the length of (w_x, w_y).
struct SlopeVisible : SlopeNormals, VisibleNormals {
  static constexpr bool kLongChain = true;
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Draw(D d, const I& i, V u1, V u2, V&, Drawn<D>& drawn) {
    const V horizontal = Sqrt(i.a);
    V along, across, im, x, y;
    I::Distribution::DrawVisible(d, i, horizontal, u1, u2, along, across, im);
    Azimuth<D>(d, i.wx, i.wy, horizontal).Turn(along, across, x, y);
    FromSlope(d, i, x, y, drawn);
    drawn.im = Max(im, Set(d, kSmallestIm));
    drawn.two_n = i.two_normaliser;
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
