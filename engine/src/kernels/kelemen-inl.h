// SPDX-License-Identifier: Apache-2.0
// The lobe that Kelemen & Szirmay-Kalos 2001 add for the light that is scattered more than once:
// F_ms (1 - E(i)) (1 - E(o)) / (pi (1 - mean E)), drawn by the cosine with the share 1 - E(i). docs/albedo.md.
//
// Two kernels: one before the model's own, which says how much there is of the lobe and draws by it, and one after it,
// which adds it. Between them stage.h asks the model's own query about what the lobe has drawn.

#if defined(FACETWISE_KELEMEN_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_KELEMEN_INL_H_
#undef FACETWISE_KELEMEN_INL_H_
#else
#define FACETWISE_KELEMEN_INL_H_
#endif

#include "src/kernels/albedo-inl.h"
#include "src/math/sincos-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// Of light that is scattered again and again, each time by the mean reflectance: what leaves, as a factor on what would
// if nothing were absorbed (Jakob et al. 2014, Kulla & Conty 2017). The mean of Schlick's is f0 + (f90 - f0) / 21.
template <class D, class V = Vec<D>>
HWY_INLINE V ScatteredAgain(D d, const Tile& tile, const InterfaceInputs<D>& interface, V mean_albedo) {
  const V one = Set(d, 1.0f);
  if (tile.interface != Interface::schlick) return one;
  const V f = Fma(interface.f90 - interface.f0, Set(d, 1.0f / 21), interface.f0);
  return f * f * mean_albedo / Max(one - f * (one - mean_albedo), Set(d, 1e-6f));
}

template <class D, class S>
struct LobeOf {
  using V = Vec<D>;
  IncidentInputs<D, S> in;
  InterfaceInputs<D> interface;

  HWY_INLINE LobeOf(D d, const Tile& tile, std::size_t lane) : in(d, tile, lane), interface(d, tile, lane) {}
  HWY_INLINE bool AllOrdinary(D d, const Tile& tile, std::size_t lane) const { return in.AllOrdinary(d, tile, lane); }

  template <bool kFast>
  HWY_INLINE void Run(D d, const Tile& tile, std::size_t lane, Statistics&) const {
    const V zero = Zero(d), one = Set(d, 1.0f), below_one = Set(d, kLargestBelowOne);
    const auto exceptions = ExceptionsOf<kFast>(d, tile, lane, in);
    const AlbedoPlace<D> place(d, *tile.albedo, in, exceptions);
    const V mean = AlbedoLookup<D>::Mean(d, *tile.albedo, place);
    V share = IfThenElseZero(in.z > zero, one - AlbedoLookup<D>::Albedo(d, *tile.albedo, place));
    share = exceptions.Output(share, zero);
    const V scale = share / (Set(d, kPi) * Max(one - mean, Set(d, 1e-6f)));
    Keep(d, tile, kLobeShare, lane, share);
    Keep(d, tile, kLobeScale, lane, exceptions.Output(scale * ScatteredAgain(d, tile, interface, mean), zero));
    if (!tile.draws_lobe) return;

    const V u1 = LoadU(d, tile.in[kU1] + lane), u2 = LoadU(d, tile.in[kU2] + lane), u3 = LoadU(d, tile.in[kU3] + lane);
    const auto valid = And(And(InUnitInterval(d, u1), InUnitInterval(d, u2)), InUnitInterval(d, u3));
    V sin, cos;
    SinCosTurn(d, IfThenElseZero(valid, u2), sin, cos);
    const V squared = IfThenElseZero(valid, u1), r = Sqrt(squared);
    Keep(d, tile, kLobeX, lane, r * cos);
    Keep(d, tile, kLobeY, lane, r * sin);
    Keep(d, tile, kLobeZ, lane, Sqrt(one - squared));
    const auto drawn = And(valid, u3 < share);
    Keep(d, tile, kLobeTaken, lane, IfThenElseZero(drawn, one));
    // The rest of u3 is the model's own. It may not read it, so u1 says whether it was valid.
    const V rest = Min((u3 - share) / Max(one - share, Set(d, 1e-6f)), below_one);
    Keep(d, tile, kLobeU1, lane, Select(valid, u1, Set(d, 2.0f)));
    Keep(d, tile, kLobeU3, lane, IfThenElseZero(And(valid, u3 >= share), rest));
  }

 private:
  static HWY_INLINE void Keep(D d, const Tile& tile, LobeColumn column, std::size_t lane, V value) {
    StoreU(value, d, tile.lobe[column] + lane);
  }
};

// Adds it to the lanes that are taken: kLobeTaken is 1 for what the model's own kernel answered, 2 for what the lobe drew,
// else 0. Outputs are read and written again.
template <class D, class S>
struct WithLobe {
  using V = Vec<D>;
  QueryInputs<D, S> in;

  HWY_INLINE WithLobe(D d, const Tile& tile, std::size_t lane) : in(d, tile, lane) {}
  HWY_INLINE bool AllOrdinary(D, const Tile&, std::size_t) const { return true; }

  template <bool>
  HWY_INLINE void Run(D d, const Tile& tile, std::size_t lane, Statistics&) const {
    const V zero = Zero(d), one = Set(d, 1.0f), largest = Set(d, kLargestDensity);
    const V how = Kept(d, tile, kLobeTaken, lane), share = Kept(d, tile, kLobeShare, lane);
    const auto taken = And(how > zero, in.oz > zero);
    const auto drawn = And(taken, how > one);
    const V z = Select(taken, in.oz, one);
    const AlbedoPlace<D> place(d, *tile.albedo, Select(taken, in.ox, zero), Select(taken, in.oy, zero), z,
                               Select(taken, in.ax, one), Select(taken, in.ay, one));
    const V lost = one - AlbedoLookup<D>::Albedo(d, *tile.albedo, place);
    const V value = Kept(d, tile, kLobeScale, lane) * lost * z;
    V own = zero, pdf = zero;
    if (tile.wanted & kWantsPdf) {
      own = LoadU(d, tile.out[kOutPdf] + lane);
      if (tile.draws_lobe) own = Select(drawn, Kept(d, tile, kLobePdf, lane), own);
      pdf = Min(Fma(one - share, own, share * z * Set(d, 1 / kPi)), largest);
      StoreU(Select(taken, pdf, own), d, tile.out[kOutPdf] + lane);
    }
    if (tile.wanted & kWantsValue) {
      const V before = LoadU(d, tile.out[kOutValue] + lane);
      StoreU(Select(taken, Min(before + value, largest), before), d, tile.out[kOutValue] + lane);
    }
    if (!tile.draws_lobe) return;

    const V before = LoadU(d, tile.out[kOutWeight] + lane);
    const V divisor = Select(taken, pdf, one);
    V weight = Select(drawn, Kept(d, tile, kLobeValue, lane) / divisor, before * (own / divisor));
    weight = Min(weight + value / divisor, largest);
    StoreU(Select(taken, weight, before), d, tile.out[kOutWeight] + lane);
    if (!(tile.wanted & kWantsNormal) || AllFalse(d, drawn)) return;
    // The normal by which o is i's reflection.
    V ix = LoadU(d, tile.in[kIx] + lane), iy = LoadU(d, tile.in[kIy] + lane);
    const V iz = LoadU(d, tile.in[kIz] + lane);
    TurnIfRetro(d, tile, ix, iy);
    const V hx = ix + LoadU(d, tile.in[kOx] + lane), hy = iy + LoadU(d, tile.in[kOy] + lane), hz = iz + in.oz;
    const V length2 = Select(drawn, Dot(hx, hy, hz, hx, hy, hz), one), length = Sqrt(length2);
    const auto become = [&](OutputIndex output, V to) {
      if (!(tile.wanted & bit(output))) return;
      StoreU(Select(drawn, to, LoadU(d, tile.out[output] + lane)), d, tile.out[output] + lane);
    };
    become(kOutMx, hx / length);
    become(kOutMy, hy / length);
    become(kOutMz, hz / length);
    become(kOutIm, Min(Set(d, 0.5f) * length, one));
  }

 private:
  static HWY_INLINE V Kept(D d, const Tile& tile, LobeColumn column, std::size_t lane) {
    return LoadU(d, tile.lobe[column] + lane);
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
