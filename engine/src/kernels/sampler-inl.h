// SPDX-License-Identifier: Apache-2.0
// What all samplers share.
//
// A sampler draws M = L m_hat and says by what N the density is normalised: p(o) = D(m) / (4 N). For visible
// normals N = sigma(i). It has Draw(d, i, u1, u2, u3, drawn); TwoN(d, i, mx, my, mz, im), the 2 N of a normal that is
// asked for; Density(d, i, drawn, rho, numerator, denominator), pi ax ay D(m) of what it drew; kUnit, which says that
// m_hat is not a half vector w + nu o_hat, for which |m_hat|^2 = 2 i.M; and traits.

#if defined(FACETWISE_SAMPLER_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_SAMPLER_INL_H_
#undef FACETWISE_SAMPLER_INL_H_
#else
#define FACETWISE_SAMPLER_INL_H_
#endif

#include "facetwise/model.h"
#include "src/kernels/surface-inl.h"
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

// A sample. What a sampler does not set of the slopes and the shift is 0.
template <class D>
struct Drawn {
  using V = Vec<D>;
  HWY_INLINE Drawn() : sx(Zero(D())), sy(sx), shift(sx) {}
  V mx, my, mz;  // M
  V mm;          // M . M
  V im;          // i . M = w . m_hat
  V two_n;       // 2 N
  V sx, sy;      // standard slopes, of the samplers that draw them
  V shift;       // 2 N is times e^(shift), of samplers with kOwnShift

  // Elsewhere it becomes `other`.
  HWY_INLINE void KeepWhere(Mask<D> keep, const Drawn& other) {
    mx = Select(keep, mx, other.mx);
    my = Select(keep, my, other.my);
    mz = Select(keep, mz, other.mz);
    mm = Select(keep, mm, other.mm);
    im = Select(keep, im, other.im);
    two_n = Select(keep, two_n, other.two_n);
    sx = Select(keep, sx, other.sx);
    sy = Select(keep, sy, other.sy);
    shift = Select(keep, shift, other.shift);
  }
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

// What a sampler is unless it says otherwise.
struct SamplerTraits {
  static constexpr bool kVisible = true;           // i.m > 0 always
  static constexpr bool kUsesU3 = false;           // u3 is read
  static constexpr bool kNIsSigma = false;         // N = sigma(i)
  static constexpr bool kShifted = true;           // N is times exp(shift), as sigma is (surface-inl.h)
  static constexpr bool kOwnShift = false;         // N is times e^(shift) of the sample's own
  static constexpr bool kExact = false;            // for i_z > 0 no reflection is occluded; o_z is raised to kRim
  static constexpr bool kLongChain = false;        // gains from four vectors at a time
  static constexpr bool kReadsArea = true;         // sigma(i) is read in front, also where no weight is wanted
  static constexpr bool kUnboundedWeight = false;  // what a file says decides how large it is
  static constexpr bool kNormals = true;           // serves normals and transmission too, not only reflections
};

// What samplers of all visible normals share: N = sigma(i).
struct VisibleNormals : SamplerTraits {
  static constexpr bool kNIsSigma = true;

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V TwoN(D, const I& i, V, V, V, V) {
    return i.two_normaliser;
  }
};

// Of a normal that is asked for, its density D and the sampler's 2 N, both with the same shift. `density` is D with i's.
template <class Drawer, class D, class I, class V = Vec<D>>
HWY_INLINE void SampledDensity(D d, const I& i, V mx, V my, V mz, V m2, V im, Mask<D> reached, V& density, V& two_n) {
  using Distribution = typename I::Distribution;
  if constexpr (Drawer::kOwnShift) {
    V shift;
    two_n = Drawer::TwoN(d, i, mx, my, mz, im, shift);
    density = IfThenElseZero(reached, Distribution::Density(d, i, mx, my, mz, m2, shift));
  } else {
    two_n = Drawer::TwoN(d, i, mx, my, mz, im);
    if constexpr (Distribution::kShifts && !Drawer::kShifted)
      if (!i.all_front) density = IfThenElseZero(reached, Distribution::Density(d, i, mx, my, mz, m2, Zero(d)));
  }
}

// Where a direction (x, y, .) points in the plane: (1, 0) if it is vertical.
template <class D>
struct Azimuth {
  using V = Vec<D>;
  V ex, ey;
  // horizontal: length of (x, y).
  HWY_INLINE Azimuth(D d, V x, V y, V horizontal, Mask<D> vertical) {
    const V one = Set(d, 1.0f);
    const V scale = one / Select(vertical, one, horizontal);
    ex = Select(vertical, one, x * scale);
    ey = Select(vertical, Zero(d), y * scale);
  }
  HWY_INLINE Azimuth(D d, V x, V y, V horizontal) : Azimuth(d, x, y, horizontal, horizontal < Set(d, kVertical)) {}
  // Along the azimuth and across it to x and y.
  HWY_INLINE void Turn(V along, V across, V& x, V& y) const {
    x = Fms(along, ex, across * ey);
    y = Fma(along, ey, across * ex);
  }
};

// The azimuth of w, and cosine c and sine s of its angle with n.
template <class D>
struct Incidence : Azimuth<D> {
  using V = Vec<D>;
  V inverse_nu, c, s;
  template <class I>
  HWY_INLINE Incidence(D d, const I& i) : Incidence(d, i, Sqrt(i.a)) {}

 private:
  template <class I>
  HWY_INLINE Incidence(D d, const I& i, V horizontal) : Azimuth<D>(d, i.wx, i.wy, horizontal) {
    inverse_nu = Set(d, 1.0f) / i.nu;
    c = i.wz * inverse_nu;
    s = horizontal * inverse_nu;
  }
};

// A point (t1, t2) of the unit disc that moves into a part of it, as Heitz 2018 does: with R^2 = 1 - t1^2 the chord
// through it, t2 = R - share (R - r sin phi). R - r sin phi and R + r sin phi have the product 1 - u1, so that neither
// needs to cancel; with b and p for them, R^2 - t2^2 = share b (p + (1 - share) b).
template <class D>
struct DiscChord {
  using V = Vec<D>;
  V t1, big_r, b, p;
  HWY_INLINE DiscChord(D d, V u1, V u2) {
    const V one = Set(d, 1.0f);
    V sin, cos;
    SinCosTurn(d, u2, sin, cos);
    const V r = Sqrt(u1);
    t1 = r * cos;
    const V radial = r * sin, rest = one - u1;
    big_r = Sqrt(Max((one - t1) * (one + t1), rest));
    const V larger = big_r + Abs(radial), smaller = rest / larger;
    const auto upper = radial > Zero(d);
    b = Select(upper, smaller, larger);
    p = Select(upper, larger, smaller);
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
