// SPDX-License-Identifier: Apache-2.0
// What kernels are composed of: a surface is a distribution with a masking, its slopes standard ones stretched by
// the roughness and, if it is affine, rotated (correlated roughness) and moved (mean slope) too.
//
// Symbols. i, o, m as in model.h. Standard normals m_hat and slopes are those of roughness 1: m ~ M = L m_hat with
// L = [[ax, 0, -mean_x], [0, ay, -mean_y], [0, 0, 1]], of any length. w = L^T i, its length nu, so that i.M = w.m_hat;
// w_z is z' = i_z - mean_x i_x - mean_y i_y, i_z itself without a mean. A = w_x^2 + w_y^2. sigma(i): projected area,
// that of the standard surface seen from w.
//
// Correlated roughness: i and o are rotated to the principal axes of the slopes' covariance as they are loaded,
// and all that leaves a kernel is rotated back.

#if defined(FACETWISE_SURFACE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_SURFACE_INL_H_
#undef FACETWISE_SURFACE_INL_H_
#else
#define FACETWISE_SURFACE_INL_H_
#endif

#include "facetwise/model.h"
#include "src/math/exp-inl.h"
#include "src/tile.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

inline constexpr float kPi = 3.14159265358979f;
inline constexpr float kLengthTolerance = 1e-3f;  // of |v|^2 of a direction
inline constexpr float kLargestBelowOne = 1 - 0x1p-24f;
inline constexpr float kTiny = 0x1p-60f;     // stands for a cosine or a share of 0 in quotients
inline constexpr float kHorizon = 0x1p-30f;  // stands for a cosine of 0 where it is squared
inline constexpr float kVertical = 1e-15f;   // a shorter (x, y) has no azimuth

// Where w is straight below no normal is visible and sigma is 0. Behind the surface A is taken as this at least,
// as if w were tilted by 3e-8, so that densities stay finite.
inline constexpr float kSmallestA = 0x1p-50f, kSmallestHorizontal = 0x1p-25f;  // its root

// What a distribution is unless it says otherwise.
struct DistributionTraits {
  static constexpr float kLargestRoughness = kLargestAlpha;
  static constexpr bool kShifts = false;  // densities and areas are kept times e^(shift)
  static constexpr bool kQuick = false;  // so quick that tests of what is wanted count, and large calls wait for memory
  static constexpr bool kLongChains = false;          // all sampling gains from two vectors at a time
  static constexpr bool kOwnMean = false;             // the table's mean slope is added to the batch's
  static constexpr bool kHasShareUnoccluded = false;  // ShareUnoccluded() is known
  // What Area() leaves to a sampler.
  template <class D>
  struct Kept {};
};

// Distribution: a policy as described in docs/adding.md.
template <class Distribution_, class Masking_, bool kAffine_>
struct Surface {
  using Distribution = Distribution_;
  using Masking = Masking_;
  static constexpr bool kAffine = kAffine_;
};

// A direction seen by a surface, usually the incident one.
template <class D, class S>
struct Incident {
  using V = Vec<D>;
  using Surface = S;
  using Distribution = typename S::Distribution;
  HWY_INLINE Incident() {}
  V x, y, z;
  V ax, ay;
  V mean_x, mean_y;  // if the surface is affine
  V wx, wy, wz;
  V a;               // A
  V nu;              // length of w
  V two_sigma;       // 2 sigma(i), times exp(shift)
  V two_normaliser;  // the same as densities are normalised: Normalisation
  V shift;           // of distributions whose sigma underflows: density and area are both kept times exp(shift)
  V area_shift;      // that of two_sigma, also where two_normaliser has none
  Mask<D> front;     // i_z > 0
  Mask<D> ahead;     // w_z > 0
  bool all_front;    // both, in all lanes
  const SlopeTableView* table;
  typename Distribution::template Kept<D> kept;
};

// Unless kReadsArea the area is left out in front where nobody wants a weight.
template <class S, bool kReadsArea, class D, class V = Vec<D>>
HWY_INLINE Incident<D, S> Prepare(D d, const Tile& tile, V x, V y, V z, V ax, V ay, V mean_x, V mean_y) {
  Incident<D, S> i;
  i.x = x;
  i.y = y;
  i.z = z;
  i.ax = ax;
  i.ay = ay;
  i.wx = ax * x;
  i.wy = ay * y;
  i.wz = z;
  i.front = z > Zero(d);
  i.ahead = i.front;
  if constexpr (S::kAffine) {
    i.mean_x = mean_x;
    i.mean_y = mean_y;
    i.wz = NegFma(mean_x, x, NegFma(mean_y, y, z));
    i.ahead = i.wz > Zero(d);
  }
  i.a = Fma(i.wx, i.wx, i.wy * i.wy);
  if constexpr (S::kAffine) {
    i.all_front = AllTrue(d, And(i.front, i.ahead));
  } else {
    i.all_front = AllTrue(d, i.front);
  }
  i.table = tile.table;
  if constexpr (!kReadsArea) {
    if (i.all_front && !(tile.wanted & kWantsWeight)) {
      i.nu = i.two_sigma = i.two_normaliser = Set(d, 1.0f);
      i.shift = i.area_shift = Zero(d);
      return i;
    }
  }
  i.nu = Sqrt(Fma(i.wz, i.wz, i.a));
  S::Masking::Area(d, i);
  i.two_normaliser = i.two_sigma;
  if (!i.all_front && tile.biased) S::Masking::BiasedArea(d, i);
  return i;
}

// Standard normal to M, without and with a mean slope.
template <class I, class V>
HWY_INLINE void Unstretch(const I& i, V hx, V hy, V hz, V& mx, V& my) {
  mx = i.ax * hx;
  my = i.ay * hy;
  if constexpr (I::Surface::kAffine) {
    mx = NegFma(i.mean_x, hz, mx);
    my = NegFma(i.mean_y, hz, my);
  }
}

// alpha_x m_hat_x, alpha_y m_hat_y of an m of any length: what m has without the mean slope.
template <class I, class V>
HWY_INLINE void Centre(const I& i, V& mx, V& my, V mz) {
  if constexpr (I::Surface::kAffine) {
    mx = Fma(i.mean_x, mz, mx);
    my = Fma(i.mean_y, mz, my);
  }
}

// A rotation of the frame about n.
template <class D>
struct Rotation {
  using V = Vec<D>;
  HWY_INLINE Rotation() {}
  V cos, sin;
  HWY_INLINE void In(V& x, V& y) const {
    const V along = Fma(cos, x, sin * y);
    y = Fms(cos, y, sin * x);
    x = along;
  }
  HWY_INLINE void Out(V& x, V& y) const {
    const V along = Fms(cos, x, sin * y);
    y = Fma(cos, y, sin * x);
    x = along;
  }
};

// To the principal axes of [[ax^2, rho ax ay], [rho ax ay, ay^2]], each to the nearer one: ax and ay become the roots
// of the eigenvalues there. With half difference g, covariance c and R = |(g, c)| the eigenvalues are mean +- R, and
// the axes are half the angle of (|g|, c) away.
template <class D, class V = Vec<D>>
HWY_INLINE Rotation<D> PrincipalAxes(D d, V rho, V& ax, V& ay) {
  const V zero = Zero(d), one = Set(d, 1.0f), half = Set(d, 0.5f);
  Rotation<D> r;
  const V c = rho * (ax * ay);
  const V g = half * ((ax - ay) * (ax + ay));
  const V big_r = Sqrt(Fma(g, g, c * c));
  const auto round = big_r <= zero;
  const V safe_r = Select(round, one, big_r);
  const V cos = Sqrt(half * ((big_r + Abs(g)) / safe_r));  // in [sqrt(1/2), 1]
  const V sin = half * (c / (safe_r * cos));
  const auto x_is_major = g >= zero;
  r.cos = Select(round, one, cos);
  r.sin = IfThenElseZero(Not(round), Select(x_is_major, sin, Neg(sin)));
  const V major = Sqrt(Fma(half, Fma(ax, ax, ay * ay), big_r));
  // The product of the roots is ax ay sqrt(1 - rho^2).
  const V minor = ax * ay * Sqrt((one - rho) * (one + rho)) / major;
  const auto uncorrelated = c == zero;
  const V first = Select(x_is_major, major, minor), second = Select(x_is_major, minor, major);
  ax = Select(uncorrelated, ax, first);
  ay = Select(uncorrelated, ay, second);
  return r;
}

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
