// SPDX-License-Identifier: Apache-2.0
// What operations read: loaded, tested and turned into the principal frame.

#if defined(FACETWISE_INPUTS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_INPUTS_INL_H_
#undef FACETWISE_INPUTS_INL_H_
#else
#define FACETWISE_INPUTS_INL_H_
#endif

#include "src/kernels/fresnel-inl.h"
#include "src/kernels/lane_status-inl.h"
#include "src/kernels/surface-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// What every operation reads of a surface S. Directions are in its principal frame.
template <class D, class S>
struct Inputs {
  using V = Vec<D>;
  static constexpr float kLargestRoughness = S::Distribution::kLargestRoughness;
  V x, y, z, ax, ay;
  V mean_x, mean_y;  // if the surface is affine
  Mask<D> affine_valid;
  Rotation<D> rotation;

  HWY_INLINE Inputs(D d, const Tile& tile, std::size_t lane)
      : x(LoadU(d, tile.in[kIx] + lane)),
        y(LoadU(d, tile.in[kIy] + lane)),
        z(LoadU(d, tile.in[kIz] + lane)),
        ax(LoadU(d, tile.in[kAlphaX] + lane)),
        ay(LoadU(d, tile.in[kAlphaY] + lane)) {
    if constexpr (S::kAffine) {
      mean_x = LoadU(d, tile.in[kMeanX] + lane);
      mean_y = LoadU(d, tile.in[kMeanY] + lane);
      const V correlation = LoadU(d, tile.in[kCorrelation] + lane), largest = Set(d, kLargestMeanSlope);
      affine_valid = And(And(Abs(mean_x) <= largest, Abs(mean_y) <= largest), Abs(correlation) < Set(d, 1.0f));
      rotation = PrincipalAxes(d, correlation, ax, ay);
      rotation.In(x, y);
      rotation.In(mean_x, mean_y);
      if constexpr (S::Distribution::kOwnMean) {
        mean_x = Fma(ax, Set(d, tile.table->mean_x), mean_x);
        mean_y = Fma(ay, Set(d, tile.table->mean_y), mean_y);
      }
    }
  }

  HWY_INLINE bool AllOrdinary(D d, const Tile& tile, std::size_t lane, const QuickTest<D>& test) const {
    if (!test.AllOrdinary(ax, ay, kLargestRoughness)) return false;
    if constexpr (S::kAffine)
      if (!AllTrue(d, affine_valid)) return false;
    return tile.interface == Interface::conductor || AllTrue(d, ValidInterface(d, tile, lane));
  }

  HWY_INLINE LaneClasses<D> Classified(D d, const Tile& tile, std::size_t lane, Mask<D> valid) const {
    valid = And(valid, UnitLength(d, x, y, z));
    if constexpr (S::kAffine) valid = And(valid, affine_valid);
    if (tile.interface != Interface::conductor) valid = And(valid, ValidInterface(d, tile, lane));
    return Classify(d, valid, ax, ay, kLargestRoughness);
  }

  template <bool kReadsArea = true, bool kFast>
  HWY_INLINE Incident<D, S> Prepared(D d, const Tile& tile, const Exceptions<D, kFast>& exceptions) const {
    V means[2] = {};
    if constexpr (S::kAffine) {
      means[0] = exceptions.Computable(mean_x, 0.0f);
      means[1] = exceptions.Computable(mean_y, 0.0f);
    }
    return Prepare<S, kReadsArea>(d, tile, exceptions.Computable(x, 0.0f), exceptions.Computable(y, 0.0f),
                                  exceptions.Computable(z, 1.0f), exceptions.Computable(ax, 1.0f),
                                  exceptions.Computable(ay, 1.0f), means[0], means[1]);
  }

  // A direction's x and y as loaded, and as stored.
  HWY_INLINE void In(V& x_, V& y_) const {
    if constexpr (S::kAffine) rotation.In(x_, y_);
  }
  HWY_INLINE void Out(V& x_, V& y_) const {
    if constexpr (S::kAffine) rotation.Out(x_, y_);
  }
};

// What operations read that know no other direction and no random numbers.
template <class D, class S>
struct IncidentInputs : Inputs<D, S> {
  HWY_INLINE IncidentInputs(D d, const Tile& tile, std::size_t lane) : Inputs<D, S>(d, tile, lane) {}
  HWY_INLINE bool AllOrdinary(D d, const Tile& tile, std::size_t lane) const {
    return Inputs<D, S>::AllOrdinary(d, tile, lane, QuickTest<D>(d, this->x, this->y, this->z));
  }
  HWY_INLINE LaneClasses<D> Classified(D d, const Tile& tile, std::size_t lane) const {
    return Inputs<D, S>::Classified(d, tile, lane, Not(NoLanes(d)));
  }
};

// What samples read besides.
template <class D, class S, bool kUsesU3>
struct SampleInputs : Inputs<D, S> {
  using V = Vec<D>;
  V u1, u2, u3;

  HWY_INLINE SampleInputs(D d, const Tile& tile, std::size_t lane)
      : Inputs<D, S>(d, tile, lane), u1(LoadU(d, tile.in[kU1] + lane)), u2(LoadU(d, tile.in[kU2] + lane)), u3(u2) {
    if constexpr (kUsesU3) u3 = LoadU(d, tile.in[kU3] + lane);
  }
  HWY_INLINE bool AllOrdinary(D d, const Tile& tile, std::size_t lane) const {
    QuickTest<D> test(d, this->x, this->y, this->z);
    test.Uniform(u1);
    test.Uniform(u2);
    if constexpr (kUsesU3) test.Uniform(u3);
    return Inputs<D, S>::AllOrdinary(d, tile, lane, test);
  }
  HWY_INLINE LaneClasses<D> Classified(D d, const Tile& tile, std::size_t lane) const {
    const auto valid = And(And(InUnitInterval(d, u1), InUnitInterval(d, u2)), InUnitInterval(d, u3));
    return Inputs<D, S>::Classified(d, tile, lane, valid);
  }
};

// What queries read besides.
template <class D, class S>
struct QueryInputs : Inputs<D, S> {
  using V = Vec<D>;
  V ox, oy, oz;

  HWY_INLINE QueryInputs(D d, const Tile& tile, std::size_t lane)
      : Inputs<D, S>(d, tile, lane),
        ox(LoadU(d, tile.in[kOx] + lane)),
        oy(LoadU(d, tile.in[kOy] + lane)),
        oz(LoadU(d, tile.in[kOz] + lane)) {
    this->In(ox, oy);
  }
  HWY_INLINE bool AllOrdinary(D d, const Tile& tile, std::size_t lane) const {
    QuickTest<D> test(d, this->x, this->y, this->z);
    test.UnitVector(ox, oy, oz);
    return Inputs<D, S>::AllOrdinary(d, tile, lane, test);
  }
  HWY_INLINE LaneClasses<D> Classified(D d, const Tile& tile, std::size_t lane) const {
    return Inputs<D, S>::Classified(d, tile, lane, UnitLength(d, ox, oy, oz));
  }
};

// The lanes of an operation's inputs that are not ordinary; `refine` changes the classes.
template <bool kFast, class D, class In, class Refine>
HWY_INLINE Exceptions<D, kFast> ExceptionsOf(D d, const Tile& tile, std::size_t lane, const In& in,
                                             const Refine& refine) {
  LaneClasses<D> classes;
  if constexpr (!kFast) {
    classes = in.Classified(d, tile, lane);
    refine(classes);
  }
  return Exceptions<D, kFast>(d, classes);
}
template <bool kFast, class D, class In>
HWY_INLINE Exceptions<D, kFast> ExceptionsOf(D d, const Tile& tile, std::size_t lane, const In& in) {
  return ExceptionsOf<kFast>(d, tile, lane, in, [](LaneClasses<D>&) {});
}

// Turned about n by half a turn: what retro-reflection does to a reflection. f(i', o) with i' = (-i_x, -i_y, i_z) is
// f(i, o') as long as the normals are distributed symmetrically.
template <class D, class V = Vec<D>>
HWY_INLINE void TurnIfRetro(D d, const Tile& tile, V& x, V& y) {
  if (!tile.retro) return;
  x = Xor(x, SignBit(d));
  y = Xor(y, SignBit(d));
}

// Where columns share a set of the first-level cache, it loses the lines that the processor fetches ahead by itself.
// These are asked for each at its own distance (stage.h), so that they come one after the other.
HWY_INLINE void FetchAhead(const Tile& tile, std::size_t lane, std::size_t lanes) {
  for (std::size_t line = (lane + kLine - 1) / kLine * kLine; line < lane + lanes; line += kLine)
    for (std::size_t k = 0; k < tile.ahead_count; ++k) __builtin_prefetch(tile.ahead[k] + line);
}

// Most calls sample a conductor's reflections in the caches. A loop that knows it is 2 to 11 % quicker.
HWY_INLINE void MakePlain(Tile& tile) {
  tile.normals_alone = tile.retro = false;
  tile.interface = Interface::conductor;
  tile.streamed = 0;
}
HWY_INLINE bool IsPlain(const Tile& tile) {
  return !tile.normals_alone && !tile.retro && tile.interface == Interface::conductor && tile.streamed == 0;
}

template <class D, class Op>
HWY_NOINLINE void RunWithExceptions(const Tile& tile, std::size_t lane, Statistics& statistics) {
  const D d{};
  Op(d, tile, lane).template Run<false>(d, tile, lane, statistics);
}

// An operation is a struct template over a tag and others that loads its inputs and has Run<kFast>(). Where all lanes are
// ordinary, nearly always, the fast way is taken, which knows no exceptions; an ordinary lane's results are the same both
// ways. The other way goes vector by vector, even if the fast one takes several (W): then one odd lane costs less, and so
// does the compiler. Kernels that fetch ahead are compiled apart: the mere test for it would cost the others 2 to 4 %.
template <class W, class D, bool kFetchesAhead, bool kPlain, template <class, class...> class Op, class... Others>
HWY_INLINE void LoopOverVectors(const Tile& given, Statistics& statistics) {
  const W w{};
  // Copies that nobody else sees: stores could otherwise be to them.
  Tile tile = given;
  if constexpr (kPlain) MakePlain(tile);
  Statistics counted;
  for (std::size_t lane = 0; lane < tile.lanes; lane += Lanes(w)) {
    if constexpr (kFetchesAhead) FetchAhead(tile, lane, Lanes(w));
    // Not for the portable fallback: it is slow anyhow, and compiles in half the time.
    if constexpr (HWY_TARGET != HWY_SCALAR) {
      const Op<W, Others...> operation(w, tile, lane);
      if (HWY_LIKELY(operation.AllOrdinary(w, tile, lane) && lane + Lanes(w) <= tile.lanes)) {
        operation.template Run<true>(w, tile, lane, counted);
        continue;
      }
    }
    const std::size_t end = HWY_MIN(lane + Lanes(w), tile.lanes);
    for (std::size_t one = lane; one < end; one += Lanes(D()))
      RunWithExceptions<D, Op<D, Others...>>(given, one, statistics);
  }
  statistics += counted;
}
template <class W, class D, bool kFetchesAhead, template <class, class...> class Op, class... Others>
void ForEachVector(const Tile& tile, Statistics& statistics) {
  LoopOverVectors<W, D, kFetchesAhead, false, Op, Others...>(tile, statistics);
}

template <class W, class D, template <class, class...> class Op, class... Others>
void ForEachVectorOfSamples(const Tile& tile, Statistics& statistics) {
  if (IsPlain(tile)) {
    LoopOverVectors<W, D, false, true, Op, Others...>(tile, statistics);
  } else {
    LoopOverVectors<W, D, false, false, Op, Others...>(tile, statistics);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
