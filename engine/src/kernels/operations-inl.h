// The operations, written once over samplers and vector widths.

#if defined(FACETWISE_OPERATIONS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_OPERATIONS_INL_H_
#undef FACETWISE_OPERATIONS_INL_H_
#else
#define FACETWISE_OPERATIONS_INL_H_
#endif

#include "src/kernels/exact-inl.h"
#include "src/tile.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

template <class D, class V = Vec<D>>
HWY_INLINE V Load(D d, const Tile& tile, InputIndex input, std::size_t lane) {
  return hn::LoadU(d, tile.in[input].data + (lane & tile.in[input].lane_mask));
}

template <class D, class V = Vec<D>>
HWY_INLINE void Store(D d, const Tile& tile, OutputIndex output, std::size_t lane, V value) {
  if (tile.out[output] != nullptr) hn::StoreU(value, d, tile.out[output] + lane);
}

inline bool Wants(const Tile& tile, OutputIndex output) { return tile.out[output] != nullptr; }

// Which lanes are ordinary, smooth or invalid (LaneStatus). NaN fails every comparison.
template <class D>
struct Policy {
  Mask<D> valid, smooth;  // smooth lanes are valid
  bool all_ordinary;
};

template <class D, class V = Vec<D>>
HWY_INLINE Mask<D> UnitLength(D d, V x, V y, V z) {
  return hn::Abs(Dot(x, y, z, x, y, z) - hn::Set(d, 1.0f)) <= hn::Set(d, 1e-3f);
}

template <class D, class V = Vec<D>>
HWY_INLINE Mask<D> InUnitInterval(D d, V u) {
  return hn::And(u >= hn::Zero(d), u < hn::Set(d, 1.0f));
}

template <class D, class V = Vec<D>>
HWY_INLINE Policy<D> Classify(D d, Mask<D> inputs_valid, V ax, V ay) {
  // One bound for both: Min and Max of different instruction sets treat NaN differently, comparisons do not.
  const V zero = hn::Zero(d), largest = hn::Set(d, kLargestAlpha), smallest = hn::Set(d, kSmallestAlpha);
  Policy<D> policy;
  policy.valid = hn::And(inputs_valid, hn::And(hn::And(ax > zero, ay > zero), hn::And(ax <= largest, ay <= largest)));
  policy.smooth = hn::And(policy.valid, hn::Or(ax < smallest, ay < smallest));
  policy.all_ordinary = hn::AllTrue(d, hn::AndNot(policy.smooth, policy.valid));
  return policy;
}

// Counts a vector's lanes, of which the first `count` are real, and stores their status.
template <class D>
HWY_INLINE void Finish(D d, const Tile& tile, std::size_t lane, const Policy<D>& policy, Mask<D> occluded,
                       Statistics& statistics) {
  const hn::Rebind<int32_t, D> di;
  const std::size_t lanes = hn::Lanes(d);
  const std::size_t count = HWY_MIN(lanes, tile.lanes - lane);
  const bool whole = count == lanes;
  std::size_t rejected = hn::CountTrue(d, whole ? occluded : hn::And(occluded, hn::FirstN(d, count)));
  statistics.occluded += rejected;
  if (HWY_UNLIKELY(!policy.all_ordinary)) {
    const auto real = hn::FirstN(d, count);
    const std::size_t smooth = hn::CountTrue(d, hn::And(real, policy.smooth));
    const std::size_t invalid = hn::CountTrue(d, hn::AndNot(policy.valid, real));
    statistics.smooth += smooth;
    statistics.invalid += invalid;
    rejected += smooth + invalid;
  }
  statistics.accepted += count - rejected;
  if (tile.status != nullptr) {
    const auto code = [](LaneStatus status) { return static_cast<int32_t>(status); };
    auto value = hn::IfThenElseZero(hn::RebindMask(di, occluded), hn::Set(di, code(LaneStatus::occluded)));
    if (HWY_UNLIKELY(!policy.all_ordinary)) {
      value = hn::IfThenElse(hn::RebindMask(di, policy.smooth), hn::Set(di, code(LaneStatus::smooth)), value);
      value = hn::IfThenElse(hn::RebindMask(di, policy.valid), value, hn::Set(di, code(LaneStatus::invalid)));
    }
    const hn::Rebind<uint8_t, D> db;
    hn::StoreU(hn::DemoteTo(db, value), db, tile.status + lane);
  }
}

// Incident direction, roughness and the policy of a vector of lanes. Lanes that are not ordinary compute with
// harmless inputs (straight up, alpha 1) and are set right when they are stored.
template <class D>
struct Lanes {
  using V = Vec<D>;
  V x, y, z, ax, ay;
  Policy<D> policy;
};

template <class D>
HWY_INLINE Lanes<D> LoadLanes(D d, const Tile& tile, std::size_t lane) {
  Lanes<D> lanes;
  lanes.x = Load(d, tile, kIx, lane);
  lanes.y = Load(d, tile, kIy, lane);
  lanes.z = Load(d, tile, kIz, lane);
  lanes.ax = Load(d, tile, kAlphaX, lane);
  lanes.ay = Load(d, tile, kAlphaY, lane);
  return lanes;
}

template <class D>
HWY_INLINE Incident<D> PrepareOrdinary(D d, const Lanes<D>& lanes) {
  if (HWY_LIKELY(lanes.policy.all_ordinary)) return Prepare(d, lanes.x, lanes.y, lanes.z, lanes.ax, lanes.ay);
  const auto ordinary = hn::AndNot(lanes.policy.smooth, lanes.policy.valid);
  const auto one = hn::Set(d, 1.0f);
  return Prepare(d, hn::IfThenElseZero(ordinary, lanes.x), hn::IfThenElseZero(ordinary, lanes.y),
                 Select(ordinary, lanes.z, one), Select(ordinary, lanes.ax, one), Select(ordinary, lanes.ay, one));
}

// What an output becomes in smooth and in invalid lanes (0).
template <class D, class V = Vec<D>>
HWY_INLINE V Settle(const Policy<D>& policy, V value, V when_smooth) {
  if (HWY_LIKELY(policy.all_ordinary)) return value;
  return hn::IfThenElseZero(policy.valid, Select(policy.smooth, when_smooth, value));
}

// sample_reflection and, with kNormal, sample_normal.
template <class D, class Sampler, bool kNormal>
void Sample(const Tile& tile, Statistics& statistics) {
  const D d;
  using V = Vec<D>;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  const bool want_length =
      kNormal || Wants(tile, kOutMx) || Wants(tile, kOutMy) || Wants(tile, kOutMz) || Wants(tile, kOutIm);

  for (std::size_t lane = 0; lane < tile.lanes; lane += hn::Lanes(d)) {
    Lanes<D> lanes = LoadLanes(d, tile, lane);
    V u1 = Load(d, tile, kU1, lane), u2 = Load(d, tile, kU2, lane), u3 = zero;
    auto valid = hn::And(UnitLength(d, lanes.x, lanes.y, lanes.z),
                         hn::And(InUnitInterval(d, u1), InUnitInterval(d, u2)));
    if constexpr (Sampler::kUsesU3) {
      u3 = Load(d, tile, kU3, lane);
      valid = hn::And(valid, InUnitInterval(d, u3));
    }
    const auto policy = lanes.policy = Classify(d, valid, lanes.ax, lanes.ay);
    if (HWY_UNLIKELY(!policy.all_ordinary)) {
      u1 = hn::IfThenElseZero(policy.valid, u1);
      u2 = hn::IfThenElseZero(policy.valid, u2);
      u3 = hn::IfThenElseZero(policy.valid, u3);
    }
    const Incident<D> i = PrepareOrdinary(d, lanes);

    Drawn<D> drawn;
    Sampler::Draw(d, i, u1, u2, u3, drawn);

    // o = 2 (i.M) / (M.M) M - i
    const V rho = (drawn.im + drawn.im) / drawn.mm;
    const V ox = Fma(rho, drawn.mx, hn::Neg(i.x)), oy = Fma(rho, drawn.my, hn::Neg(i.y));
    V oz = Fma(rho, drawn.mz, hn::Neg(i.z));
    if constexpr (Sampler::kExact) oz = hn::Max(oz, hn::Set(d, kRim));

    auto rejected = kNormal ? NoLanes(d) : oz <= zero;
    if constexpr (!Sampler::kVisible) rejected = hn::Or(rejected, drawn.im <= zero);
    const auto accepted = hn::Not(rejected);

    // D(m) = (M.M)^2 / (|m_hat|^4 pi ax ay); with a half vector |m_hat|^2 / M.M is rho.
    V density = one, four_n = drawn.four_n;
    if constexpr (Sampler::kUnit) {
      density = drawn.mm * drawn.mm;
    } else if constexpr (Sampler::kExact) {
      const auto front = i.z > zero;
      density = Select(front, drawn.mm * drawn.mm, one);
      if (!hn::AllTrue(d, front)) four_n = four_n * Select(front, one, rho * rho);
    } else {
      four_n = four_n * (rho * rho);
    }
    const bool want_pdf = Wants(tile, kOutPdf);
    V pdf = zero;
    if (want_pdf) pdf = density / (hn::Set(d, kPi) * (i.ax * i.ay) * four_n);

    if (want_length) {
      const V inverse_length = one / hn::Sqrt(drawn.mm);
      const V im = drawn.im * inverse_length;
      Store(d, tile, kOutMx, lane, Settle(policy, drawn.mx * inverse_length, zero));
      Store(d, tile, kOutMy, lane, Settle(policy, drawn.my * inverse_length, zero));
      Store(d, tile, kOutMz, lane, Settle(policy, drawn.mz * inverse_length, one));
      Store(d, tile, kOutIm, lane, Settle(policy, im, lanes.z));
      if constexpr (kNormal) pdf = pdf * (im * hn::Set(d, 4.0f));  // p(m) = p(o) 4 i.m
    }
    if (want_pdf) Store(d, tile, kOutPdf, lane, Settle(policy, hn::IfThenElseZero(accepted, pdf), zero));

    if constexpr (!kNormal) {
      if (Wants(tile, kOutWeight)) {
        // f cos(theta_o) = w D / (4 sigma), so the weight is w N / sigma.
        V numerator, denominator;
        ShadowingWeight(d, i, ox, oy, oz, tile.uncorrelated, numerator, denominator);
        if constexpr (!std::is_same_v<Sampler, Cap> && !std::is_same_v<Sampler, Heitz>) {
          numerator = numerator * drawn.four_n;
          denominator = denominator * FourSigma(i);
        }
        const V weight = hn::IfThenElseZero(accepted, numerator / denominator);
        const V mirror = hn::IfThenElseZero(lanes.z > zero, one);
        Store(d, tile, kOutWeight, lane, Settle(policy, weight, mirror));
      }
      Store(d, tile, kOutOx, lane, Settle(policy, ox, hn::Neg(lanes.x)));
      Store(d, tile, kOutOy, lane, Settle(policy, oy, hn::Neg(lanes.y)));
      Store(d, tile, kOutOz, lane, Settle(policy, oz, lanes.z));
    }
    Finish(d, tile, lane, policy, hn::And(rejected, hn::AndNot(policy.smooth, policy.valid)), statistics);
  }
}

// pdf_reflection, evaluate_reflection and evaluate_and_pdf.
template <class D, class Sampler, bool kValue, bool kPdf>
void Query(const Tile& tile, Statistics& statistics) {
  const D d;
  using V = Vec<D>;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  for (std::size_t lane = 0; lane < tile.lanes; lane += hn::Lanes(d)) {
    Lanes<D> lanes = LoadLanes(d, tile, lane);
    V ox = Load(d, tile, kOx, lane), oy = Load(d, tile, kOy, lane), oz = Load(d, tile, kOz, lane);
    const auto valid = hn::And(UnitLength(d, lanes.x, lanes.y, lanes.z), UnitLength(d, ox, oy, oz));
    const auto policy = lanes.policy = Classify(d, valid, lanes.ax, lanes.ay);
    if (HWY_UNLIKELY(!policy.all_ordinary)) {
      ox = hn::IfThenElseZero(policy.valid, ox);
      oy = hn::IfThenElseZero(policy.valid, oy);
      oz = Select(policy.valid, oz, one);
    }
    const Incident<D> i = PrepareOrdinary(d, lanes);

    const V hx = i.x + ox, hy = i.y + oy, hz = i.z + oz;
    const V h2 = Dot(hx, hy, hz, hx, hy, hz);
    const V ih = Dot(i.x, i.y, i.z, hx, hy, hz);
    const auto occluded = oz <= zero;
    // o = -i to float's last bits has no half vector.
    const auto reached =
        hn::And(hn::And(oz > zero, hz > zero), hn::And(h2 > hn::Set(d, 0x1p-40f), ih > zero));
    // Lanes that no microfacet reaches compute with the half vector (0, 0, 1).
    const V mx = hn::IfThenElseZero(reached, hx), my = hn::IfThenElseZero(reached, hy), mz = Select(reached, hz, one);
    const V m2 = Select(reached, h2, one);
    const V q = DensityRoot(mx, my, mz, m2, i.ax, i.ay);
    const V density = q * q / (hn::Set(d, kPi) * (i.ax * i.ay));

    if constexpr (kPdf) {
      if (Wants(tile, kOutPdf)) {
        const V four_n = Sampler::FourN(d, i, Select(reached, ih, one), mz);
        Store(d, tile, kOutPdf, lane, Settle(policy, hn::IfThenElseZero(reached, density / four_n), zero));
      }
    }
    if constexpr (kValue) {
      if (Wants(tile, kOutValue)) {
        V numerator, denominator;
        ShadowingWeight(d, i, ox, oy, oz, tile.uncorrelated, numerator, denominator);
        const V value = density * numerator / (denominator * FourSigma(i));
        Store(d, tile, kOutValue, lane, Settle(policy, hn::IfThenElseZero(reached, value), zero));
      }
    }
    Finish(d, tile, lane, policy, hn::And(occluded, hn::AndNot(policy.smooth, policy.valid)), statistics);
  }
}

template <class D>
void MaskingKernel(const Tile& tile, Statistics& statistics) {
  const D d;
  using V = Vec<D>;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  for (std::size_t lane = 0; lane < tile.lanes; lane += hn::Lanes(d)) {
    Lanes<D> lanes = LoadLanes(d, tile, lane);
    const auto policy = lanes.policy = Classify(d, UnitLength(d, lanes.x, lanes.y, lanes.z), lanes.ax, lanes.ay);
    const Incident<D> i = PrepareOrdinary(d, lanes);
    const auto front = i.z > zero;
    // A mirror masks nothing in front of it, and shows nothing to what is behind.
    const V mirror = hn::IfThenElseZero(lanes.z > zero, one);
    if (Wants(tile, kOutMasking)) {
      const V masking = hn::IfThenElseZero(front, hn::Min((i.z + i.z) / i.t, one));
      Store(d, tile, kOutMasking, lane, Settle(policy, masking, mirror));
    }
    Store(d, tile, kOutArea, lane, Settle(policy, i.t * hn::Set(d, 0.5f), mirror * lanes.z));
    if (Wants(tile, kOutShare)) {
      Cone<D> cone;
      MakeCone(d, i, cone);
      const V share = Select(front, hn::Min(cone.four_k / FourSigma(i), one), one);
      Store(d, tile, kOutShare, lane, Settle(policy, share, one));
    }
    Finish(d, tile, lane, policy, NoLanes(d), statistics);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
