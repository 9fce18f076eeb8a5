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

// A surface's kernels for vectors D, one sampler after the other. Pairs: the tag for samplers with a long chain, which
// gain by 15 % from pairs, and for all sampling where the distribution's areas are long; the others lose up to 9 % by
// them where registers are few.
template <class S, class D, class Pairs = D>
struct Registrar {
  SurfaceKernels kernels{};

  constexpr Registrar() {
    kernels.masking = ForEachVector<D, MaskingOf<D, S>>;
    kernels.albedo = ForEachVector<D, AlbedoOf<D, S>>;
    kernels.compensation = ForEachVector<D, CompensationOf<D, S>>;
    kernels.lobe = ForEachVector<D, LobeOf<D, S>>;
    kernels.with_lobe = ForEachVector<D, WithLobe<D, S>>;
  }
  template <class Drawer>
  constexpr Registrar& Add(Sampler sampler) {
    const auto index = static_cast<std::size_t>(sampler);
    using T = std::conditional_t<Drawer::kExact || S::Distribution::kLongChains, Pairs, D>;
    kernels.sample[index] = ForEachVector<T, Sample<T, S, Drawer>>;
    if constexpr (S::Distribution::kWaitsForMemory && kStreams<D>)
      kernels.sample_ahead[index] = ForEachVector<Pairs, Sample<Pairs, S, Drawer>, true>;
    kernels.query[index] = ForEachVector<D, Query<D, S, Drawer>>;
    if constexpr (Drawer::kNormals) {
      kernels.scatter[index] = ForEachVector<D, Scatter<D, S, Drawer>>;
      kernels.scatter_query[index] = ForEachVector<D, ScatterQuery<D, S, Drawer>>;
    }
    return *this;
  }
  // A second name, or a sampler that has another's density.
  template <class Drawer, class SameDensity>
  constexpr Registrar& Add(Sampler sampler) {
    const auto index = static_cast<std::size_t>(sampler);
    kernels.sample[index] = ForEachVector<D, Sample<D, S, Drawer>>;
    kernels.query[index] = ForEachVector<D, Query<D, S, SameDensity>>;
    kernels.scatter[index] = ForEachVector<D, Scatter<D, S, Drawer>>;
    kernels.scatter_query[index] = ForEachVector<D, ScatterQuery<D, S, SameDensity>>;
    return *this;
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

// Defines k<Name> and, where there is one, kOneLane<Name> from a template Make<Name><D, Pairs>() that gives
// DistributionKernels.
#undef FACETWISE_REGISTER
#if FACETWISE_HAS_ONE_LANE
#define FACETWISE_REGISTER(Name)                                     \
  extern const DistributionKernels k##Name;                          \
  extern const DistributionKernels kOneLane##Name;                   \
  const DistributionKernels k##Name = Make##Name<Full, FullPairs>(); \
  const DistributionKernels kOneLane##Name = Make##Name<Single, Single>();
#else
#define FACETWISE_REGISTER(Name)            \
  extern const DistributionKernels k##Name; \
  const DistributionKernels k##Name = Make##Name<Full, FullPairs>();
#endif

#endif
