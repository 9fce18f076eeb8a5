// SPDX-License-Identifier: Apache-2.0
// The cone of GGX's unoccluded normals, for i_z > 0. Derivation: docs/math.md, "The exact reflection sampler"; the
// symbols are those used there.

#if defined(FACETWISE_GGX_CONE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_GGX_CONE_INL_H_
#undef FACETWISE_GGX_CONE_INL_H_
#else
#define FACETWISE_GGX_CONE_INL_H_
#endif

#include "src/kernels/surface-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// The elliptic cone of unoccluded normals, for i_z > 0.
template <class D>
struct Cone {
  using V = Vec<D>;
  HWY_INLINE Cone() {}
  V lambda;                // the form's positive eigenvalue
  V g;                     // w.v; lambda itself without a mean slope
  V px, py;                // i_z ax^2, i_z ay^2
  V inverse_p, inverse_q;  // 1/P, 1/Q: P = lambda + px, Q = lambda + py
  V vx, vy;                // the axis (v_x, v_y, 1)
  V inverse_n2;            // 1 / v.v
  V two_k;                 // 2 K = 2 lambda g / (n2 sqrt(P Q))
};

// One Halley step for the root of f(l) = l - h - x2 / P - y2 / Q, given 1/P and 1/Q at l. `ratio` is about
// 1 / f', and f' is v.v.
template <class D, class V = Vec<D>>
HWY_INLINE V HalleyStep(D d, V h, V x2, V y2, V l, V inverse_p, V inverse_q, V& ratio) {
  const V x = x2 * inverse_p, y = y2 * inverse_q;
  const V x1 = x * inverse_p, y1 = y * inverse_q;
  const V f = l - h - (x + y);
  const V f1 = x1 + y1 + Set(d, 1.0f);
  const V f2 = Fma(x1, inverse_p, y1 * inverse_q);  // minus half the second derivative
  ratio = f1 / Fma(f1, f1, f * f2);
  return NegFma(f, ratio, l);
}

// 1 / x to 0.3 %, for a start that is corrected later: a guess from the bits of x, and one Newton step of third
// order. x in [2^-60, 2^60].
template <class D, class V = Vec<D>>
HWY_INLINE V RoughReciprocal(D d, V x) {
  const Rebind<uint32_t, D> du{};
  const V y = BitCast(d, Set(du, 0x7EF311C7u) - BitCast(du, x));
  const V e = NegFma(x, y, Set(d, 1.0f));
  return Fma(y, Fma(e, e, e), y);
}

// 1 / x from a guess y that is wrong by 5 % at most: two Newton steps of third and second order, cheaper than
// a division.
template <class D, class V = Vec<D>>
HWY_INLINE V RefineReciprocal(D d, V x, V y) {
  const V one = Set(d, 1.0f);
  const V e = NegFma(x, y, one);
  y = Fma(y, Fma(e, e, e), y);
  return Fma(y, NegFma(x, y, one), y);
}

// Of the lanes of a vector: which are isotropic, and which have an alpha above 1.
template <class D>
struct Roughness {
  Mask<D> isotropic, rough;
  bool all_isotropic, any_isotropic, any_rough;
  template <class I>
  HWY_INLINE Roughness(D d, const I& i)
      : isotropic(i.ax == i.ay),
        rough(Max(i.ax, i.ay) > Set(d, 1.0f)),
        all_isotropic(AllTrue(d, isotropic)),
        any_isotropic(!AllFalse(d, isotropic)),
        any_rough(!AllFalse(d, rough)) {}
};

// The positive root of f for isotropic roughness, alpha^2 i_z = mean: (i_z - mean + root) / 2, or its conjugate
// where i_z < mean, that is for alpha > 1. Otherwise, with the mean of the two, a lower bound.
template <class D, class I, class V = Vec<D>>
HWY_INLINE V StartLambda(D d, const I& i, const Roughness<D>& roughness, V mean) {
  const V sum = i.z + mean, difference = i.z - mean;
  const V two_a = i.a + i.a;
  const V root = Sqrt(Fma(sum, sum, two_a + two_a));
  V lambda = Set(d, 0.5f) * (difference + root);
  if (roughness.any_rough) {
    const V numerator = Fma(i.z, mean, i.a);
    const V conjugate = (numerator + numerator) / (root - difference);
    // Only there: what a lane takes may not depend on its neighbours.
    lambda = Select(And(roughness.rough, difference < Zero(d)), conjugate, lambda);
  }
  return lambda;
}

template <class D, class I, class V = Vec<D>>
HWY_INLINE void MakeCone(D d, const I& i, const Roughness<D>& roughness, Cone<D>& cone) {
  const V one = Set(d, 1.0f);
  cone.px = i.z * (i.ax * i.ax);
  cone.py = cone.px;
  V mean = cone.px;
  if (!roughness.all_isotropic) {
    cone.py = i.z * (i.ay * i.ay);
    const V weighted = Fma(i.wx * i.wx, cone.px, i.wy * i.wy * cone.py);
    mean = weighted * RoughReciprocal(d, Max(i.a, Set(d, kSmallestA)));
    if (roughness.any_isotropic) mean = Select(roughness.isotropic, cone.px, mean);
  }
  V lambda = StartLambda(d, i, roughness, mean);

  // 1/P and 1/Q by one division; where P = Q this is the same whether or not a neighbour is anisotropic.
  V p = lambda + cone.px, q = lambda + cone.py;
  const V inverse_pq = one / (p * q);
  cone.inverse_p = q * inverse_pq;
  cone.inverse_q = p * inverse_pq;
  V inverse_root = cone.inverse_p;  // 1 / sqrt(P Q); sqrt(x x) is x in IEEE arithmetic

  V ratio = one;
  if (!roughness.all_isotropic) {
    // The start is wrong by 1.7 % at most for alpha up to 1; then one step leaves 7.5e-7.
    const V x2 = i.wx * i.wx, y2 = i.wy * i.wy;
    const V isotropic_lambda = lambda, start_p = cone.inverse_p, start_q = cone.inverse_q;
    lambda = HalleyStep(d, i.z, x2, y2, lambda, cone.inverse_p, cone.inverse_q, ratio);
    p = lambda + cone.px;
    q = lambda + cone.py;
    cone.inverse_p = RefineReciprocal(d, p, cone.inverse_p);
    cone.inverse_q = RefineReciprocal(d, q, cone.inverse_q);
    if (roughness.any_rough) {
      // Larger alpha takes two steps, above 4 three.
      const auto rougher = Max(i.ax, i.ay) > Set(d, 4.0f);
      for (const auto& lanes : {roughness.rough, rougher}) {
        const V inverse = one / (p * q);
        V unused;
        lambda = Select(lanes, HalleyStep(d, i.z, x2, y2, lambda, q * inverse, p * inverse, unused), lambda);
        p = lambda + cone.px;
        q = lambda + cone.py;
      }
      const V inverse = one / (p * q);
      cone.inverse_p = Select(roughness.rough, q * inverse, cone.inverse_p);
      cone.inverse_q = Select(roughness.rough, p * inverse, cone.inverse_q);
    }
    if (roughness.any_isotropic) {
      lambda = Select(roughness.isotropic, isotropic_lambda, lambda);
      cone.inverse_p = Select(roughness.isotropic, start_p, cone.inverse_p);
      cone.inverse_q = Select(roughness.isotropic, start_q, cone.inverse_q);
    }
    inverse_root = Sqrt(cone.inverse_p * cone.inverse_q);
  }

  cone.lambda = lambda;
  cone.g = lambda;
  cone.vx = i.wx * cone.inverse_p;
  cone.vy = i.wy * cone.inverse_q;
  const V n2 = Fma(cone.vx, cone.vx, Fma(cone.vy, cone.vy, one));
  if (roughness.all_isotropic) {
    cone.inverse_n2 = one / n2;
  } else {
    cone.inverse_n2 = RefineReciprocal(d, n2, ratio);
    if (roughness.any_isotropic || roughness.any_rough)
      cone.inverse_n2 = Select(Or(roughness.isotropic, roughness.rough), one / n2, cone.inverse_n2);
  }
  cone.two_k = (lambda + lambda) * lambda * (cone.inverse_n2 * inverse_root);
}

// With a mean slope the form's matrix is diag(-i_z ax^2, -i_z ay^2, h) bordered by q. Where h < 0 the isotropic root
// may not be positive; the form's value at the half vector of i and n is a second lower bound. Started at the larger
// one, 10 steps leave 1e-7; most lanes stop after one.
template <class D, class I, class V = Vec<D>>
HWY_INLINE void MakeAffineCone(D d, const I& i, Cone<D>& cone) {
  const V one = Set(d, 1.0f), tiny = Set(d, kSmallestA);
  // Lanes behind the surface do not use the cone.
  const V z = Select(i.front, Max(i.z, Set(d, kTiny)), one);
  const V qx = i.ax * Fma(z, i.mean_x, i.x), qy = i.ay * Fma(z, i.mean_y, i.y);
  const V slope2 = Fma(i.mean_x, i.mean_x, i.mean_y * i.mean_y);
  // 2 z' - i_z (1 + mean^2) = i_z (1 - mean^2) - 2 mean.i
  const V along = Fma(i.mean_x, i.x, i.mean_y * i.y);
  const V h = NegFma(z, slope2, z) - (along + along);
  cone.px = z * (i.ax * i.ax);
  cone.py = z * (i.ay * i.ay);
  const V x2 = qx * qx, y2 = qy * qy, qq = x2 + y2;
  const V mean = Fma(x2, cone.px, y2 * cone.py) / Max(qq, tiny);
  const V sum = h + mean, difference = h - mean;
  const V two_q = qq + qq;
  const V root = Sqrt(Fma(sum, sum, two_q + two_q));
  const V product = Fma(h, mean, qq);
  const V isotropic = Select(difference < Zero(d), (product + product) / Max(root - difference, tiny),
                             Set(d, 0.5f) * (difference + root));
  const V up = z + one;
  const V mx = Fma(i.mean_x, up, i.x) / i.ax, my = Fma(i.mean_y, up, i.y) / i.ay;
  const V rayleigh = (up + up) / Dot(mx, my, up, mx, my, up);
  V l = Max(isotropic, rayleigh);
  auto active = l > Zero(d);
  for (int step = 0; step < 10 && !AllFalse(d, active); ++step) {
    const V p = l + cone.px, q = l + cone.py;
    const V inverse = one / (p * q);
    V unused;
    const V next = HalleyStep(d, h, x2, y2, l, q * inverse, p * inverse, unused);
    const auto moves = Abs(next - l) > l * Set(d, 1e-7f);
    l = Select(And(active, next > Zero(d)), next, l);
    active = And(active, moves);
  }
  const V p = l + cone.px, q = l + cone.py;
  cone.lambda = l;
  cone.inverse_p = one / p;
  cone.inverse_q = one / q;
  cone.vx = qx * cone.inverse_p;
  cone.vy = qy * cone.inverse_q;
  cone.inverse_n2 = one / Fma(cone.vx, cone.vx, Fma(cone.vy, cone.vy, one));
  cone.g = Max(Dot(i.wx, i.wy, i.wz, cone.vx, cone.vy, one), tiny);
  cone.two_k = (l + l) * cone.g * (cone.inverse_n2 * Sqrt(cone.inverse_p * cone.inverse_q));
}

template <class D, class I>
HWY_INLINE void MakeConeOf(D d, const I& i, const Roughness<D>& roughness, Cone<D>& cone) {
  if constexpr (I::Surface::kAffine) {
    MakeAffineCone(d, i, cone);
  } else {
    MakeCone(d, i, roughness, cone);
  }
}

// K / sigma(i).
template <class D, class I, class V = Vec<D>>
HWY_INLINE V ShareInCone(D d, const I& i) {
  const V one = Set(d, 1.0f);
  Cone<D> cone;
  MakeConeOf(d, i, Roughness<D>(d, i), cone);
  return Select(i.front, Min(cone.two_k / i.two_sigma, one), one);
}

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
