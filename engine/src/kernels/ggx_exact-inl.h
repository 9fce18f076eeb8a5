// SPDX-License-Identifier: Apache-2.0
// The exact reflection sampler of GGX with Smith masking: docs/math.md.

#if defined(FACETWISE_GGX_EXACT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_GGX_EXACT_INL_H_
#undef FACETWISE_GGX_EXACT_INL_H_
#else
#define FACETWISE_GGX_EXACT_INL_H_
#endif

#include "src/kernels/ggx_cone-inl.h"
#include "src/kernels/ggx_samplers-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// The smallest m_hat_z (kRim, sample-inl.h).
inline constexpr float kRimZ = kHorizon;

// Visible normals whose reflection is not occluded, in exact proportion.
struct GgxExact : SamplerTraits {
  static constexpr bool kLongChain = true;
  static constexpr bool kReadsArea = false;
  static constexpr bool kUnit = false;
  static constexpr bool kUsesU3 = true;
  static constexpr bool kExact = true;
  static constexpr bool kNormals = false;

  // m_hat is of unit length in front, else a half vector.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Density(D d, const I& i, const Drawn<D>& drawn, V rho, V& numerator, V& denominator) {
    const V one = Set(d, 1.0f);
    numerator = drawn.mm * drawn.mm;
    denominator = one;
    if (!i.all_front) {
      numerator = Select(i.front, numerator, one);
      denominator = Select(i.front, one, rho * rho);
    }
  }

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V TwoN(D d, const I& i, V, V, V, V) {
    Cone<D> cone;
    MakeConeOf(d, i, Roughness<D>(d, i), cone);
    return Select(i.front, cone.two_k, i.two_normaliser);
  }

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Draw(D d, const I& i, V u1, V u2, V& u3, Drawn<D>& drawn) {
    const Roughness<D> roughness(d, i);
    Cone<D> cone;
    MakeConeOf(d, i, roughness, cone);
    const V rim = Set(d, kRimZ);
    V sin, cos;
    SinCosTurn(d, u2, sin, cos);

    // A point (xi, eta) of the ellipse, uniformly; the point of the sphere above it, along the axis v.
    const V lambda_u = cone.lambda * u1;
    const V rp = Sqrt(lambda_u * cone.inverse_p);
    V rq = rp;
    if (I::Surface::kAffine || !roughness.all_isotropic) rq = Sqrt(lambda_u * cone.inverse_q);
    const V xi = rp * cos, eta = rq * sin;
    const V along = Fma(xi, cone.vx, eta * cone.vy);
    const V y = Neg(along * cone.inverse_n2);
    // zeta^2 v.v = 1 - xi^2 - eta^2 + along^2 / v.v. At the rim 1 - xi^2 - eta^2 cancels; by 1 = (lambda + px) / P it
    // is a sum of positive terms.
    const V left = NegFma(cone.lambda, u1, cone.lambda);  // lambda (1 - u1)
    const V cp = cos * cos * cone.inverse_p, sq = sin * sin * cone.inverse_q;
    const V inside = Fma(cp, left + cone.px, sq * (left + cone.py));
    const V zeta = Sqrt(Fma(y, y, inside * cone.inverse_n2));

    // The sample or its mirror image about the axis, in proportion to w.m_hat.
    const V across = Fma(xi, i.wx, eta * i.wy);
    const V g_zeta = cone.g * zeta;
    const V threshold = Fma(cone.g, y, across) + g_zeta;
    const auto mirrored = u3 * (g_zeta + g_zeta) >= threshold;
    const V sign = IfThenElseZero(mirrored, SignBit(d));
    const V hz = Max(zeta + Xor(y, sign), rim);
    const V hx = Fma(hz, cone.vx, Xor(xi, sign)), hy = Fma(hz, cone.vy, Xor(eta, sign));
    Unstretch(i, hx, hy, hz, drawn);
    drawn.im = Max(Dot(i.wx, i.wy, i.wz, hx, hy, hz), Set(d, kSmallestIm));
    drawn.two_n = cone.two_k;

    // Behind, nothing is occluded: the cap.
    if (!i.all_front) {
      Drawn<D> cap;
      Cap::Draw(d, i, u1, u2, u3, cap);
      drawn.KeepWhere(i.front, cap);
    }
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
