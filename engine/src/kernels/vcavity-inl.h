// SPDX-License-Identifier: Apache-2.0
// V-cavity masking, single-sided: G(i, m) = min(2 m_z |i_z| / i.m, 1) (Tokuyoshi 2021, section 2). Visible normals have
// density D(m) min(2 m_z |i_z|, i.m) / (H |i_z|), so N = H max(i.m / (2 m_z), |i_z|), with the hit probability H, 1 in
// front. Incident's t and tn are 2 H.

#if defined(FACETWISE_VCAVITY_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_VCAVITY_INL_H_
#undef FACETWISE_VCAVITY_INL_H_
#else
#define FACETWISE_VCAVITY_INL_H_
#endif

#include "src/kernels/surface-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

struct VCavity {
  static constexpr bool kUnboundedW = true;

  template <class D, class I>
  static HWY_INLINE void Area(D d, I& i) {
    const auto two = Set(d, 2.0f);
    i.shift = Zero(d);
    i.two_sigma = two;
    if (!i.all_front) {
      auto hit = two;
      I::Distribution::TwoHit(d, i, hit, i.shift);
      i.two_sigma = Select(i.front, two, hit);
    }
    i.area_shift = i.shift;
  }
  // All counted as hit.
  template <class D, class I>
  static HWY_INLINE void BiasedArea(D d, I& i) {
    i.two_normaliser = Set(d, 2.0f);
    i.shift = Zero(d);
  }

  // f cos(theta_o) = D min(G(i, m), G(o, m)) / (4 H |i_z|), with |i_z| divided out, as D w / (2 two_n).
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Value(D d, const I& i, V mz, V im, V, V, V oz, bool, V& two_n, V& w) {
    const V iz = Max(Abs(i.z), Set(d, kTiny));
    const V r = (mz + mz) / im;
    w = Min(r * Min(iz, oz), Set(d, 1.0f)) / iz;
    two_n = i.two_normaliser;
  }

  template <class Drawer, class D, class I, class Drawn, class V = Vec<D>>
  static HWY_INLINE V Weight(D d, const I& i, const Drawn& drawn, V ox, V oy, V oz, bool uncorrelated) {
    if constexpr (Drawer::kNIsSigma) {
      // min(G(i, m), G(o, m)) / G(i, m)
      const V one = Set(d, 1.0f), iz = Max(Abs(i.z), Set(d, kTiny));
      const V r = (drawn.mz + drawn.mz) / drawn.im;
      V w = Min(r * Min(iz, oz), one) / Min(r * iz, one);
      if constexpr (Drawer::kOwnShift)
        if (!i.all_front) w = Min(w * OverVisible(d, i, drawn), Set(d, kLargestDensity));
      return w;
    } else {
      V two_n, w;
      Value(d, i, drawn.mz, drawn.im, ox, oy, oz, uncorrelated, two_n, w);
      w = w * drawn.two_n;
      if constexpr (I::Distribution::kShifts && !Drawer::kShifted)
        if (!i.all_front) w = w * Exp(d, i.shift);
      return w / two_n;
    }
  }

  // 2 N of visible normals.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V VisibleTwoN(D d, const I& i, V mz, V im) {
    const V iz = Max(Abs(i.z), Set(d, kTiny));
    const V n = Max(im / (mz + mz), iz);
    return i.two_normaliser * n;
  }

  // N over that of visible normals, of samplers with the latter in front.
  template <class D, class I, class Drawn, class V = Vec<D>>
  static HWY_INLINE V OverVisible(D d, const I& i, const Drawn& drawn) {
    return drawn.two_n / VisibleTwoN(d, i, drawn.mz, drawn.im) * Exp(d, i.shift - drawn.shift);
  }

  // The same microfacet seen from both sides is masked alike: G(o, m) / G(i, m) beyond G(i, m).
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V TransmissionMasking(D d, const I& i, V mz, V im, V om, V, V, V oz) {
    const V one = Set(d, 1.0f), iz = Max(Abs(i.z), Set(d, kTiny));
    const V two_mz = mz + mz;
    const V gi = Min(two_mz * iz / im, one), go = Min(two_mz * Abs(oz) / om, one);
    return Min(gi, go) / gi;
  }

  // The masking depends on m. The area is H |i_z|.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void MaskingAndArea(D d, const I& i, V& masking, V& area) {
    masking = Zero(d);
    area = i.two_sigma * (Abs(i.z) * Set(d, 0.5f));
    if constexpr (I::Distribution::kShifts)
      if (!i.all_front) area = area * Exp(d, Neg(i.shift));
  }
  template <class D, class I>
  static HWY_INLINE Vec<D> ShareUnoccluded(D d, const I&) {
    return Zero(d);
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
