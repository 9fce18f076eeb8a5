// SPDX-License-Identifier: Apache-2.0
// The vector operations that kernels are made of. Only operations with one IEEE result are used (+ - * / sqrt,
// fused multiply-add, comparisons, selects, integers), so that every target gives the same bits.
//
// Kernels are templates over a tag D: one of Highway's, or Twice<D>, two neighbouring ones, which may be pairs too. They call
// operations without a namespace, so that argument-dependent lookup finds Highway's for its vectors and those
// below for pairs. Fma and the like are fused; * and + are not.
//
// Why pairs: a kernel is one long chain of roots and divisions, and the processor's scheduler is full of one
// vector's waiting instructions before it reaches the next vector. With several vectors' instructions side by side
// their chains advance together.

#if defined(FACETWISE_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_LANES_INL_H_
#undef FACETWISE_LANES_INL_H_
#else
#define FACETWISE_LANES_INL_H_
#endif

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <class D>
struct Twice {
  D d;
};
// Constructors of structs with vectors are written out: implicit ones would not be compiled for the target.
template <class V>
struct Pair {
  V a, b;
  HWY_INLINE Pair() {}
  HWY_INLINE Pair(V first, V second) : a(first), b(second) {}
};

template <class D>
struct TagTraits {
  using V = hn::Vec<D>;
  using M = hn::Mask<D>;
  template <class T>
  using Rebound = hn::Rebind<T, D>;
};
template <class D>
struct TagTraits<Twice<D>> {
  using V = Pair<typename TagTraits<D>::V>;
  using M = Pair<typename TagTraits<D>::M>;
  template <class T>
  using Rebound = Twice<typename TagTraits<D>::template Rebound<T>>;
};

// AVX-512 has AVX2's scalar instructions, so that kernels one lane wide are compiled once for both.
#undef FACETWISE_HAS_ONE_LANE
#define FACETWISE_HAS_ONE_LANE (HWY_TARGET != HWY_AVX3)

using Full = hn::ScalableTag<float>;
using Single = hn::CappedTag<float, 1>;
// Side by side; not where vectors have one lane, which is slow anyhow.
template <class D>
using Two = std::conditional_t<hn::MaxLanes(D()) == 1, D, Twice<D>>;
template <class D>
using Four = std::conditional_t<hn::MaxLanes(D()) == 1, D, Twice<Twice<D>>>;

// Whether there are streaming stores: on x86, where two of these vectors fill a line at the least.
template <class D>
inline constexpr bool kStreams = HWY_ARCH_X86&& hn::MaxLanes(D()) >= 8;
template <class D>
inline constexpr bool kStreams<Twice<D>> = kStreams<D>;

template <class D>
using Vec = typename TagTraits<D>::V;
template <class D>
using Mask = typename TagTraits<D>::M;
// The tag of as many lanes of another type.
template <class T, class D>
using Rebind = typename TagTraits<D>::template Rebound<T>;

// Operations on pairs: on each vector.
#define FACETWISE_PAIRWISE(F)                            \
  template <class V>                                     \
  HWY_INLINE auto F(Pair<V> x)->Pair<decltype(F(x.a))> { \
    return {F(x.a), F(x.b)};                             \
  }
FACETWISE_PAIRWISE(Sqrt)
FACETWISE_PAIRWISE(Abs)
FACETWISE_PAIRWISE(Neg)
FACETWISE_PAIRWISE(Not)
#undef FACETWISE_PAIRWISE

#define FACETWISE_PAIRWISE(F)                                            \
  template <class V, class W>                                            \
  HWY_INLINE auto F(Pair<V> x, Pair<W> y)->Pair<decltype(F(x.a, y.a))> { \
    return {F(x.a, y.a), F(x.b, y.b)};                                   \
  }
FACETWISE_PAIRWISE(operator+)
FACETWISE_PAIRWISE(operator-)
FACETWISE_PAIRWISE(operator*)
FACETWISE_PAIRWISE(operator/)
FACETWISE_PAIRWISE(operator==)
FACETWISE_PAIRWISE(operator<)
FACETWISE_PAIRWISE(operator<=)
FACETWISE_PAIRWISE(operator>)
FACETWISE_PAIRWISE(operator>=)
FACETWISE_PAIRWISE(Min)
FACETWISE_PAIRWISE(Max)
FACETWISE_PAIRWISE(And)
FACETWISE_PAIRWISE(AndNot)
FACETWISE_PAIRWISE(Or)
FACETWISE_PAIRWISE(Xor)
FACETWISE_PAIRWISE(TestBit)
FACETWISE_PAIRWISE(IfThenElseZero)
#undef FACETWISE_PAIRWISE

using hn::ShiftLeft;
template <int kBits, class V>
HWY_INLINE Pair<V> ShiftLeft(Pair<V> x) {
  return {ShiftLeft<kBits>(x.a), ShiftLeft<kBits>(x.b)};
}
using hn::ShiftRight;
template <int kBits, class V>
HWY_INLINE Pair<V> ShiftRight(Pair<V> x) {
  return {ShiftRight<kBits>(x.a), ShiftRight<kBits>(x.b)};
}

// Operations with a tag.
template <class D, class T>
HWY_INLINE Vec<Twice<D>> Set(Twice<D> d, T value) {
  return {Set(d.d, value), Set(d.d, value)};
}
template <class D>
HWY_INLINE Vec<Twice<D>> Zero(Twice<D> d) {
  return {Zero(d.d), Zero(d.d)};
}
template <class D>
HWY_INLINE Vec<Twice<D>> SignBit(Twice<D> d) {
  return {SignBit(d.d), SignBit(d.d)};
}
template <class D>
HWY_INLINE std::size_t Lanes(Twice<D> d) {
  return 2 * Lanes(d.d);
}
template <class D, class T>
HWY_INLINE Vec<Twice<D>> LoadU(Twice<D> d, const T* from) {
  return {LoadU(d.d, from), LoadU(d.d, from + Lanes(d.d))};
}
template <class D, class V, class T>
HWY_INLINE void StoreU(Pair<V> x, Twice<D> d, T* to) {
  StoreU(x.a, d.d, to);
  StoreU(x.b, d.d, to + Lanes(d.d));
}
template <class D, class V, class T>
HWY_INLINE void Stream(Pair<V> x, Twice<D> d, T* to) {
  Stream(x.a, d.d, to);
  Stream(x.b, d.d, to + Lanes(d.d));
}
template <class D, class V>
HWY_INLINE Vec<Twice<D>> BitCast(Twice<D> d, Pair<V> x) {
  return {BitCast(d.d, x.a), BitCast(d.d, x.b)};
}
template <class D, class V>
HWY_INLINE Vec<Twice<D>> DemoteTo(Twice<D> d, Pair<V> x) {
  return {DemoteTo(d.d, x.a), DemoteTo(d.d, x.b)};
}
template <class D, class V>
HWY_INLINE Vec<Twice<D>> ConvertTo(Twice<D> d, Pair<V> x) {
  return {ConvertTo(d.d, x.a), ConvertTo(d.d, x.b)};
}
template <class D, class M>
HWY_INLINE Mask<Twice<D>> RebindMask(Twice<D> d, Pair<M> x) {
  return {RebindMask(d.d, x.a), RebindMask(d.d, x.b)};
}
template <class D>
HWY_INLINE Mask<Twice<D>> FirstN(Twice<D> d, std::size_t n) {
  const std::size_t lanes = Lanes(d.d);
  return {FirstN(d.d, n < lanes ? n : lanes), FirstN(d.d, n < lanes ? 0 : n - lanes)};
}
template <class D, class M>
HWY_INLINE bool AllTrue(Twice<D> d, Pair<M> x) {
  return AllTrue(d.d, And(x.a, x.b));
}
template <class D, class M>
HWY_INLINE bool AllFalse(Twice<D> d, Pair<M> x) {
  return AllFalse(d.d, Or(x.a, x.b));
}
template <class D, class M>
HWY_INLINE std::size_t CountTrue(Twice<D> d, Pair<M> x) {
  return CountTrue(d.d, x.a) + CountTrue(d.d, x.b);
}

// a * b + c, c - a * b, a * b - c, each rounded once. The portable fallback has no such instructions: slow and
// right.
#if HWY_TARGET == HWY_SCALAR
// gcc 12 turns -(a b + c) into -a b - c, whose zero has the other sign, where it knows an instruction for it (arm64).
HWY_INLINE float Fused(float a, float b, float c) {
  float sum = std::fma(a, b, c);
#if HWY_ARCH_ARM_A64
  asm("" : "+w"(sum));
#endif
  return sum;
}
template <class V>
HWY_INLINE V Fma(V a, V b, V c) {
  return V(Fused(a.raw, b.raw, c.raw));
}
template <class V>
HWY_INLINE V NegFma(V a, V b, V c) {
  return V(Fused(-a.raw, b.raw, c.raw));
}
template <class V>
HWY_INLINE V Fms(V a, V b, V c) {
  return V(Fused(a.raw, b.raw, -c.raw));
}
#else
template <class V>
HWY_INLINE V Fma(V a, V b, V c) {
  return MulAdd(a, b, c);
}
template <class V>
HWY_INLINE V NegFma(V a, V b, V c) {
  return NegMulAdd(a, b, c);
}
template <class V>
HWY_INLINE V Fms(V a, V b, V c) {
  return MulSub(a, b, c);
}
#endif

template <class M, class V>
HWY_INLINE V Select(M condition, V yes, V no) {
  return IfThenElse(condition, yes, no);
}

#define FACETWISE_PAIRWISE(F)                             \
  template <class M, class V>                             \
  HWY_INLINE Pair<V> F(Pair<M> x, Pair<V> y, Pair<V> z) { \
    return {F(x.a, y.a, z.a), F(x.b, y.b, z.b)};          \
  }
FACETWISE_PAIRWISE(Select)
#undef FACETWISE_PAIRWISE
#define FACETWISE_PAIRWISE(F)                             \
  template <class V>                                      \
  HWY_INLINE Pair<V> F(Pair<V> x, Pair<V> y, Pair<V> z) { \
    return {F(x.a, y.a, z.a), F(x.b, y.b, z.b)};          \
  }
FACETWISE_PAIRWISE(Fma)
FACETWISE_PAIRWISE(NegFma)
FACETWISE_PAIRWISE(Fms)
#undef FACETWISE_PAIRWISE

template <class D>
HWY_INLINE Mask<D> NoLanes(D d) {
  return Set(d, 0.0f) > Set(d, 0.0f);
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
