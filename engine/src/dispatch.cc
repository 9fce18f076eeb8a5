// SPDX-License-Identifier: Apache-2.0
// One table of kernels per target; the choice between them. The only file that knows Highway's targets.
#include <type_traits>
#include <vector>

#include "facetwise/target.h"
#include "hwy/cache_control.h"
#include "src/tile.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/dispatch.cc"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
#include "hwy/highway.h"
#include "src/distributions.h"
#include "src/math/philox-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

#define FACETWISE_DECLARE(Name) extern const DistributionKernels k##Name;
#define FACETWISE_ENTRY(Name) &k##Name,
FACETWISE_DISTRIBUTIONS(FACETWISE_DECLARE)
extern const TargetKernels kTable;
const TargetKernels kTable = {
    {FACETWISE_DISTRIBUTIONS(FACETWISE_ENTRY)}, Philox<Full>, hn::MaxLanes(Full()), kStreams<Full>, hwy::FlushStream};
#undef FACETWISE_ENTRY
#undef FACETWISE_DECLARE

#if FACETWISE_HAS_ONE_LANE
#define FACETWISE_DECLARE(Name) extern const DistributionKernels kOneLane##Name;
#define FACETWISE_ENTRY(Name) &kOneLane##Name,
FACETWISE_DISTRIBUTIONS(FACETWISE_DECLARE)
extern const TargetKernels kOneLaneTable;
const TargetKernels kOneLaneTable = {
    {FACETWISE_DISTRIBUTIONS(FACETWISE_ENTRY)}, Philox<Single>, 1, false, hwy::FlushStream};
#undef FACETWISE_ENTRY
#undef FACETWISE_DECLARE
#endif

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace facetwise {
namespace {

struct CompiledTarget {
  Target target;
  std::int64_t highway;
  const TargetKernels* table;
  const TargetKernels* one_lane;
};

// Best first.
constexpr CompiledTarget kCompiled[] = {
#if HWY_TARGETS & HWY_AVX3
    {Target::avx3, HWY_AVX3, &N_AVX3::kTable, &N_AVX2::kOneLaneTable},
#endif
#if HWY_TARGETS & HWY_AVX2
    {Target::avx2, HWY_AVX2, &N_AVX2::kTable, &N_AVX2::kOneLaneTable},
#endif
#if HWY_TARGETS & HWY_NEON
    {Target::neon, HWY_NEON, &N_NEON::kTable, &N_NEON::kOneLaneTable},
#endif
#if HWY_TARGETS & HWY_SCALAR
    {Target::scalar, HWY_SCALAR, &N_SCALAR::kTable, &N_SCALAR::kOneLaneTable},
#endif
};

bool has(const CompiledTarget& compiled) {
  // The portable fallback needs nothing of the CPU and is not always among what Highway reports.
  static const std::int64_t supported = hwy::SupportedTargets();
  return compiled.target == Target::scalar || (supported & compiled.highway) != 0;
}

}  // namespace

std::vector<Target> available_targets() {
  std::vector<Target> targets;
  for (const CompiledTarget& compiled : kCompiled)
    if (has(compiled)) targets.push_back(compiled.target);
  return targets;
}

std::optional<Target> resolve(Target target) {
  static const Target best = available_targets().front();
  if (target == Target::best) return best;
  for (const CompiledTarget& compiled : kCompiled)
    if (has(compiled) && target == compiled.target) return target;
  return std::nullopt;
}

const TargetKernels& kernels(Target target, bool one_lane) {
  const CompiledTarget* found = &kCompiled[0];
  for (const CompiledTarget& compiled : kCompiled)
    if (compiled.target == target) found = &compiled;
  return one_lane ? *found->one_lane : *found->table;
}

std::size_t vector_lanes(Target target) {
  return kernels(resolve(target).value_or(Target::scalar), false).vector_lanes;
}

}  // namespace facetwise
#endif  // HWY_ONCE
