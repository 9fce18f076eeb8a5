// The operations, written once over samplers and vector widths.

#if defined(FACETWISE_OPERATIONS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_OPERATIONS_INL_H_
#undef FACETWISE_OPERATIONS_INL_H_
#else
#define FACETWISE_OPERATIONS_INL_H_
#endif

#include <bit>

#include "src/kernels/exact-inl.h"
#include "src/tile.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

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
HWY_INLINE Policy<D> Classify(D d, Mask<D> inputs_valid, V ax, V ay) {
  // Min and Max of different instruction sets treat NaN differently, comparisons do not.
  const V zero = Zero(d), largest = Set(d, kLargestAlpha), smallest = Set(d, kSmallestAlpha);
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
  HWY_INLINE bool AllOrdinary(V ax, V ay) const {
    const DU du;
    const auto smallest = Set(du, Bits(kSmallestAlpha));
    const auto alpha = Max(BitCast(du, ax) - smallest, BitCast(du, ay) - smallest);
    const auto alpha_limit = Set(du, Bits(kLargestAlpha) - Bits(kSmallestAlpha));
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
      if (tile.wanted & kWantsStatus) {
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
    if (tile.wanted & kWantsStatus) {
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

// What every operation reads.
template <class D>
struct Inputs {
  using V = Vec<D>;
  V x, y, z, ax, ay;

  HWY_INLINE Inputs(D d, const Tile& tile, std::size_t lane)
      : x(LoadU(d, tile.in[kIx] + lane)),
        y(LoadU(d, tile.in[kIy] + lane)),
        z(LoadU(d, tile.in[kIz] + lane)),
        ax(LoadU(d, tile.in[kAlphaX] + lane)),
        ay(LoadU(d, tile.in[kAlphaY] + lane)) {}

  template <bool kFast>
  HWY_INLINE Incident<D> Prepared(D d, const Exceptions<D, kFast>& exceptions) const {
    return Prepare(d, exceptions.Harmless(x, 0.0f), exceptions.Harmless(y, 0.0f), exceptions.Harmless(z, 1.0f),
                   exceptions.Harmless(ax, 1.0f), exceptions.Harmless(ay, 1.0f));
  }
};

// An operation is a struct that loads its inputs and has Run<kFast>(). Whole vectors of ordinary lanes, nearly
// all, take the fast way, which knows no exceptions; an ordinary lane's results are the same both ways.
template <class D, class Operation>
void ForEachVector(const Tile& given, Statistics& statistics) {
  const D d{};
  const Tile tile = given;
  Statistics counted;
  for (std::size_t lane = 0; lane < tile.lanes; lane += Lanes(d)) {
    const Operation operation(d, tile, lane);
    if (HWY_LIKELY(operation.AllOrdinary(d) && lane + Lanes(d) <= tile.lanes)) {
      operation.template Run<true>(d, tile, lane, counted);
    } else {
      operation.template Run<false>(d, tile, lane, counted);
    }
  }
  statistics += counted;
}

// sample_reflection and, with kNormal, sample_normal.
template <class D, class Sampler, bool kNormal>
struct Sample {
  using V = Vec<D>;
  Inputs<D> in;
  V u1, u2, u3;

  HWY_INLINE Sample(D d, const Tile& tile, std::size_t lane)
      : in(d, tile, lane), u1(LoadU(d, tile.in[kU1] + lane)), u2(LoadU(d, tile.in[kU2] + lane)), u3(u2) {
    if constexpr (Sampler::kUsesU3) u3 = LoadU(d, tile.in[kU3] + lane);
  }

  HWY_INLINE bool AllOrdinary(D d) const {
    QuickTest<D> test(d, in.x, in.y, in.z);
    test.Uniform(u1);
    test.Uniform(u2);
    if constexpr (Sampler::kUsesU3) test.Uniform(u3);
    return test.AllOrdinary(in.ax, in.ay);
  }

  HWY_INLINE Policy<D> Classified(D d) const {
    const auto u_valid = And(And(InUnitInterval(d, u1), InUnitInterval(d, u2)), InUnitInterval(d, u3));
    return Classify(d, And(UnitLength(d, in.x, in.y, in.z), u_valid), in.ax, in.ay);
  }

  template <bool kFast>
  HWY_INLINE void Run(D d, const Tile& tile, std::size_t lane, Statistics& statistics) const {
    const V zero = Zero(d), one = Set(d, 1.0f);
    Policy<D> policy;
    if constexpr (!kFast) policy = Classified(d);
    const Exceptions<D, kFast> exceptions(d, policy);
    const Incident<D> i = in.Prepared(d, exceptions);

    Drawn<D> drawn;
    Sampler::Draw(d, i, exceptions.Harmless(u1, 0.0f), exceptions.Harmless(u2, 0.0f),
                  exceptions.Harmless(u3, 0.0f), drawn);

    // o = 2 (i.M) / (M.M) M - i
    V rho = (drawn.im + drawn.im) / drawn.mm;
    if constexpr (Sampler::kExact) {
      if (!i.all_front) rho = Select(i.front, rho, Max(rho, Set(d, kSmallestRho)));
    } else if constexpr (!Sampler::kUnit) {
      rho = Max(rho, Set(d, kSmallestRho));
    }
    const V ox = Fms(rho, drawn.mx, i.x), oy = Fms(rho, drawn.my, i.y);
    V oz = Fms(rho, drawn.mz, i.z);
    if constexpr (Sampler::kExact) oz = Max(oz, Set(d, kRim));

    auto occluded = kNormal ? NoLanes(d) : oz <= zero;
    if constexpr (!Sampler::kVisible) occluded = Or(occluded, drawn.im <= Set(d, kSmallestIm));
    const auto accepted = Not(occluded);

    // p(o) = D(m) / (4 N), D(m) = (M.M)^2 / (|m_hat|^4 pi ax ay); with a half vector |m_hat|^2 / M.M is rho.
    V pdf = zero;
    if (tile.wanted & kWantsPdf) {
      V numerator = one, denominator = Set(d, 2.0f * kPi) * (i.ax * i.ay) * drawn.two_n;
      if constexpr (Sampler::kUnit) {
        numerator = drawn.mm * drawn.mm;
      } else if constexpr (Sampler::kExact) {
        numerator = drawn.mm * drawn.mm;
        if (!i.all_front) {
          numerator = Select(i.front, numerator, one);
          denominator = denominator * Select(i.front, one, rho * rho);
        }
      } else {
        denominator = denominator * (rho * rho);
      }
      pdf = IfThenElseZero(accepted, numerator / denominator);
    }

    if (kNormal || (tile.wanted & kWantsNormal)) {
      const V inverse_length = one / Sqrt(drawn.mm);
      V im = drawn.im;
      if constexpr (Sampler::kVisible) im = Max(im, Set(d, kSmallestIm));
      im = im * inverse_length;
      StoreU(exceptions.Output(drawn.mx * inverse_length, zero), d, tile.out[kOutMx] + lane);
      StoreU(exceptions.Output(drawn.my * inverse_length, zero), d, tile.out[kOutMy] + lane);
      StoreU(exceptions.Output(drawn.mz * inverse_length, one), d, tile.out[kOutMz] + lane);
      StoreU(exceptions.Output(im, in.z), d, tile.out[kOutIm] + lane);
      if constexpr (kNormal) pdf = pdf * (im * Set(d, 4.0f));  // p(m) = p(o) 4 i.m
    }
    StoreU(exceptions.Output(pdf, zero), d, tile.out[kOutPdf] + lane);

    if constexpr (!kNormal) {
      if (tile.wanted & kWantsWeight) {
        // f cos(theta_o) = w D / (4 sigma), so the weight is w N / sigma.
        V lit, all;
        ShadowingWeight(d, i, ox, oy, oz, tile.uncorrelated, lit, all);
        if constexpr (!Sampler::kNIsSigma) {
          lit = lit * drawn.two_n;
          all = all * i.t;
        }
        const V mirror = IfThenElseZero(in.z > zero, one);
        StoreU(exceptions.Output(IfThenElseZero(accepted, lit / all), mirror), d, tile.out[kOutWeight] + lane);
      }
      StoreU(exceptions.Output(ox, Neg(in.x)), d, tile.out[kOutOx] + lane);
      StoreU(exceptions.Output(oy, Neg(in.y)), d, tile.out[kOutOy] + lane);
      StoreU(exceptions.Output(oz, in.z), d, tile.out[kOutOz] + lane);
    }
    exceptions.Finish(tile, lane, occluded, statistics);
  }
};

// pdf_reflection, evaluate_reflection and evaluate_and_pdf.
template <class D, class Sampler, bool kValue, bool kPdf>
struct Query {
  using V = Vec<D>;
  Inputs<D> in;
  V ox, oy, oz;

  HWY_INLINE Query(D d, const Tile& tile, std::size_t lane)
      : in(d, tile, lane),
        ox(LoadU(d, tile.in[kOx] + lane)),
        oy(LoadU(d, tile.in[kOy] + lane)),
        oz(LoadU(d, tile.in[kOz] + lane)) {}

  HWY_INLINE bool AllOrdinary(D d) const {
    QuickTest<D> test(d, in.x, in.y, in.z);
    test.UnitVector(ox, oy, oz);
    return test.AllOrdinary(in.ax, in.ay);
  }

  template <bool kFast>
  HWY_INLINE void Run(D d, const Tile& tile, std::size_t lane, Statistics& statistics) const {
    const V zero = Zero(d), one = Set(d, 1.0f);
    Policy<D> policy;
    if constexpr (!kFast) {
      const auto valid = And(UnitLength(d, in.x, in.y, in.z), UnitLength(d, ox, oy, oz));
      policy = Classify(d, valid, in.ax, in.ay);
    }
    const Exceptions<D, kFast> exceptions(d, policy);
    const Incident<D> i = in.Prepared(d, exceptions);
    const V x = exceptions.Harmless(ox, 0.0f), y = exceptions.Harmless(oy, 0.0f), z = exceptions.Harmless(oz, 1.0f);

    const V hx = i.x + x, hy = i.y + y, hz = i.z + z;
    const V h2 = Dot(hx, hy, hz, hx, hy, hz);
    // o = -i to float's last bits has no half vector.
    const auto above = z > zero;
    const auto reached = And(And(above, hz > zero), h2 > Set(d, 0x1p-40f));
    // Lanes that no microfacet reaches compute with the half vector (0, 0, 1).
    const V mx = IfThenElseZero(reached, hx), my = IfThenElseZero(reached, hy), mz = Select(reached, hz, one);
    const V m2 = Select(reached, h2, one);
    const V q = DensityRoot(mx, my, mz, m2, i.ax, i.ay);
    const V numerator = IfThenElseZero(reached, q * q);
    const V denominator = Set(d, 2.0f * kPi) * (i.ax * i.ay);
    const V largest = Set(d, 3e38f);  // a density can be beyond the floats straight below a smooth surface

    if constexpr (kPdf) {
      // i.h = |h|^2 / 2: the sum i.h cancels where o is nearly -i, this does not.
      const V two_n = Sampler::TwoN(d, i, m2 * Set(d, 0.5f), mz);
      const V pdf = Min(numerator / (denominator * two_n), largest);
      StoreU(exceptions.Output(pdf, zero), d, tile.out[kOutPdf] + lane);
    }
    if constexpr (kValue) {
      V lit, all;
      ShadowingWeight(d, i, x, y, z, tile.uncorrelated, lit, all);
      const V value = Min(numerator / (denominator * i.t), largest) * IfThenElseZero(above, lit / all);
      StoreU(exceptions.Output(value, zero), d, tile.out[kOutValue] + lane);
    }
    exceptions.Finish(tile, lane, Not(above), statistics);
  }
};

template <class D>
struct MaskingOf {
  using V = Vec<D>;
  Inputs<D> in;

  HWY_INLINE MaskingOf(D d, const Tile& tile, std::size_t lane) : in(d, tile, lane) {}

  HWY_INLINE bool AllOrdinary(D d) const { return QuickTest<D>(d, in.x, in.y, in.z).AllOrdinary(in.ax, in.ay); }

  template <bool kFast>
  HWY_INLINE void Run(D d, const Tile& tile, std::size_t lane, Statistics& statistics) const {
    const V zero = Zero(d), one = Set(d, 1.0f);
    Policy<D> policy;
    if constexpr (!kFast) policy = Classify(d, UnitLength(d, in.x, in.y, in.z), in.ax, in.ay);
    const Exceptions<D, kFast> exceptions(d, policy);
    const Incident<D> i = in.Prepared(d, exceptions);
    // A mirror masks nothing in front of it, and shows nothing to what is behind.
    const V mirror = IfThenElseZero(in.z > zero, one);
    const V masking = IfThenElseZero(i.front, Min((i.z + i.z) / i.t, one));
    StoreU(exceptions.Output(masking, mirror), d, tile.out[kOutMasking] + lane);
    StoreU(exceptions.Output(i.t * Set(d, 0.5f), mirror * in.z), d, tile.out[kOutArea] + lane);
    if (tile.wanted & kWantsShare) {
      Cone<D> cone;
      MakeCone(d, i, Roughness<D>(d, i), cone);
      const V share = Select(i.front, Min(cone.two_k / i.t, one), one);
      StoreU(exceptions.Output(share, one), d, tile.out[kOutShare] + lane);
    }
    exceptions.Finish(tile, lane, NoLanes(d), statistics);
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
