// The exact reflection sampler: visible normals whose reflection is not occluded, in exact proportion.
// Derivation: docs/math.md, "The exact reflection sampler"; the symbols are those used there.

#if defined(FACETWISE_EXACT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_EXACT_INL_H_
#undef FACETWISE_EXACT_INL_H_
#else
#define FACETWISE_EXACT_INL_H_
#endif

#include "src/kernels/samplers-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// The smallest o_z, m_hat_z and i.M / lambda that `exact` returns for i_z > 0: rounding puts a few samples in a
// million on the wrong side of the rim they were drawn inside of, and these are raised to it.
inline constexpr float kRim = 0x1p-30f;

// The elliptic cone of unoccluded normals, for i_z > 0.
template <class D>
struct Cone {
  using V = Vec<D>;
  HWY_INLINE Cone() {}
  V lambda;                  // the form's positive eigenvalue
  V inverse_p, inverse_q;    // 1 / (lambda + i_z ax^2), 1 / (lambda + i_z ay^2)
  V vx, vy;                  // the axis (v_x, v_y, 1)
  V inverse_n2;              // 1 / v.v
  V two_k;                   // 2 K = 2 lambda^2 / (n2 sqrt(P Q))
};

// One Halley step for the root of f(l) = l - i_z - w_x^2 / P - w_y^2 / Q, given 1/P and 1/Q at l.
template <class D, class V = Vec<D>>
HWY_INLINE V HalleyStep(D d, const Incident<D>& i, V l, V inverse_p, V inverse_q) {
  const V x = i.wx * i.wx * inverse_p, y = i.wy * i.wy * inverse_q;
  const V x1 = x * inverse_p, y1 = y * inverse_q;
  const V f = l - i.z - (x + y);
  const V f1 = x1 + y1 + Set(d, 1.0f);
  const V f2 = Fma(x1, inverse_p, y1 * inverse_q);  // minus half the second derivative
  return NegFma(f, f1 / Fma(f1, f1, f * f2), l);
}

// 1 / x from a guess y that is wrong by 2 % at most: two Newton steps of third and second order, cheaper than
// a division.
template <class D, class V = Vec<D>>
HWY_INLINE V RefineReciprocal(D d, V x, V y) {
  const V one = Set(d, 1.0f);
  const V e = NegFma(x, y, one);
  y = Fma(y, Fma(e, e, e), y);
  return Fma(y, NegFma(x, y, one), y);
}

template <class D, class V = Vec<D>>
HWY_INLINE void MakeCone(D d, const Incident<D>& i, Cone<D>& cone) {
  const V one = Set(d, 1.0f);
  const V px = i.z * (i.ax * i.ax);
  const auto isotropic = i.ax == i.ay;
  const bool all_isotropic = AllTrue(d, isotropic);

  // lambda for isotropic roughness; otherwise a start from below, with the mean of i_z alpha^2.
  V py = px, mean = px;
  if (!all_isotropic) {
    py = i.z * (i.ay * i.ay);
    mean = Select(isotropic, px, Fma(i.wx * i.wx, px, i.wy * i.wy * py) / Max(i.a, Set(d, kSmallestA)));
  }
  const V sum = i.z + mean, difference = i.z - mean;
  const V two_a = i.a + i.a;
  const V root = Sqrt(Fma(sum, sum, two_a + two_a));
  V lambda = Set(d, 0.5f) * (difference + root);
  const auto cancels = difference < Zero(d);
  if (!AllFalse(d, cancels)) {
    const V numerator = Fma(i.z, mean, i.a);
    lambda = Select(cancels, (numerator + numerator) / (root - difference), lambda);
  }

  // 1/P and 1/Q by one division; where P = Q this is the same whether or not a neighbour is anisotropic.
  V p = lambda + px, q = lambda + py;
  V inverse_pq = one / (p * q);
  cone.inverse_p = q * inverse_pq;
  cone.inverse_q = p * inverse_pq;
  V inverse_root = cone.inverse_p;  // 1 / sqrt(P Q); sqrt(x x) is x in IEEE arithmetic

  if (!all_isotropic) {
    // The start is wrong by 1.7 % at most for alpha up to 1; then one step leaves 7.5e-7. Larger alpha takes two,
    // above 4 three. Isotropic lanes need none.
    const auto step = [&](auto lanes) HWY_ATTR {
      lambda = Select(lanes, HalleyStep(d, i, lambda, cone.inverse_p, cone.inverse_q), lambda);
      p = lambda + px;
      q = lambda + py;
    };
    const auto divide = [&](auto lanes) HWY_ATTR {
      inverse_pq = one / (p * q);
      cone.inverse_p = Select(lanes, q * inverse_pq, cone.inverse_p);
      cone.inverse_q = Select(lanes, p * inverse_pq, cone.inverse_q);
    };
    step(Not(isotropic));
    const auto rough = AndNot(isotropic, Max(i.ax, i.ay) > one);
    const auto smoother = Not(Or(isotropic, rough));
    cone.inverse_p = Select(smoother, RefineReciprocal(d, p, cone.inverse_p), cone.inverse_p);
    cone.inverse_q = Select(smoother, RefineReciprocal(d, q, cone.inverse_q), cone.inverse_q);
    if (!AllFalse(d, rough)) {
      divide(rough);
      step(rough);
      divide(rough);
      const auto rougher = AndNot(isotropic, Max(i.ax, i.ay) > Set(d, 4.0f));
      if (!AllFalse(d, rougher)) {
        step(rougher);
        divide(rougher);
      }
    }
    inverse_root = Sqrt(cone.inverse_p * cone.inverse_q);
  }

  cone.lambda = lambda;
  cone.vx = i.wx * cone.inverse_p;
  cone.vy = i.wy * cone.inverse_q;
  cone.inverse_n2 = one / Fma(cone.vx, cone.vx, Fma(cone.vy, cone.vy, one));
  cone.two_k = (lambda + lambda) * lambda * (cone.inverse_n2 * inverse_root);
}

struct Exact {
  static constexpr bool kUnit = false;
  static constexpr bool kUsesU3 = true;
  static constexpr bool kVisible = true;
  static constexpr bool kNIsSigma = false;
  static constexpr bool kExact = true;

  template <class D, class V = Vec<D>>
  static HWY_INLINE V TwoN(D d, const Incident<D>& i, V, V) {
    Cone<D> cone;
    MakeCone(d, i, cone);
    return Select(i.front, cone.two_k, i.t);
  }

  template <class D, class V = Vec<D>>
  static HWY_INLINE void Draw(D d, const Incident<D>& i, V u1, V u2, V u3, Drawn<D>& drawn) {
    Cone<D> cone;
    MakeCone(d, i, cone);
    const V one = Set(d, 1.0f), rim = Set(d, kRim);
    V sin, cos;
    SinCosTurn(d, u2, sin, cos);

    // A point (xi, eta) of the ellipse, uniformly; the point of the sphere above it, along the axis v.
    const V lambda_u = cone.lambda * u1;
    const V rp = Sqrt(lambda_u * cone.inverse_p);
    V rq = rp;
    if (!AllTrue(d, i.ax == i.ay)) rq = Sqrt(lambda_u * cone.inverse_q);
    const V xi = rp * cos, eta = rq * sin;
    const V along = Fma(xi, cone.vx, eta * cone.vy);
    const V y = Neg(along * cone.inverse_n2);
    // zeta^2 v.v = 1 - xi^2 - eta^2 + along^2 / v.v. At the rim 1 - xi^2 - eta^2 cancels; by 1 - lambda / P =
    // i_z ax^2 / P it is a sum of positive terms: (1 - u1) lambda X + i_z (ax^2 cos^2 / P + ay^2 sin^2 / Q),
    // X = cos^2 / P + sin^2 / Q.
    const V cp = cos * cos * cone.inverse_p, sq = sin * sin * cone.inverse_q;
    const V inside = Fma((one - u1) * cone.lambda, cp + sq, i.z * Fma(i.ax * i.ax, cp, i.ay * i.ay * sq));
    const V zeta = Sqrt(Fma(y, y, inside * cone.inverse_n2));

    // The sample or its mirror image about the axis, in proportion to w.m_hat.
    const V across = Fma(xi, i.wx, eta * i.wy);
    const V g_zeta = cone.lambda * zeta;
    const V threshold = Fma(cone.lambda, y, across) + g_zeta;
    const auto mirrored = Not(u3 * (g_zeta + g_zeta) < threshold);
    const V sign = IfThenElseZero(mirrored, SignBit(d));
    const V hz = Max(zeta + Xor(y, sign), rim);
    const V hx = Fma(hz, cone.vx, Xor(xi, sign)), hy = Fma(hz, cone.vy, Xor(eta, sign));
    Unstretch(i, hx, hy, hz, drawn);
    drawn.im = Max(Dot(i.wx, i.wy, i.z, hx, hy, hz), rim * cone.lambda);
    drawn.two_n = cone.two_k;

    // Behind, nothing is occluded: the cap.
    const auto front = i.front;
    if (!i.all_front) {
      Drawn<D> cap;
      Cap::Draw(d, i, u1, u2, u3, cap);
      drawn.mx = Select(front, drawn.mx, cap.mx);
      drawn.my = Select(front, drawn.my, cap.my);
      drawn.mz = Select(front, drawn.mz, cap.mz);
      drawn.mm = Select(front, drawn.mm, cap.mm);
      drawn.im = Select(front, drawn.im, cap.im);
      drawn.two_n = Select(front, drawn.two_n, cap.two_n);
    }
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
