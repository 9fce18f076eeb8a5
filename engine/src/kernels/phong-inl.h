// SPDX-License-Identifier: Apache-2.0
// Anisotropic Phong: D = m_z^n / (pi ax ay) with n = 2 cos^2 / ax^2 + 2 sin^2 / ay^2 - 2 of m's azimuth. Of a standard
// slope of length rho whose actual length is r, pi P22 = (1 + r^2)^-(1 + rho^2 / r^2). The share of the slopes of an
// azimuth e beyond rho is (1 + a rho^2)^(-1 / a), a = ax^2 e_x^2 + ay^2 e_y^2 = r^2 / rho^2.

#if defined(FACETWISE_PHONG_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_PHONG_INL_H_
#undef FACETWISE_PHONG_INL_H_
#else
#define FACETWISE_PHONG_INL_H_
#endif

#include "src/kernels/vcavity_samplers-inl.h"
#include "src/math/log-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

struct Phong : SlopeDistribution<Phong>, DistributionTraits {
  static constexpr float kLargestRoughness = kLargestPhongAlpha;
  static constexpr bool kLongChains = true;
  static constexpr bool kShifts = true;

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V Profile(D d, const I& i, V x, V y, V shift) {
    const V sx = i.ax * x, sy = i.ay * y;
    const V r2 = Fma(sx, sx, sy * sy), rho2 = Fma(x, x, y * y);
    // log(1 + r^2) / r^2 is 1 - r^2 / 2 where r^2 is small, and rho may then still be large.
    const V tiny = Set(d, 1e-12f);
    const V ratio = Select(r2 < tiny, Set(d, 1.0f), Log1p(d, r2) / Max(r2, tiny));
    return Exp(d, NegFma(r2 + rho2, ratio, shift));
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

  // V-cavity behind. With k = |i_z| / sqrt(A) and psi between w's azimuth and that of a slope that faces i,
  //   2 pi H = integral over psi of the integral of (1 + a t^2 / cos^2 psi)^(-1 / a) / k over t in [k, 3 k].
  // Outside by the trapezoidal rule in v, tan(psi) = sinh(v) / sqrt(1 + 2 k^2); inside by Gauss's, at points that
  // gather near k the more the quicker the share falls there. Error 6e-5 where H > 1e-3, and 1e-3 for isotropic
  // roughness; elsewhere the peak may lie at another azimuth, and between the nodes. Below kNearest H is linear in k.
  template <class D, class I, class V = Vec<D>>
  static HWY_NOINLINE void TwoHit(D d, const I& i, V& two_hit, V& shift) {
    const V one = Set(d, 1.0f), two = Set(d, 2.0f);
    const Behind<D> at(d, i);
    const V near = Set(d, kNearest), k = Max(at.k, near), k2 = k * k;
    const V narrow = Min(Fma(two, k2, one), Set(d, 0x1p14f)), scale = one / Sqrt(narrow);
    const auto squares = [&](int j, V& a, V& cos2) HWY_ATTR {
      const V tan = Set(d, kSinh[j < 0 ? -j : j] * (j < 0 ? -1 : 1)) * scale;
      cos2 = one / Fma(tan, tan, one);
      a = at.Stretch(d, i, tan) * cos2;
    };
    V least = Set(d, kLargestDensity);
    for (int j = -kNodes; j <= kNodes; ++j) {
      V a, cos2;
      squares(j, a, cos2);
      least = Min(least, LogShare(d, k2 / cos2, a));
    }
    V sum = Zero(d);
    for (int j = -kNodes; j <= kNodes; ++j) {
      V a, cos2;
      squares(j, a, cos2);
      const V rho2 = k2 / cos2;
      const V gather = Set(d, 4.0f / 3.0f) * rho2 / Fma(a, rho2, one);
      V inner = Zero(d);
      for (int g = 0; g < 6; ++g) {
        const V q = one / Fma(gather, Set(d, 1 - kGauss[g]), one), t = Fma(Set(d, 2 * kGauss[g]), q, one);
        inner = Fma(Set(d, 2 * kGaussWeight[g]) * q * q, Exp(d, least - LogShare(d, rho2 * (t * t), a)), inner);
      }
      sum = Fma(Set(d, Cosh(j)) * cos2 * (gather + one), inner, sum);
    }
    sum = sum * scale * Set(d, kStep / kPi);
    const V part = Min(at.k / near, one);
    two_hit = Fma(part, sum, two * (one - part) * Exp(d, least));
    shift = IfThenElseZero(Not(i.front), least);
  }
  // An azimuth psi near w's, then a slope there that faces i, so that the density is near that of visible normals; weights
  // make up for the rest. With tan(theta) = b tan(psi), theta is drawn with a density ~ min(cos(theta) / g, 1): at the
  // horizon it vanishes, as theirs does. Of the slopes at the azimuth that face i let s be the share that is nearer than
  // this one: it is drawn with a density min(s / c, 1) / (1 - c / 2), which near s = 0 rises as that of visible normals
  // does, and is flat where theirs is, above -3 k.
  template <class D, class I, class V = Vec<D>>
  static HWY_NOINLINE void DrawBehindCavity(D d, const I& i, V u1, V u2, V&, V& x, V& y, V& im) {
    const V one = Set(d, 1.0f), half_turn = Set(d, 0.5f);
    const Behind<D> at(d, i);
    // From either end, u2 = 0 and 1.
    const auto left = u2 < half_turn;
    const V mass = (u2 + u2) * at.mass, other = (one - u2) * (at.mass + at.mass);
    const V m = Max(Select(left, mass, other), Set(d, 1e-9f));
    V sin, cos;
    SinCosTurn(d, Min(Fma(m - at.ramp, Set(d, 0.5f / kPi), at.from), Set(d, 0.25f)), cos, sin);
    const V low = at.g * m;
    const auto ramp = m < at.ramp;
    sin = Select(ramp, one - low, sin);
    cos = Select(ramp, Sqrt(low * (Set(d, 2.0f) - low)), cos);
    const V wide = at.b * cos, inverse = one / Sqrt(Fma(wide, wide, sin * sin));
    const V along = Max(wide * inverse, Set(d, 0x1p-30f));
    const V across = Xor(sin * inverse, IfThenElseZero(left, SignBit(d)));
    const V tan = across / along;
    const V a = at.Stretch(d, i, tan) * (along * along);
    const V nearest = at.k / along, nearest2 = nearest * nearest;
    const V bend = Fma(a, nearest2, one), c = Rise(d, nearest2, bend);
    const V half = half_turn * c, at_u = u1 * (one - half);
    const V s = Min(Select(at_u < half, Sqrt((c + c) * at_u), at_u + half), Set(d, kLargestBelowOne));
    const V beyond = bend * Expm1(d, NegLog1m(d, s) * a) / a;  // rho^2 - nearest^2
    const V rho = Sqrt(nearest2 + beyond);
    at.Turn(Neg(rho * along), Neg(rho * across), x, y);
    im = at.root * along * beyond / Max(rho + nearest, Set(d, kTiny));
  }
  // 2 N of such a normal, times e^(shift).
  template <class D, class I, class V = Vec<D>>
  static HWY_NOINLINE V BehindTwoN(D d, const I& i, V mx, V my, V mz, V im, V& shift) {
    const V one = Set(d, 1.0f);
    const Behind<D> at(d, i);
    const V inverse = one / Max(mz, Set(d, kHorizon));
    const V x = mx * inverse / i.ax, y = my * inverse / i.ay;
    const V rho = Max(Sqrt(Fma(x, x, y * y)), Set(d, kTiny));
    const V cos = Min((at.k + im * inverse / at.root) / rho, one);
    const V ex = x / rho, ey = y / rho, sin = Fms(ex, at.ey, ey * at.ex);
    const V cos2 = Max(cos * cos, Set(d, 0x1p-60f)), sin2 = sin * sin;
    const V sx = i.ax * ex, sy = i.ay * ey, a = Fma(sx, sx, sy * sy);
    const V nearest2 = at.k * at.k / cos2, bend = Fma(a, nearest2, one), c = Rise(d, nearest2, bend);
    // The log of the share of slopes beyond `nearest` that are longer than this one, without its sign.
    const V gap = im * inverse / (at.root * cos), nearest = at.k / Max(cos, Set(d, kHorizon));
    const V l = Min(Log1p(d, Min(a * gap * (gap + nearest + nearest) / bend, Set(d, 1e30f))) / a, Set(d, 80.0f));
    const V s = Max(Expm1(d, l) * Exp(d, Neg(l)), Set(d, 1e-36f));
    const V radial = Min(s / c, one) / NegFma(Set(d, 0.5f), c, one);
    // Biased, two_normaliser has no shift, and two_sigma has that of H.
    shift = LogShare(d, nearest2, a) - (i.area_shift - i.shift);
    const V wide2 = Fma(at.b * at.b, sin2, cos2);
    const V ramp = Min(Sqrt(cos2 / wide2) / at.g, one);
    const V azimuth = wide2 * at.mass * Set(d, 2.0f / kPi) / (at.b * ramp);
    return Min(im * inverse / radial * azimuth * (i.two_normaliser / i.two_sigma), Set(d, kLargestDensity));
  }

 private:
  // The log of the share of slopes beyond a rho, without its sign.
  template <class D, class V = Vec<D>>
  static HWY_INLINE V LogShare(D d, V rho2, V a) {
    return Log1p(d, Min(a * rho2, Set(d, 1e30f))) / a;
  }
  // c: what share of the slopes beyond `nearest` is nearer than -3 k, to first order.
  template <class D, class V = Vec<D>>
  static HWY_INLINE V Rise(D d, V nearest2, V bend) {
    return Max(Min(Set(d, 4.0f) * nearest2 / bend, Set(d, 1.0f)), Set(d, kTiny));
  }
  template <class D>
  struct Behind : Azimuth<D> {
    using V = Vec<D>;
    V root, k, b;
    // Between theta = pi/2 and 0 the density's mass, that of the ramp, and where that ends, as a fraction of a turn.
    V g, mass, ramp, from;
    template <class I>
    HWY_INLINE Behind(D d, const I& i) : Behind(d, i, Sqrt(Max(i.a, Set(d, kSmallestA)))) {}
    // a of the azimuth at tan, over cos^2.
    template <class I>
    HWY_INLINE V Stretch(D, const I& i, V tan) const {
      const V x = i.ax * NegFma(tan, this->ey, this->ex), y = i.ay * Fma(tan, this->ex, this->ey);
      return Fma(x, x, y * y);
    }

   private:
    template <class I>
    HWY_INLINE Behind(D d, const I& i, V length)
        : Azimuth<D>(d, i.wx, i.wy, length, i.a < Set(d, kSmallestA)), root(length), k(Abs(i.z) / length) {
      const V one = Set(d, 1.0f);
      b = Sqrt(Fma(Set(d, 2.0f) * k, k, one));
      from = Min((k + k) / b, one) * Set(d, 0.25f);
      V cos;
      SinCosTurn(d, from, g, cos);
      g = Max(g, Set(d, kTiny));
      ramp = g / (one + cos);
      mass = Fma(Set(d, 0.25f) - from, Set(d, 2.0f * kPi), ramp);
    }
  };

  static constexpr float kNearest = 0x1p-5f, kStep = 0.5f;
  static constexpr int kNodes = 16;
  // sinh(j / 2)
  static constexpr float kSinh[] = {0.0f,        0.521095305f, 1.17520119f, 2.12927946f, 3.62686041f, 6.05020448f,
                                    10.0178749f, 16.5426273f,  27.2899172f, 45.0030112f, 74.2032106f, 122.343923f,
                                    201.713157f, 332.570065f,  548.316123f, 904.020931f, 1490.47883f};
  static constexpr float Cosh(int j) { return kCosh[j < 0 ? -j : j]; }
  static constexpr float kCosh[] = {1.0f,        1.12762597f, 1.54308063f, 2.35240962f, 3.76219569f, 6.13228948f,
                                    10.067662f,  16.5728247f, 27.3082328f, 45.0141201f, 74.2099485f, 122.34801f,
                                    201.715636f, 332.571568f, 548.317035f, 904.021484f, 1490.47916f};
  // Gauss-Legendre on [0, 1].
  static constexpr float kGauss[] = {0.0337652429f, 0.169395307f, 0.380690407f,
                                     0.619309593f,  0.830604693f, 0.966234757f};
  static constexpr float kGaussWeight[] = {0.0856622462f, 0.180380787f, 0.233956967f,
                                           0.233956967f,  0.180380787f, 0.0856622462f};
};

struct PhongCavity : CavityVisible {
  static constexpr bool kOwnShift = true;

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Density(D d, const I& i, const Drawn<D>& drawn, V, V& numerator, V& denominator) {
    numerator = Phong::Profile(d, i, drawn.sx, drawn.sy, drawn.shift) * drawn.mm * drawn.mm;
    denominator = Set(d, 1.0f);
  }
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V TwoN(D d, const I& i, V mx, V my, V mz, V im, V& shift) {
    V two_n = VCavity::VisibleTwoN(d, i, mz, im);
    shift = Zero(d);
    if (!i.all_front) {
      two_n = Select(i.front, two_n, Phong::BehindTwoN(d, i, mx, my, mz, im, shift));
      shift = IfThenElseZero(Not(i.front), shift);
    }
    return two_n;
  }
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Draw(D d, const I& i, V u1, V u2, V& u3, Drawn<D>& drawn) {
    CavityVisible::Draw(d, i, u1, u2, u3, drawn);
    drawn.two_n = TwoN(d, i, drawn.mx, drawn.my, drawn.mz, drawn.im, drawn.shift);
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
