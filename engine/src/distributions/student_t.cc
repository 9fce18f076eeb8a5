// SPDX-License-Identifier: Apache-2.0
// Student-t's kernels.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/distributions/student_t.cc"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
#include "hwy/highway.h"
#include "src/kernels/register-inl.h"
#include "src/kernels/smith-inl.h"
#include "src/kernels/student_t-inl.h"
#include "src/kernels/vcavity_samplers-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

template <class D>
constexpr DistributionKernels MakeStudentT() {
  DistributionKernels kernels;
  kernels.smith = Registrar<Surface<StudentT, Smith, false>, D>()
                      .template Add<SlopeNdf>(Sampler::ndf)
                      .template Add<SlopeVisible>(Sampler::visible)
                      .kernels;
  kernels.vcavity = Registrar<Surface<StudentT, VCavity, false>, D>()
                        .template Add<SlopeNdf>(Sampler::ndf)
                        .template Add<CavityVisible>(Sampler::visible)
                        .template Add<CavityExact>(Sampler::exact)
                        .kernels;
  return kernels;
}

FACETWISE_REGISTER(StudentT)

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();
