// SPDX-License-Identifier: Apache-2.0
// Phong's kernels.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/distributions/phong.cc"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
#include "hwy/highway.h"
#include "src/kernels/phong-inl.h"
#include "src/kernels/register-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

template <class D>
constexpr DistributionKernels MakePhong() {
  DistributionKernels kernels;
  kernels.vcavity = Registrar<Surface<Phong, VCavity, false>, D>()
                        .template Add<SlopeNdf>(Sampler::ndf)
                        .template Add<PhongCavity>(Sampler::visible)
                        .kernels;
  return kernels;
}

FACETWISE_REGISTER(Phong)

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();
