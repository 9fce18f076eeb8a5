// GGX with Smith masking: projected areas, density of normals, shadowing weights.
//
// Symbols. i, o, m as in model.h. w = (ax i_x, ay i_y, i_z): the stretched incident direction, nu its length.
// A = w_x^2 + w_y^2. t = i_z + nu = 2 sigma(i).

#if defined(FACETWISE_GGX_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_GGX_INL_H_
#undef FACETWISE_GGX_INL_H_
#else
#define FACETWISE_GGX_INL_H_
#endif

#include "src/math/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

inline constexpr float kPi = 3.14159265358979f;
inline constexpr float kLengthTolerance = 1e-3f;  // of |v|^2 of a direction

// Where i is straight below (i = (0, 0, -1)) no normal is visible and sigma is 0. Behind the surface A is taken
// as this at least, as if i were tilted by a stretched 3e-8, so that densities stay finite.
inline constexpr float kSmallestA = 0x1p-50f;

template <class D>
struct Incident {
  using V = Vec<D>;
  HWY_INLINE Incident() {}
  V x, y, z;
  V ax, ay;
  V wx, wy;
  V a;   // A
  V nu;  // length of w
  V t;   // 2 sigma(i)
  Mask<D> front;  // i_z > 0
  bool all_front;
};

template <class D, class V = Vec<D>>
HWY_INLINE Incident<D> Prepare(D d, V x, V y, V z, V ax, V ay) {
  Incident<D> i;
  i.x = x;
  i.y = y;
  i.z = z;
  i.ax = ax;
  i.ay = ay;
  i.wx = ax * x;
  i.wy = ay * y;
  i.a = Fma(i.wx, i.wx, i.wy * i.wy);
  i.nu = Sqrt(Fma(z, z, i.a));
  i.t = i.nu + z;
  i.front = z > Zero(d);
  i.all_front = AllTrue(d, i.front);
  // Behind the surface i_z + nu cancels: A / (nu - i_z).
  if (!i.all_front) i.t = Select(i.front, i.t, Max(i.a, Set(d, kSmallestA)) / (i.nu - z));
  return i;
}

// D(m) = q^2 / (pi ax ay) for the half vector m ~ h; returns q = |h|^2 (ax ay)^2 / ((h_x ay)^2 + (h_y ax)^2 +
// (h_z ax ay)^2). Needs |h|^2 above 2^-40, where nothing underflows.
template <class V>
HWY_INLINE V DensityRoot(V hx, V hy, V hz, V h2, V ax, V ay) {
  const V axy = ax * ay;
  const V x = hx * ay, y = hy * ax, z = hz * axy;
  return h2 * (axy * axy) / Dot(x, y, z, x, y, z);
}

// w = f cos(theta_o) / pdf_visible(o), as numerator and denominator, for o_z > 0. With A_o and T_o the same
// for o, and s = o_z + T_o: Lambda(o) = A_o / (2 o_z s), so that
//   correlated    sigma(i) / (sigma(i) + |i_z| Lambda(o)) = t o_z s / (t o_z s + |i_z| A_o)
//   uncorrelated  G1(o) = 2 o_z / s
// Nothing cancels, in front or behind. o_z is taken as 2^-60 at least, where no product underflows.
template <class D, class V = Vec<D>>
HWY_INLINE void ShadowingWeight(D d, const Incident<D>& i, V ox, V oy, V oz, bool uncorrelated, V& numerator,
                                V& denominator) {
  const V wx = i.ax * ox, wy = i.ay * oy;
  const V a = Fma(wx, wx, wy * wy);
  oz = Max(oz, Set(d, 0x1p-60f));
  const V s = oz + Sqrt(Fma(oz, oz, a));
  if (uncorrelated) {
    numerator = oz + oz;
    denominator = s;
  } else {
    numerator = i.t * (oz * s);
    denominator = Fma(Abs(i.z), a, numerator);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
