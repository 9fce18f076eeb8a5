// The operations, written once over samplers and vector widths.

#if defined(FACETWISE_OPERATIONS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_OPERATIONS_INL_H_
#undef FACETWISE_OPERATIONS_INL_H_
#else
#define FACETWISE_OPERATIONS_INL_H_
#endif

#include <bit>

#include "src/kernels/fresnel-inl.h"
#include "src/kernels/samplers-inl.h"
#include "src/tile.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// Stores a vector of an output if it is wanted.
template <class D, class V = Vec<D>>
HWY_INLINE void Store(D d, const Tile& tile, OutputIndex output, std::size_t lane, V value) {
  if (!(tile.wanted & bit(output))) return;
  if constexpr (kStreams<D>) {
    if (tile.streamed & bit(output)) {
      Stream(value, d, tile.out[output] + lane);
      return;
    }
  }
  StoreU(value, d, tile.out[output] + lane);
}

// Which lanes are ordinary, smooth or invalid (LaneStatus): model.h's policy. NaN fails every comparison.
template <class D>
struct Policy {
  Mask<D> valid, smooth;  // smooth lanes are valid
  HWY_INLINE Policy() {}
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
HWY_INLINE Policy<D> Classify(D d, Mask<D> inputs_valid, V ax, V ay, float largest_alpha) {
  // Min and Max of different instruction sets treat NaN differently, comparisons do not.
  const V zero = Zero(d), largest = Set(d, largest_alpha), smallest = Set(d, kSmallestAlpha);
  const auto alpha_valid = And(And(ax > zero, ay > zero), And(ax <= largest, ay <= largest));
  Policy<D> policy;
  policy.valid = And(inputs_valid, alpha_valid);
  policy.smooth = And(policy.valid, Or(ax < smallest, ay < smallest));
  return policy;
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
    const auto limit = Set(du, kLargestBelowOne);
    return AllTrue(du, And(Min(alpha, alpha_limit) == alpha, Min(worst_, limit) == worst_));
  }

 private:
  using DU = Rebind<uint32_t, D>;
  static constexpr uint32_t Bits(float value) { return std::bit_cast<uint32_t>(value); }
  static constexpr uint32_t kLargestBelowOne = 0x3F7FFFFF;
  static HWY_INLINE Vec<DU> UnitVectorError(D d, V x, V y, V z) {
    const V error = Abs(Fma(z, z, Fma(x, x, y * y)) - Set(d, 1.0f));
    return BitCast(DU(), error) + Set(DU(), kLargestBelowOne - Bits(kLengthTolerance));
  }
  D d_;
  Vec<DU> worst_;
};

// The lanes that are neither accepted nor occluded, and what the outputs become there. With kFast there are none.
template <class D, bool kFast>
class Exceptions {
 public:
  using V = Vec<D>;
  HWY_INLINE Exceptions(D d, const Policy<D>& policy) : d_(d), policy_(policy) {}

  // What a lane computes with: its own input, or a harmless one.
  HWY_INLINE V Harmless(V input, float otherwise) const {
    if constexpr (kFast) return input;
    return Select(AndNot(policy_.smooth, policy_.valid), input, Set(d_, otherwise));
  }
  HWY_INLINE V Output(V value, V when_smooth) const {
    if constexpr (kFast) return value;
    return IfThenElseZero(policy_.valid, Select(policy_.smooth, when_smooth, value));
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
    occluded = And(occluded, AndNot(policy_.smooth, policy_.valid));
    const auto real = FirstN(d_, HWY_MIN(Lanes(d_), tile.lanes - lane));
    statistics.occluded += CountTrue(d_, And(occluded, real));
    statistics.smooth += CountTrue(d_, And(policy_.smooth, real));
    statistics.invalid += CountTrue(d_, AndNot(policy_.valid, real));
    if (tile.status != nullptr) {
      auto status = IfThenElseZero(RebindMask(di, occluded), Code(LaneStatus::occluded));
      status = Select(RebindMask(di, policy_.smooth), Code(LaneStatus::smooth), status);
      status = Select(RebindMask(di, policy_.valid), status, Code(LaneStatus::invalid));
      StoreU(DemoteTo(db, status), db, tile.status + lane);
    }
  }

 private:
  using DI = Rebind<int32_t, D>;
  static HWY_INLINE Vec<DI> Code(LaneStatus status) { return Set(DI(), static_cast<int32_t>(status)); }
  D d_;
  Policy<D> policy_;
};

// What every operation reads of a surface S. Directions are in its principal frame.
template <class D, class S>
struct Inputs {
  using V = Vec<D>;
  static constexpr float kLargestRoughness = S::Distribution::kLargestRoughness;
  V x, y, z, ax, ay;
  V mean_x, mean_y;  // if the surface is affine
  Mask<D> moments_valid;
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
      moments_valid =
          And(And(Abs(mean_x) <= largest, Abs(mean_y) <= largest), Abs(correlation) < Set(d, 1.0f));
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
      if (!AllTrue(d, moments_valid)) return false;
    return tile.interface == Interface::conductor || AllTrue(d, ValidInterface(d, tile, lane));
  }

  HWY_INLINE Policy<D> Classified(D d, const Tile& tile, std::size_t lane, Mask<D> valid) const {
    valid = And(valid, UnitLength(d, x, y, z));
    if constexpr (S::kAffine) valid = And(valid, moments_valid);
    if (tile.interface != Interface::conductor) valid = And(valid, ValidInterface(d, tile, lane));
    return Classify(d, valid, ax, ay, kLargestRoughness);
  }

  template <bool kFast>
  HWY_INLINE Incident<D, S> Prepared(D d, const Tile& tile, const Exceptions<D, kFast>& exceptions) const {
    V means[2] = {};
    if constexpr (S::kAffine) {
      means[0] = exceptions.Harmless(mean_x, 0.0f);
      means[1] = exceptions.Harmless(mean_y, 0.0f);
    }
    return Prepare<S>(d, tile, exceptions.Harmless(x, 0.0f), exceptions.Harmless(y, 0.0f),
                      exceptions.Harmless(z, 1.0f), exceptions.Harmless(ax, 1.0f), exceptions.Harmless(ay, 1.0f),
                      means[0], means[1]);
  }

  // A direction's x and y as loaded, and as stored.
  HWY_INLINE void In(V& x_, V& y_) const {
    if constexpr (S::kAffine) rotation.In(x_, y_);
  }
  HWY_INLINE void Out(V& x_, V& y_) const {
    if constexpr (S::kAffine) rotation.Out(x_, y_);
  }
};

// Turned about n by half a turn: what retro-reflection does to a reflection. f(i', o) with i' = (-i_x, -i_y, i_z) is
// f(i, o') as long as the normals are distributed symmetrically.
template <class D, class V = Vec<D>>
HWY_INLINE void TurnIfRetro(D d, const Tile& tile, V& x, V& y) {
  if (!tile.retro) return;
  x = Xor(x, SignBit(d));
  y = Xor(y, SignBit(d));
}

// An operation is a struct that loads its inputs and has Run<kFast>(). Whole vectors of ordinary lanes, nearly
// all, take the fast way, which knows no exceptions; an ordinary lane's results are the same both ways.
template <class D, class Operation>
void ForEachVector(const Tile& given, Statistics& statistics) {
  const D d{};
  const Tile tile = given;
  Statistics counted;
  for (std::size_t lane = 0; lane < tile.lanes; lane += Lanes(d)) {
    const Operation operation(d, tile, lane);
    if (HWY_LIKELY(operation.AllOrdinary(d, tile, lane) && lane + Lanes(d) <= tile.lanes)) {
      operation.template Run<true>(d, tile, lane, counted);
    } else {
      operation.template Run<false>(d, tile, lane, counted);
    }
  }
  statistics += counted;
}

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
  HWY_INLINE Policy<D> Classified(D d, const Tile& tile, std::size_t lane) const {
    const auto valid = And(And(InUnitInterval(d, u1), InUnitInterval(d, u2)), InUnitInterval(d, u3));
    return Inputs<D, S>::Classified(d, tile, lane, valid);
  }
};

// The smallest o_z that samplers without occluded reflections return for i_z > 0: rounding puts a few samples in
// a million on the wrong side of the rim they were drawn inside of, and these are raised to it.
inline constexpr float kRim = 0x1p-30f;

// sample_reflection and sample_normal.
template <class D, class S, class Sampler>
struct Sample {
  using V = Vec<D>;
  SampleInputs<D, S, Sampler::kUsesU3> in;

  HWY_INLINE Sample(D d, const Tile& tile, std::size_t lane) : in(d, tile, lane) {}
  HWY_INLINE bool AllOrdinary(D d, const Tile& tile, std::size_t lane) const { return in.AllOrdinary(d, tile, lane); }

  template <bool kFast>
  HWY_INLINE void Run(D d, const Tile& tile, std::size_t lane, Statistics& statistics) const {
    const V zero = Zero(d), one = Set(d, 1.0f);
    Policy<D> policy;
    if constexpr (!kFast) policy = in.Classified(d, tile, lane);
    const Exceptions<D, kFast> exceptions(d, policy);
    const InterfaceInputs<D> interface(d, tile, lane);
    const Incident<D, S> i = in.Prepared(d, tile, exceptions);

    Drawn<D> drawn;
    V u3 = exceptions.Harmless(in.u3, 0.0f);
    Sampler::Draw(d, i, exceptions.Harmless(in.u1, 0.0f), exceptions.Harmless(in.u2, 0.0f), u3, drawn);

    // o = 2 (i.M) / (M.M) M - i
    V rho = (drawn.im + drawn.im) / drawn.mm;
    if constexpr (Sampler::kUnit) {
    } else if constexpr (Sampler::kExact) {
      if (!i.all_front) rho = Select(i.front, rho, Max(rho, Set(d, kSmallestRho<S>)));
    } else {
      rho = Max(rho, Set(d, kSmallestRho<S>));
    }
    V ox = Fms(rho, drawn.mx, i.x), oy = Fms(rho, drawn.my, i.y);
    V oz = Fms(rho, drawn.mz, i.z);
    if constexpr (Sampler::kExact) oz = Max(oz, Set(d, kRim));

    auto occluded = tile.normals_alone ? NoLanes(d) : oz <= zero;
    if constexpr (!Sampler::kVisible) occluded = Or(occluded, drawn.im <= Set(d, kSmallestIm));
    if (!i.all_front) occluded = Or(occluded, S::Masking::Blind(d, i));
    const auto accepted = Not(occluded);

    // p(o) = D(m) / (4 N)
    V pdf = zero;
    if (tile.wanted & kWantsPdf) {
      V numerator, denominator;
      Sampler::Density(d, i, drawn, rho, numerator, denominator);
      denominator = Set(d, 2.0f * kPi) * (i.ax * i.ay) * drawn.two_n * denominator;
      pdf = IfThenElseZero(accepted, Min(numerator / denominator, Set(d, 3e38f)));
    }

    const bool fresnel = tile.interface != Interface::conductor && (tile.wanted & kWantsWeight);
    V im = drawn.im;
    if (fresnel || (tile.wanted & kWantsNormal) || tile.normals_alone) {
      const V inverse_length = one / Sqrt(drawn.mm);
      if constexpr (Sampler::kVisible) im = Max(im, Set(d, kSmallestIm));
      im = im * inverse_length;
      if (tile.normals_alone) pdf = pdf * (im * Set(d, 4.0f));  // p(m) = p(o) 4 i.m
      if (tile.wanted & kWantsNormal) {
        V mx = drawn.mx * inverse_length, my = drawn.my * inverse_length;
        TurnIfRetro(d, tile, mx, my);
        in.Out(mx, my);
        Store(d, tile, kOutMx, lane, exceptions.Output(mx, zero));
        Store(d, tile, kOutMy, lane, exceptions.Output(my, zero));
        Store(d, tile, kOutMz, lane, exceptions.Output(drawn.mz * inverse_length, one));
        Store(d, tile, kOutIm, lane, exceptions.Output(im, in.z));
      }
    }
    Store(d, tile, kOutPdf, lane, exceptions.Output(pdf, zero));

    if (!tile.normals_alone) {
      if (tile.wanted & kWantsWeight) {
        V weight = S::Masking::template Weight<Sampler>(d, i, drawn, ox, oy, oz, tile.uncorrelated);
        V mirror = one;
        if (fresnel) {
          weight = weight * interface.Reflectance(d, tile, im);
          mirror = interface.Reflectance(d, tile, in.z);
        }
        mirror = IfThenElseZero(in.z > zero, mirror);
        Store(d, tile, kOutWeight, lane, exceptions.Output(IfThenElseZero(accepted, weight), mirror));
      }
      V mirror_x = Neg(in.x), mirror_y = Neg(in.y);
      TurnIfRetro(d, tile, ox, oy);
      TurnIfRetro(d, tile, mirror_x, mirror_y);
      in.Out(ox, oy);
      in.Out(mirror_x, mirror_y);
      Store(d, tile, kOutOx, lane, exceptions.Output(ox, mirror_x));
      Store(d, tile, kOutOy, lane, exceptions.Output(oy, mirror_y));
      Store(d, tile, kOutOz, lane, exceptions.Output(oz, in.z));
    }
    exceptions.Finish(tile, lane, occluded, statistics);
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
  HWY_INLINE Policy<D> Classified(D d, const Tile& tile, std::size_t lane) const {
    return Inputs<D, S>::Classified(d, tile, lane, UnitLength(d, ox, oy, oz));
  }
};

// pdf_reflection, evaluate_reflection and evaluate_and_pdf.
template <class D, class S, class Sampler>
struct Query {
  using V = Vec<D>;
  using Distribution = typename S::Distribution;
  QueryInputs<D, S> in;

  HWY_INLINE Query(D d, const Tile& tile, std::size_t lane) : in(d, tile, lane) {}
  HWY_INLINE bool AllOrdinary(D d, const Tile& tile, std::size_t lane) const { return in.AllOrdinary(d, tile, lane); }

  template <bool kFast>
  HWY_INLINE void Run(D d, const Tile& tile, std::size_t lane, Statistics& statistics) const {
    const V zero = Zero(d), one = Set(d, 1.0f);
    Policy<D> policy;
    if constexpr (!kFast) policy = in.Classified(d, tile, lane);
    const Exceptions<D, kFast> exceptions(d, policy);
    const InterfaceInputs<D> interface(d, tile, lane);
    const Incident<D, S> i = in.Prepared(d, tile, exceptions);
    V x = exceptions.Harmless(in.ox, 0.0f), y = exceptions.Harmless(in.oy, 0.0f);
    const V z = exceptions.Harmless(in.oz, 1.0f);
    TurnIfRetro(d, tile, x, y);

    const V hx = i.x + x, hy = i.y + y, hz = i.z + z;
    const V h2 = Dot(hx, hy, hz, hx, hy, hz);
    // o = -i to float's last bits has no half vector.
    const auto above = z > zero;
    auto reached = And(And(above, hz > zero), h2 > Set(d, 0x1p-40f));
    if (!i.all_front) reached = AndNot(S::Masking::Blind(d, i), reached);
    // Lanes that no microfacet reaches compute with the half vector (0, 0, 1).
    const V mx = IfThenElseZero(reached, hx), my = IfThenElseZero(reached, hy), mz = Select(reached, hz, one);
    const V m2 = Select(reached, h2, one);
    // i.h = |h|^2 / 2: the sum i.h cancels where o is nearly -i, this does not.
    const V im = m2 * Set(d, 0.5f);
    const V density = IfThenElseZero(reached, Distribution::Density(d, i, mx, my, mz, m2, i.shift));
    const V denominator = Set(d, 2.0f * kPi) * (i.ax * i.ay);
    const V largest = Set(d, 3e38f);  // a density can be beyond the floats straight below a smooth surface

    if (tile.wanted & kWantsPdf) {
      V numerator = density, two_n;
      if constexpr (HasOwnShift<Sampler>) {
        V shift;
        two_n = Sampler::TwoN(d, i, mx, my, mz, im, shift);
        numerator = IfThenElseZero(reached, Distribution::Density(d, i, mx, my, mz, m2, shift));
      } else {
        two_n = Sampler::TwoN(d, i, mx, my, mz, im);
      }
      if constexpr (Distribution::kShifts && !Sampler::kShifted)
        if (!i.all_front) numerator = IfThenElseZero(reached, Distribution::Density(d, i, mx, my, mz, m2, zero));
      const V pdf = Min(numerator / (denominator * two_n), largest);
      Store(d, tile, kOutPdf, lane, exceptions.Output(pdf, zero));
    }
    if (tile.wanted & kWantsValue) {
      V two_n, w;
      S::Masking::Value(d, i, mz, im, x, y, z, tile.uncorrelated, two_n, w);
      V value = Min(density / (denominator * two_n), largest) * IfThenElseZero(above, w);
      if constexpr (S::Masking::kUnboundedW) value = Min(value, largest);
      if (tile.interface != Interface::conductor) value = value * interface.Reflectance(d, tile, Sqrt(m2) * Set(d, 0.5f));
      Store(d, tile, kOutValue, lane, exceptions.Output(value, zero));
    }
    exceptions.Finish(tile, lane, Or(Not(above), S::Masking::Blind(d, i)), statistics);
  }
};

template <class D, class S>
struct MaskingOf {
  using V = Vec<D>;
  Inputs<D, S> in;

  HWY_INLINE MaskingOf(D d, const Tile& tile, std::size_t lane) : in(d, tile, lane) {}
  HWY_INLINE bool AllOrdinary(D d, const Tile& tile, std::size_t lane) const {
    return in.AllOrdinary(d, tile, lane, QuickTest<D>(d, in.x, in.y, in.z));
  }

  template <bool kFast>
  HWY_INLINE void Run(D d, const Tile& tile, std::size_t lane, Statistics& statistics) const {
    const V zero = Zero(d), one = Set(d, 1.0f);
    Policy<D> policy;
    if constexpr (!kFast) policy = in.Classified(d, tile, lane, Not(NoLanes(d)));
    const Exceptions<D, kFast> exceptions(d, policy);
    const Incident<D, S> i = in.Prepared(d, tile, exceptions);
    // A mirror masks nothing in front of it, and shows nothing to what is behind.
    const V mirror = IfThenElseZero(in.z > zero, one);
    V masking, area;
    S::Masking::MaskingAndArea(d, i, masking, area);
    Store(d, tile, kOutMasking, lane, exceptions.Output(masking, mirror));
    Store(d, tile, kOutArea, lane, exceptions.Output(area, mirror * in.z));
    if (tile.wanted & kWantsShare)
      Store(d, tile, kOutShare, lane, exceptions.Output(S::Masking::Share(d, i), one));
    exceptions.Finish(tile, lane, NoLanes(d), statistics);
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
