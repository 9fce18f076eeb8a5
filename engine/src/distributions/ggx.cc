// SPDX-License-Identifier: Apache-2.0
// GGX's kernels.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/distributions/ggx.cc"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
#include "hwy/highway.h"
#include "src/kernels/ggx_exact-inl.h"
#include "src/kernels/register-inl.h"
#include "src/kernels/smith-inl.h"
#include "src/kernels/vcavity_samplers-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

template <class D>
constexpr DistributionKernels MakeGgx() {
  DistributionKernels kernels;
  kernels.smith = Registrar<Surface<Ggx, Smith, false>, D>()
                      .template Add<GgxNdf>(Sampler::ndf)
                      .template Add<Heitz, Cap>(Sampler::heitz)
                      .template Add<Cap>(Sampler::cap)
                      .template Add<Cap>(Sampler::visible)
                      .template Add<Bounded>(Sampler::bounded)
                      .template Add<GgxExact>(Sampler::exact)
                      .kernels;
  kernels.smith_affine = Registrar<Surface<Ggx, Smith, true>, D>()
                             .template Add<GgxNdf>(Sampler::ndf)
                             .template Add<Heitz, Cap>(Sampler::heitz)
                             .template Add<Cap>(Sampler::cap)
                             .template Add<Cap>(Sampler::visible)
                             .template Add<GgxExact>(Sampler::exact)
                             .kernels;
  kernels.vcavity = Registrar<Surface<Ggx, VCavity, false>, D>()
                        .template Add<SlopeNdf>(Sampler::ndf)
                        .template Add<CavityVisible>(Sampler::visible)
                        .template Add<CavityExact>(Sampler::exact)
                        .kernels;
  return kernels;
}

FACETWISE_REGISTER(Ggx)

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();
