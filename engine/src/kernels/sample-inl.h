// SPDX-License-Identifier: Apache-2.0
// sample_normal and sample_reflection, written once over surfaces, samplers and vector widths.

#if defined(FACETWISE_SAMPLE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_SAMPLE_INL_H_
#undef FACETWISE_SAMPLE_INL_H_
#else
#define FACETWISE_SAMPLE_INL_H_
#endif

#include "src/kernels/inputs-inl.h"
#include "src/kernels/output-inl.h"
#include "src/kernels/sampler-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// The smallest o_z that samplers without occluded reflections return for i_z > 0: rounding puts a few samples in
// a million on the wrong side of the rim they were drawn inside of, and these are raised to it.
inline constexpr float kRim = kHorizon;

// sample_reflection and sample_normal.
template <class D, class S, class Drawer>
struct Sample {
  using V = Vec<D>;
  SampleInputs<D, S, Drawer::kUsesU3> in;

  HWY_INLINE Sample(D d, const Tile& tile, std::size_t lane) : in(d, tile, lane) {}
  HWY_INLINE bool AllOrdinary(D d, const Tile& tile, std::size_t lane) const { return in.AllOrdinary(d, tile, lane); }

  template <bool kFast>
  HWY_INLINE void Run(D d, const Tile& tile, std::size_t lane, Statistics& statistics) const {
    const V zero = Zero(d), one = Set(d, 1.0f);
    const auto exceptions = ExceptionsOf<kFast>(d, tile, lane, in);
    const InterfaceInputs<D> interface(d, tile, lane);
    const Incident<D, S> i = in.template Prepared<Drawer::kReadsArea>(d, tile, exceptions);

    Drawn<D> drawn;
    V u3 = exceptions.Computable(in.u3, 0.0f);
    Drawer::Draw(d, i, exceptions.Computable(in.u1, 0.0f), exceptions.Computable(in.u2, 0.0f), u3, drawn);

    const V rho = Rho(d, i, drawn);
    V ox = Fms(rho, drawn.mx, i.x), oy = Fms(rho, drawn.my, i.y);
    V oz = Fms(rho, drawn.mz, i.z);
    if constexpr (Drawer::kExact) oz = Max(oz, Set(d, kRim));

    auto occluded = tile.normals_alone ? NoLanes(d) : oz <= zero;
    if constexpr (!Drawer::kVisible) occluded = Or(occluded, drawn.im <= Set(d, kSmallestIm));
    const auto accepted = Not(occluded);

    V pdf = zero;
    if (tile.wanted & kWantsPdf) pdf = IfThenElseZero(accepted, Density(d, i, drawn, rho));

    const bool fresnel = tile.interface != Interface::conductor && (tile.wanted & kWantsWeight);
    V im = drawn.im;
    if (fresnel || (tile.wanted & kWantsNormal) || tile.normals_alone) {
      const V inverse_length = one / Sqrt(drawn.mm);
      if constexpr (Drawer::kVisible) im = Max(im, Set(d, kSmallestIm));
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
        V weight = S::Masking::template Weight<Drawer>(d, i, drawn, ox, oy, oz, tile.uncorrelated);
        if constexpr (Drawer::kUnboundedWeight) weight = Min(weight, Set(d, kLargestDensity));
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

 private:
  // o = rho M - i with rho = 2 (i.M) / (M.M).
  static HWY_INLINE V Rho(D d, const Incident<D, S>& i, const Drawn<D>& drawn) {
    const V rho = (drawn.im + drawn.im) / drawn.mm;
    if constexpr (Drawer::kUnit) {
      return rho;
    } else if constexpr (Drawer::kExact) {
      return i.all_front ? rho : Select(i.front, rho, Max(rho, Set(d, kSmallestRho<S>)));
    } else {
      return Max(rho, Set(d, kSmallestRho<S>));
    }
  }
  // p(o) = D(m) / (4 N)
  static HWY_INLINE V Density(D d, const Incident<D, S>& i, const Drawn<D>& drawn, V rho) {
    V numerator, denominator;
    Drawer::Density(d, i, drawn, rho, numerator, denominator);
    denominator = Set(d, 2.0f * kPi) * (i.ax * i.ay) * drawn.two_n * denominator;
    return Min(numerator / denominator, Set(d, kLargestDensity));
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
