// The vector operations that kernels are made of. Only operations with one IEEE result are used (+ - * / sqrt,
// fused multiply-add, comparisons, selects, integers), so that every target gives the same bits.
//
// Notation in kernels: operators for + - * / and comparisons; Fma where a product and a sum are fused.

#if defined(FACETWISE_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_LANES_INL_H_
#undef FACETWISE_LANES_INL_H_
#else
#define FACETWISE_LANES_INL_H_
#endif

#include <cmath>
#include <cstdint>

#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <class D>
using Vec = hn::Vec<D>;
template <class D>
using Mask = hn::Mask<D>;

// a * b + c, rounded once. The portable fallback has no such instruction: slow and right.
template <class V>
HWY_INLINE V Fma(V a, V b, V c) {
#if HWY_TARGET == HWY_SCALAR
  return V(std::fma(a.raw, b.raw, c.raw));
#else
  return hn::MulAdd(a, b, c);
#endif
}

// c - a * b, rounded once.
template <class V>
HWY_INLINE V NegFma(V a, V b, V c) {
#if HWY_TARGET == HWY_SCALAR
  return V(std::fma(-a.raw, b.raw, c.raw));
#else
  return hn::NegMulAdd(a, b, c);
#endif
}

template <class M, class V>
HWY_INLINE V Select(M condition, V yes, V no) {
  return hn::IfThenElse(condition, yes, no);
}

template <class D>
HWY_INLINE Mask<D> NoLanes(D d) {
  return hn::Set(d, 0.0f) > hn::Set(d, 0.0f);
}

// a.x b.x + a.y b.y + a.z b.z
template <class V>
HWY_INLINE V Dot(V ax, V ay, V az, V bx, V by, V bz) {
  return Fma(ax, bx, Fma(ay, by, az * bz));
}

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
