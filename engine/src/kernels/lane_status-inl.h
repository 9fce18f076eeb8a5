// SPDX-License-Identifier: Apache-2.0
// The lane policy (model.h): which lanes are ordinary, smooth or invalid, and what those compute and return that are
// not.

#if defined(FACETWISE_LANE_STATUS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_LANE_STATUS_INL_H_
#undef FACETWISE_LANE_STATUS_INL_H_
#else
#define FACETWISE_LANE_STATUS_INL_H_
#endif

#include <bit>

#include "src/kernels/surface-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// Which lanes are ordinary, smooth or invalid (LaneStatus): model.h's classes. NaN fails every comparison.
template <class D>
struct LaneClasses {
  Mask<D> valid, smooth;  // smooth lanes are valid
  HWY_INLINE LaneClasses() {}
};

template <class D, class V = Vec<D>>
HWY_INLINE Mask<D> UnitLength(D d, V x, V y, V z) {
  return Abs(Fma(z, z, Fma(x, x, y * y)) - Set(d, 1.0f)) <= Set(d, kLengthTolerance);
}

template <class D, class V = Vec<D>>
HWY_INLINE Mask<D> InUnitInterval(D d, V u) {
  return And(u >= Zero(d), u < Set(d, 1.0f));
}

template <class D, class V = Vec<D>>
HWY_INLINE LaneClasses<D> Classify(D d, Mask<D> inputs_valid, V ax, V ay, float largest_alpha) {
  // Min and Max of different instruction sets treat NaN differently, comparisons do not.
  const V zero = Zero(d), largest = Set(d, largest_alpha), smallest = Set(d, kSmallestAlpha);
  const auto alpha_valid = And(And(ax >= zero, ay >= zero), And(ax <= largest, ay <= largest));
  LaneClasses<D> classes;
  classes.valid = And(inputs_valid, alpha_valid);
  classes.smooth = And(classes.valid, Or(ax < smallest, ay < smallest));
  return classes;
}

// A quick test on the inputs' bits: true only if every lane is ordinary. Bits of non-negative floats are ordered
// as the floats are; negative ones and NaN are above them all. A lane with u = -0 fails it, and is ordinary.
template <class D>
class QuickTest {
 public:
  using V = Vec<D>;
  // The first direction, whose tolerance's bits are moved up to where those of 1 are.
  HWY_INLINE QuickTest(D d, V x, V y, V z) : d_(d), worst_(UnitVectorError(d, x, y, z)) {}
  HWY_INLINE void UnitVector(V x, V y, V z) { worst_ = Max(worst_, UnitVectorError(d_, x, y, z)); }
  HWY_INLINE void Uniform(V u) { worst_ = Max(worst_, BitCast(DU(), u)); }
  HWY_INLINE bool AllOrdinary(V ax, V ay, float largest_alpha) const {
    const DU du;
    const auto smallest = Set(du, Bits(kSmallestAlpha));
    const auto alpha = Max(BitCast(du, ax) - smallest, BitCast(du, ay) - smallest);
    const auto alpha_limit = Set(du, Bits(largest_alpha) - Bits(kSmallestAlpha));
    const auto limit = Set(du, kBitsBelowOne);
    return AllTrue(du, And(Min(alpha, alpha_limit) == alpha, Min(worst_, limit) == worst_));
  }

 private:
  using DU = Rebind<uint32_t, D>;
  static constexpr uint32_t Bits(float value) { return std::bit_cast<uint32_t>(value); }
  static constexpr uint32_t kBitsBelowOne = 0x3F7FFFFF;  // of kLargestBelowOne
  static HWY_INLINE Vec<DU> UnitVectorError(D d, V x, V y, V z) {
    const V error = Abs(Fma(z, z, Fma(x, x, y * y)) - Set(d, 1.0f));
    return BitCast(DU(), error) + Set(DU(), kBitsBelowOne - Bits(kLengthTolerance));
  }
  D d_;
  Vec<DU> worst_;
};

// The lanes that are neither accepted nor occluded, and what the outputs become there. With kFast there are none.
template <class D, bool kFast>
class Exceptions {
 public:
  using V = Vec<D>;
  HWY_INLINE Exceptions(D d, const LaneClasses<D>& classes) : d_(d), classes_(classes) {}

  // What a lane computes with: its own input, or a harmless one.
  HWY_INLINE V Computable(V input, float otherwise) const {
    if constexpr (kFast) return input;
    return Select(AndNot(classes_.smooth, classes_.valid), input, Set(d_, otherwise));
  }
  HWY_INLINE V Output(V value, V when_smooth) const {
    if constexpr (kFast) return value;
    return IfThenElseZero(classes_.valid, Select(classes_.smooth, when_smooth, value));
  }

  // Counts the lanes and stores their status. Of a last, partial vector only the first lanes are real.
  HWY_INLINE void Finish(const Tile& tile, std::size_t lane, Mask<D> occluded, Statistics& statistics) const {
    const DI di;
    const Rebind<uint8_t, D> db;
    if constexpr (kFast) {
      statistics.occluded += CountTrue(d_, occluded);
      if (tile.status != nullptr) {
        const auto status = IfThenElseZero(RebindMask(di, occluded), Code(LaneStatus::occluded));
        StoreU(DemoteTo(db, status), db, tile.status + lane);
      }
      return;
    }
    occluded = And(occluded, AndNot(classes_.smooth, classes_.valid));
    const auto real = FirstN(d_, HWY_MIN(Lanes(d_), tile.lanes - lane));
    statistics.occluded += CountTrue(d_, And(occluded, real));
    statistics.smooth += CountTrue(d_, And(classes_.smooth, real));
    statistics.invalid += CountTrue(d_, AndNot(classes_.valid, real));
    if (tile.status != nullptr) {
      auto status = IfThenElseZero(RebindMask(di, occluded), Code(LaneStatus::occluded));
      status = Select(RebindMask(di, classes_.smooth), Code(LaneStatus::smooth), status);
      status = Select(RebindMask(di, classes_.valid), status, Code(LaneStatus::invalid));
      StoreU(DemoteTo(db, status), db, tile.status + lane);
    }
  }

 private:
  using DI = Rebind<int32_t, D>;
  static HWY_INLINE Vec<DI> Code(LaneStatus status) { return Set(DI(), static_cast<int32_t>(status)); }
  D d_;
  LaneClasses<D> classes_;
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
