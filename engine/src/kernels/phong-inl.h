// Anisotropic Phong: D = m_z^n / (pi ax ay) with n = 2 cos^2 / ax^2 + 2 sin^2 / ay^2 - 2 of m's azimuth. Of a standard
// slope of length rho whose actual length is r, pi P22 = (1 + r^2)^-(1 + rho^2 / r^2).

#if defined(FACETWISE_PHONG_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_PHONG_INL_H_
#undef FACETWISE_PHONG_INL_H_
#else
#define FACETWISE_PHONG_INL_H_
#endif

#include "src/kernels/slopes-inl.h"
#include "src/math/log-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

struct Phong : SlopeDistribution<Phong>, DistributionTraits {
  static constexpr float kLargestRoughness = kLargestPhongAlpha;
  static constexpr bool kLongChains = true;

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V Profile(D d, const I& i, V x, V y, V) {
    const V sx = i.ax * x, sy = i.ay * y;
    const V r2 = Fma(sx, sx, sy * sy), rho2 = Fma(x, x, y * y);
    // log(1 + r^2) / r^2 is 1 - r^2 / 2 where r^2 is small, and rho may then still be large.
    const V tiny = Set(d, 1e-12f);
    const V ratio = Select(r2 < tiny, Set(d, 1.0f), Log1p(d, r2) / Max(r2, tiny));
    return Exp(d, Neg((r2 + rho2) * ratio));
  }

  // Given the azimuth e of the standard slope, (1 + r^2)^-(1 / a) is uniform, a = ax^2 e_x^2 + ay^2 e_y^2 = r^2 /
  // rho^2; e itself is uniform.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void DrawSlope(D d, const I& i, V u1, V u2, V& x, V& y) {
    V sin, cos;
    SinCosTurn(d, u2, sin, cos);
    const V sx = i.ax * cos, sy = i.ay * sin;
    const V a = Fma(sx, sx, sy * sy);
    const V rho = Sqrt(Expm1(d, NegLog1m(d, u1) * a) / a);
    x = rho * cos;
    y = rho * sin;
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
