// SPDX-License-Identifier: Apache-2.0
// Beckmann's kernels.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/distributions/beckmann.cc"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
#include "hwy/highway.h"
#include "src/kernels/beckmann_exact-inl.h"
#include "src/kernels/register-inl.h"
#include "src/kernels/smith-inl.h"
#include "src/kernels/vcavity_samplers-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

template <class D>
constexpr DistributionKernels MakeBeckmann() {
  DistributionKernels kernels;
  kernels.smith = Registrar<Surface<Beckmann, Smith, false>, D>()
                      .template Add<SlopeNdf>(Sampler::ndf)
                      .template Add<SlopeVisible>(Sampler::visible)
                      .template Add<BeckmannExact>(Sampler::exact)
                      .kernels;
  kernels.smith_affine = Registrar<Surface<Beckmann, Smith, true>, D>()
                             .template Add<SlopeNdf>(Sampler::ndf)
                             .template Add<SlopeVisible>(Sampler::visible)
                             .kernels;
  kernels.vcavity = Registrar<Surface<Beckmann, VCavity, false>, D>()
                        .template Add<SlopeNdf>(Sampler::ndf)
                        .template Add<CavityVisible>(Sampler::visible)
                        .template Add<CavityExact>(Sampler::exact)
                        .kernels;
  return kernels;
}

FACETWISE_REGISTER(Beckmann)

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();
