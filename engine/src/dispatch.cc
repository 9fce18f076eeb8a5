// One table of kernels per target; the choice between them. The only file that knows Highway's targets.
#include <type_traits>
#include <vector>

#include "facetwise/target.h"
#include "src/tile.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/dispatch.cc"
#include "hwy/foreach_target.h"  // IWYU pragma: keep

#include "hwy/highway.h"
#include "src/kernels/operations-inl.h"
#include "src/math/philox-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

template <class D, class Sampler, bool kNormal>
constexpr Kernel SampleKernel() {
  return ForEachVector<D, Sample<D, Sampler, kNormal>>;
}
template <class D, class Sampler, bool kValue, bool kPdf>
constexpr Kernel QueryKernel() {
  return ForEachVector<D, Query<D, Sampler, kValue, kPdf>>;
}

// D: the tag of one vector. Two: that of the sampler with the longest chain, which gains by 15 % from pairs;
// the others lose up to 9 % by them where registers are few.
template <class D, class Two>
constexpr KernelTable MakeTable() {
  return {
      .sample_normal = {SampleKernel<D, Ndf, true>(), SampleKernel<D, Heitz, true>(), SampleKernel<D, Cap, true>(),
                        nullptr, nullptr},
      .sample_reflection = {SampleKernel<D, Ndf, false>(), SampleKernel<D, Heitz, false>(),
                            SampleKernel<D, Cap, false>(), SampleKernel<D, Bounded, false>(),
                            SampleKernel<Two, Exact, false>()},
      // heitz and cap have one density.
      .pdf_reflection = {QueryKernel<D, Ndf, false, true>(), QueryKernel<D, Cap, false, true>(),
                         QueryKernel<D, Cap, false, true>(), QueryKernel<D, Bounded, false, true>(),
                         QueryKernel<D, Exact, false, true>()},
      .evaluate_reflection = QueryKernel<D, Cap, true, false>(),
      .evaluate_and_pdf = {QueryKernel<D, Ndf, true, true>(), QueryKernel<D, Cap, true, true>(),
                           QueryKernel<D, Cap, true, true>(), QueryKernel<D, Bounded, true, true>(),
                           QueryKernel<D, Exact, true, true>()},
      .masking = ForEachVector<D, MaskingOf<D>>,
      .philox = Philox<D>,
      .vector_lanes = hn::MaxLanes(D()),
  };
}

extern const KernelTable kTable;
extern const KernelTable kOneLaneTable;
const KernelTable kTable = MakeTable<hn::ScalableTag<float>, Twice<hn::ScalableTag<float>>>();
const KernelTable kOneLaneTable = MakeTable<hn::CappedTag<float, 1>, hn::CappedTag<float, 1>>();

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace facetwise {
namespace {

struct CompiledTarget {
  Target target;
  std::int64_t highway;
  const KernelTable* table;
  const KernelTable* one_lane;
};

// Best first.
constexpr CompiledTarget kCompiled[] = {
#if HWY_TARGETS & HWY_AVX3
    {Target::avx3, HWY_AVX3, &N_AVX3::kTable, &N_AVX3::kOneLaneTable},
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
  for (const CompiledTarget& compiled : kCompiled)
    if (has(compiled) && (target == Target::best || target == compiled.target)) return compiled.target;
  return std::nullopt;
}

const KernelTable& kernels(Target target, bool one_lane) {
  const CompiledTarget* found = &kCompiled[0];
  for (const CompiledTarget& compiled : kCompiled)
    if (compiled.target == target) found = &compiled;
  return one_lane ? *found->one_lane : *found->table;
}

std::size_t vector_lanes(Target target) { return kernels(resolve(target).value_or(Target::scalar), false).vector_lanes; }

}  // namespace facetwise
#endif  // HWY_ONCE
