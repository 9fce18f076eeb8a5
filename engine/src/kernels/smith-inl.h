// SPDX-License-Identifier: Apache-2.0
// Smith masking: visible normals have density D(m) (i.m) / sigma(i), and reflections D(m) / (4 sigma(i)).

#if defined(FACETWISE_SMITH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_SMITH_INL_H_
#undef FACETWISE_SMITH_INL_H_
#else
#define FACETWISE_SMITH_INL_H_
#endif

#include "src/kernels/surface-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

struct Smith {
  static constexpr bool kUnboundedW = false;  // of Value()

  template <class D, class I>
  static HWY_INLINE void Area(D d, I& i) {
    I::Distribution::Area(d, i);
  }
  template <class D, class I>
  static HWY_INLINE void BiasedArea(D d, I& i) {
    I::Distribution::BiasedArea(d, i);
  }

  // w = f cos(theta_o) / pdf_visible(o), as numerator and denominator, for o_z > 0. With z' of o,
  // Lambda(o) = sigma(-o) / z'(o), so that
  //   correlated    sigma(i) / (sigma(i) + |z'(i)| Lambda(o))
  //                 = 2 sigma(i) z'(o) / (2 sigma(i) z'(o) + |z'(i)| 2 sigma(-o))
  //   uncorrelated  G1(o) = 2 z'(o) / (2 sigma(o))
  // Nothing cancels, in front or behind. z'(o) is taken as 2^-60 at least, where no product underflows; where it is not
  // positive w is 0.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Shadowing(D d, const I& i, V ox, V oy, V oz, bool uncorrelated, V& numerator, V& denominator) {
    using Distribution = typename I::Distribution;
    const V wx = i.ax * ox, wy = i.ay * oy;
    const V a = Fma(wx, wx, wy * wy);
    if constexpr (I::Surface::kAffine) oz = NegFma(i.mean_x, ox, NegFma(i.mean_y, oy, oz));
    const V z = Max(oz, Set(d, kTiny));
    V front, back, scale;
    Distribution::Areas(d, i, wx, wy, z, a, front, back, scale);
    if (uncorrelated) {
      numerator = z + z;
      denominator = front;
    } else {
      numerator = i.two_normaliser * (z * scale);
      denominator = Fma(Abs(i.wz), back, numerator);
    }
    if constexpr (I::Surface::kAffine) numerator = IfThenElseZero(oz > Zero(d), numerator);
  }

  // f cos(theta_o) = pi ax ay D(m) / (2 pi ax ay two_n) w.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Value(D d, const I& i, V, V, V ox, V oy, V oz, bool uncorrelated, V& two_n, V& w) {
    V lit, all;
    Shadowing(d, i, ox, oy, oz, uncorrelated, lit, all);
    two_n = i.two_normaliser;
    w = lit / all;
  }

  // The weight of a sample: f cos(theta_o) is w D / (4 sigma), so it is w N / sigma.
  template <class Drawer, class D, class I, class Drawn, class V = Vec<D>>
  static HWY_INLINE V Weight(D d, const I& i, const Drawn& drawn, V ox, V oy, V oz, bool uncorrelated) {
    V lit, all;
    Shadowing(d, i, ox, oy, oz, uncorrelated, lit, all);
    if constexpr (Drawer::kOwnShift) {
      lit = lit * (drawn.two_n / i.two_normaliser) * Exp(d, Neg(drawn.shift));
    } else if constexpr (!Drawer::kNIsSigma) {
      lit = lit * drawn.two_n;
      all = all * i.two_normaliser;
      if constexpr (I::Distribution::kShifts && !Drawer::kShifted)
        if (!i.all_front) lit = lit * Exp(d, i.shift);
    }
    return lit / all;
  }

  // 2 N of visible normals.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V VisibleTwoN(D, const I& i, V, V) {
    return i.two_normaliser;
  }

  // What a direction o below the surface sees of the microfacets that transmit to it: G1 of -o.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V TransmissionMasking(D d, const I& i, V, V, V, V ox, V oy, V oz) {
    V numerator, denominator;
    Shadowing(d, i, Neg(ox), Neg(oy), Neg(oz), true, numerator, denominator);
    return Min(numerator / denominator, Set(d, 1.0f));
  }

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void MaskingAndArea(D d, const I& i, V& masking, V& area) {
    masking = IfThenElseZero(i.ahead, Min((i.wz + i.wz) / i.two_sigma, Set(d, 1.0f)));
    area = i.two_sigma * Set(d, 0.5f);
    if constexpr (I::Distribution::kShifts)
      if (!i.all_front) area = area * Exp(d, Neg(i.shift));
  }

  // Share of the visible normals whose reflection is not occluded.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V ShareUnoccluded(D d, const I& i) {
    if constexpr (I::Distribution::kHasShareUnoccluded) return I::Distribution::ShareUnoccluded(d, i);
    return Zero(d);
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
