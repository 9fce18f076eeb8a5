// SPDX-License-Identifier: Apache-2.0
// From policies to tables of kernels. Include it in a distribution's own file, inside foreach_target.

#if defined(FACETWISE_REGISTER_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_REGISTER_INL_H_
#undef FACETWISE_REGISTER_INL_H_
#else
#define FACETWISE_REGISTER_INL_H_
#endif

#include "src/kernels/kelemen-inl.h"
#include "src/kernels/query-inl.h"
#include "src/kernels/sample-inl.h"
#include "src/kernels/scatter-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// A surface's kernels for vectors D, one sampler after the other. Long chains of operations go two or four vectors at a time
// (docs/performance.md); four are compiled where it matters most, since they take the compiler long.
template <class S, class D>
struct Registrar {
  SurfaceKernels kernels{};

  constexpr Registrar() {
    kernels.masking = ForEachVector<D, D, false, MaskingOf, S>;
    kernels.albedo = ForEachVector<D, D, false, AlbedoOf, S>;
    kernels.compensation = ForEachVector<D, D, false, CompensationOf, S>;
    kernels.lobe = ForEachVector<D, D, false, LobeOf, S>;
    kernels.with_lobe = ForEachVector<D, D, false, WithLobe, S>;
  }
  template <class Drawer>
  constexpr Registrar& Add(Sampler sampler) {
    const auto index = static_cast<std::size_t>(sampler);
    using Wide = std::conditional_t<Drawer::kLongChain && !S::kAffine, Four<D>, Two<D>>;
    using W = std::conditional_t<Drawer::kLongChain || S::Distribution::kLongChains, Wide, D>;
    if constexpr (S::Distribution::kQuick && !S::kAffine && hn::MaxLanes(D()) > 1) {
      kernels.sample[index] = ForEachVectorOfSamples<W, D, Sample, S, Drawer>;
    } else {
      kernels.sample[index] = ForEachVector<W, D, false, Sample, S, Drawer>;
    }
    if constexpr (S::Distribution::kQuick && kStreams<D>)
      kernels.sample_ahead[index] = ForEachVector<Two<D>, D, true, Sample, S, Drawer>;
    kernels.query[index] = ForEachVector<D, D, false, Query, S, Drawer>;
    if constexpr (Drawer::kNormals) {
      kernels.scatter[index] = ForEachVector<D, D, false, Scatter, S, Drawer>;
      kernels.scatter_query[index] = ForEachVector<D, D, false, ScatterQuery, S, Drawer>;
    }
    return *this;
  }
  // A second name, or a sampler that has another's density.
  template <class Drawer, class SameDensity>
  constexpr Registrar& Add(Sampler sampler) {
    const auto index = static_cast<std::size_t>(sampler);
    kernels.sample[index] = ForEachVector<D, D, false, Sample, S, Drawer>;
    kernels.query[index] = ForEachVector<D, D, false, Query, S, SameDensity>;
    kernels.scatter[index] = ForEachVector<D, D, false, Scatter, S, Drawer>;
    kernels.scatter_query[index] = ForEachVector<D, D, false, ScatterQuery, S, SameDensity>;
    return *this;
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

// Defines k<Name> and, where there is one, kOneLane<Name> from a template Make<Name><D>() that gives
// DistributionKernels.
#undef FACETWISE_REGISTER
#if FACETWISE_HAS_ONE_LANE
#define FACETWISE_REGISTER(Name)                          \
  extern const DistributionKernels k##Name;               \
  extern const DistributionKernels kOneLane##Name;        \
  const DistributionKernels k##Name = Make##Name<Full>(); \
  const DistributionKernels kOneLane##Name = Make##Name<Single>();
#else
#define FACETWISE_REGISTER(Name)            \
  extern const DistributionKernels k##Name; \
  const DistributionKernels k##Name = Make##Name<Full>();
#endif

#endif
