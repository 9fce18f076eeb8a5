// GGX: 2 sigma(i) = w_z + nu; D(m) = (M.M)^2 / (|m_hat|^4 pi ax ay).

#if defined(FACETWISE_GGX_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_GGX_INL_H_
#undef FACETWISE_GGX_INL_H_
#else
#define FACETWISE_GGX_INL_H_
#endif

#include "src/kernels/surface-inl.h"
#include "src/math/sincos-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

struct Ggx {
  static constexpr bool kShifts = false;
  static constexpr float kLargestRoughness = kLargestAlpha;

  template <class D, class I>
  static HWY_INLINE void Area(D d, I& i) {
    i.t = i.nu + i.wz;
    // Behind the surface w_z + nu cancels: A / (nu - w_z).
    if (!i.all_front) i.t = Select(i.ahead, i.t, Max(i.a, Set(d, kSmallestA)) / (i.nu - i.wz));
  }
  template <class D, class I>
  static HWY_INLINE void BiasedArea(D, I& i) {
    i.tn = i.nu + Abs(i.wz);
  }

  // For a direction o in front of the surface, its z' and A: 2 sigma(o), and 2 sigma(-o) as back / scale.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Areas(D, const I&, V z, V a, V& front, V& back, V& scale) {
    front = z + Sqrt(Fma(z, z, a));
    back = a;
    scale = front;
  }

  // pi ax ay D(m) for m of any length: q^2 with q = |m|^2 (ax ay)^2 / ((m_x ay)^2 + (m_y ax)^2 + (m_z ax ay)^2). Needs |m|^2 above
  // 2^-40, where nothing underflows.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V Density(D, const I& i, V mx, V my, V mz, V m2, V) {
    Centre(i, mx, my, mz);
    const V axy = i.ax * i.ay;
    const V x = mx * i.ay, y = my * i.ax, z = mz * axy;
    const V q = m2 * (axy * axy) / Dot(x, y, z, x, y, z);
    return q * q;
  }

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V Share(D d, const I& i) {
    return ConeShare(d, i);  // exact-inl.h
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
