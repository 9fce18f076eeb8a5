// SPDX-License-Identifier: Apache-2.0
// pdf_reflection, evaluate_reflection and masking, written once over surfaces, samplers and vector widths.

#if defined(FACETWISE_QUERY_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_QUERY_INL_H_
#undef FACETWISE_QUERY_INL_H_
#else
#define FACETWISE_QUERY_INL_H_
#endif

#include "src/kernels/inputs-inl.h"
#include "src/kernels/output-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// pdf_reflection and evaluate_reflection.
template <class D, class S, class Drawer>
struct Query {
  using V = Vec<D>;
  using Distribution = typename S::Distribution;
  QueryInputs<D, S> in;

  HWY_INLINE Query(D d, const Tile& tile, std::size_t lane) : in(d, tile, lane) {}
  HWY_INLINE bool AllOrdinary(D d, const Tile& tile, std::size_t lane) const { return in.AllOrdinary(d, tile, lane); }

  template <bool kFast>
  HWY_INLINE void Run(D d, const Tile& tile, std::size_t lane, Statistics& statistics) const {
    const V zero = Zero(d), one = Set(d, 1.0f);
    const auto exceptions = ExceptionsOf<kFast>(d, tile, lane, in);
    const InterfaceInputs<D> interface(d, tile, lane);
    const Incident<D, S> i = in.Prepared(d, tile, exceptions);
    V x = exceptions.Computable(in.ox, 0.0f), y = exceptions.Computable(in.oy, 0.0f);
    const V z = exceptions.Computable(in.oz, 1.0f);
    TurnIfRetro(d, tile, x, y);

    const V hx = i.x + x, hy = i.y + y, hz = i.z + z;
    const V h2 = Dot(hx, hy, hz, hx, hy, hz);
    // o = -i to float's last bits has no half vector.
    const auto above = z > zero;
    const auto reached = And(And(above, hz > zero), h2 > Set(d, 0x1p-40f));
    // Lanes that no microfacet reaches compute with the half vector (0, 0, 1).
    const V mx = IfThenElseZero(reached, hx), my = IfThenElseZero(reached, hy), mz = Select(reached, hz, one);
    const V m2 = Select(reached, h2, one);
    // i.h = |h|^2 / 2: the sum i.h cancels where o is nearly -i, this does not.
    const V im = m2 * Set(d, 0.5f);
    const V density = IfThenElseZero(reached, Distribution::Density(d, i, mx, my, mz, m2, i.shift));
    const V denominator = Set(d, 2.0f * kPi) * (i.ax * i.ay);
    const V largest = Set(d, kLargestDensity);  // a density can be beyond the floats straight below a smooth surface

    if (tile.wanted & kWantsPdf) {
      V numerator = density, two_n;
      SampledDensity<Drawer>(d, i, mx, my, mz, m2, im, reached, numerator, two_n);
      const V pdf = Min(numerator / (denominator * two_n), largest);
      Store(d, tile, kOutPdf, lane, exceptions.Output(pdf, zero));
    }
    if (tile.wanted & kWantsValue) {
      V two_n, w;
      S::Masking::Value(d, i, mz, im, x, y, z, tile.uncorrelated, two_n, w);
      V value = Min(density / (denominator * two_n), largest) * IfThenElseZero(above, w);
      if constexpr (S::Masking::kUnboundedW) value = Min(value, largest);
      if (tile.interface != Interface::conductor)
        value = value * interface.Reflectance(d, tile, Sqrt(m2) * Set(d, 0.5f));
      Store(d, tile, kOutValue, lane, exceptions.Output(value, zero));
    }
    exceptions.Finish(tile, lane, Not(above), statistics);
  }
};

template <class D, class S>
struct MaskingOf {
  using V = Vec<D>;
  IncidentInputs<D, S> in;

  HWY_INLINE MaskingOf(D d, const Tile& tile, std::size_t lane) : in(d, tile, lane) {}
  HWY_INLINE bool AllOrdinary(D d, const Tile& tile, std::size_t lane) const { return in.AllOrdinary(d, tile, lane); }

  template <bool kFast>
  HWY_INLINE void Run(D d, const Tile& tile, std::size_t lane, Statistics& statistics) const {
    const V zero = Zero(d), one = Set(d, 1.0f);
    const auto exceptions = ExceptionsOf<kFast>(d, tile, lane, in);
    const Incident<D, S> i = in.Prepared(d, tile, exceptions);
    // A mirror masks nothing in front of it, and shows nothing to what is behind.
    const V mirror = IfThenElseZero(in.z > zero, one);
    V masking, area;
    S::Masking::MaskingAndArea(d, i, masking, area);
    Store(d, tile, kOutMasking, lane, exceptions.Output(masking, mirror));
    Store(d, tile, kOutArea, lane, exceptions.Output(area, mirror * in.z));
    if (tile.wanted & kWantsShare)
      Store(d, tile, kOutShare, lane, exceptions.Output(S::Masking::ShareUnoccluded(d, i), one));
    exceptions.Finish(tile, lane, NoLanes(d), statistics);
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
