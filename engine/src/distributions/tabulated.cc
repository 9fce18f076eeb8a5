// SPDX-License-Identifier: Apache-2.0
// Tabulated's kernels.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/distributions/tabulated.cc"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
#include "hwy/highway.h"
#include "src/kernels/register-inl.h"
#include "src/kernels/smith-inl.h"
#include "src/kernels/tabulated-inl.h"
#include "src/kernels/vcavity_samplers-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

template <class D>
constexpr DistributionKernels MakeTabulated() {
  DistributionKernels kernels;
  // A table has a mean slope of its own.
  kernels.smith_affine = Registrar<Surface<Tabulated, Smith, true>, D>()
                             .template Add<TableNdf>(Sampler::ndf)
                             .template Add<TableVisible>(Sampler::visible)
                             .kernels;
  kernels.smith = kernels.smith_affine;
  kernels.vcavity = Registrar<Surface<Tabulated, VCavity, false>, D>()
                        .template Add<TableNdf>(Sampler::ndf)
                        .template Add<TableCavity>(Sampler::visible)
                        .kernels;
  return kernels;
}

FACETWISE_REGISTER(Tabulated)

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();
