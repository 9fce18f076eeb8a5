// SPDX-License-Identifier: Apache-2.0
#include "case.h"

#include <re2/re2.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "bench/baseline/baseline.h"
#include "facetwise/slope_table.h"
#include "runner.h"

namespace facetwise::bench {
namespace {

constexpr std::size_t kBatch = 65536, kLargestBatch = kFreshLanes;
constexpr std::size_t kBatches[] = {256, 4096, kBatch, std::size_t{1} << 20, kLargestBatch};
// How the kernels scale, beside kBatches: the last needs gigabytes.
constexpr std::size_t kQuickScaling[] = {1024, std::size_t{1} << 20, kLargestBatch};
constexpr std::size_t kStandardScaling[] = {1024, std::size_t{16384}, 100000000};
// Mixed roughness first (Case).
constexpr std::pair<float, float> kAlphas[] = {{0, 0}, {0.3f, 0.3f}, {0.8f, 0.1f}, {0.01f, 0.01f}, {1.0f, 1.0f}};
constexpr Implementation kImplementations[] = {Implementation::scalar,       Implementation::auto_vectorised,
                                               Implementation::one_lane,     Implementation::simd,
                                               Implementation::simd_threads, Implementation::remote};
constexpr Sampler kReflectionSamplers[] = {Sampler::bounded, Sampler::exact};
// Those whose speed in memory is shown: the simplest, and facetwise's own.
constexpr Sampler kMemorySamplers[] = {Sampler::cap, Sampler::exact};
// GGX's with Smith masking: `visible` is `cap`.
constexpr Sampler kGgxSamplers[] = {Sampler::ndf, Sampler::heitz, Sampler::cap, Sampler::bounded, Sampler::exact};

bool has_baseline(const Case& which) {
  if (which.inputs == Inputs::generator) return false;  // it takes its random numbers only from columns
  if (which.scatters() || which.operation == Operation::albedo) return false;
  const baseline::Model model{which.distribution, which.masking};
  if (which.sampler) return baseline::has_baseline(model, *which.sampler);
  return baseline::has_baseline(model, Sampler::ndf) &&
         (which.operation != Operation::masking || which.masking == Masking::smith);
}

// One roughness for all lanes and generated numbers are not in its loops.
bool has_auto(const Case& which) {
  return which.is_ggx_smith() && has_baseline(which) && which.inputs != Inputs::one_roughness;
}

// Whether a case's columns leave half of the free memory free.
bool fits_into_memory(const Case& which) {
  const double bytes = 4.0 * (which.input_columns() + which.output_columns()) * static_cast<double>(which.lanes());
  const double free = static_cast<double>(sysconf(_SC_AVPHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
  return 2 * bytes < free;
}

class List {
 public:
  // The kernels only, on one thread and on all.
  void add_simd(Case which) {
    if (which.batch > kLargestBatch && !fits_into_memory(which)) return;
    for (const Implementation implementation : {Implementation::simd, Implementation::simd_threads}) {
      which.implementation = implementation;
      cases_.push_back(which);
    }
  }
  // Every implementation that can run `which`.
  void add(Case which) {
    for (const Implementation implementation : kImplementations) {
      which.implementation = implementation;
      if (implementation == Implementation::scalar && !has_baseline(which)) continue;
      if (implementation == Implementation::auto_vectorised && !has_auto(which)) continue;
      cases_.push_back(which);
    }
  }
  std::vector<Case> take() { return std::move(cases_); }

 private:
  std::vector<Case> cases_;
};

// Operations with the samplers they take.
std::vector<Case> operations(std::span<const Sampler> query_samplers, std::span<const Sampler> normal_samplers) {
  std::vector<Case> cases;
  for (const Sampler sampler : normal_samplers)
    cases.push_back({.operation = Operation::sample_normal, .sampler = sampler});
  for (const Sampler sampler : query_samplers)
    cases.push_back({.operation = Operation::pdf_reflection, .sampler = sampler});
  cases.push_back({.operation = Operation::evaluate_reflection, .sampler = std::nullopt});
  for (const Sampler sampler : query_samplers)
    cases.push_back({.operation = Operation::evaluate_reflection, .sampler = sampler});
  cases.push_back({.operation = Operation::masking, .sampler = std::nullopt});
  return cases;
}

// Every operation of the other models, a table of slopes among them, with every sampler that fits, and scattering of all.
std::vector<Case> model_cases() {
  std::vector<Case> cases;
  const auto add = [&](Operation operation, Distribution distribution, Masking masking) {
    const Case which{.operation = operation, .distribution = distribution, .masking = masking, .sampler = std::nullopt};
    const auto samplers = samplers_for(operation, which.model());
    if (operation == Operation::evaluate_reflection || !has_sampler(operation)) cases.push_back(which);
    for (const Sampler sampler : samplers) {
      if (which.is_ggx_smith() && sampler == Sampler::visible) continue;
      cases.push_back(which);
      cases.back().sampler = sampler;
    }
  };
  for (const Model& model : all_models(measured_table()))
    if (model.distribution != Distribution::ggx || model.masking != Masking::smith)
      for (const Operation operation : all_operations()) add(operation, model.distribution, model.masking);
  for (const Operation operation : all_operations())
    if (operation >= Operation::sample_transmission) add(operation, Distribution::ggx, Masking::smith);  // and albedo
  return cases;
}

// What shows the other models: reflections by visible normals, and by those that are not occluded.
void add_shown_models(List& list, float alpha_x, float alpha_y) {
  for (Case which : model_cases()) {
    if (which.operation != Operation::sample_reflection || which.sampler == Sampler::ndf) continue;
    which.alpha_x = alpha_x;
    which.alpha_y = alpha_y;
    list.add(which);
  }
}

std::vector<Case> quick_cases() {
  List list;
  for (const Sampler sampler : kGgxSamplers) list.add({.sampler = sampler});
  for (int k = 1; k < 3; ++k)
    for (const Sampler sampler : kReflectionSamplers)
      list.add({.sampler = sampler, .alpha_x = kAlphas[k].first, .alpha_y = kAlphas[k].second});
  for (const Sampler sampler : kMemorySamplers)
    for (const std::size_t batch : kQuickScaling) list.add_simd({.sampler = sampler, .batch = batch});
  add_shown_models(list, kAlphas[0].first, kAlphas[0].second);
  return list.take();
}

std::vector<Case> standard_cases() {
  List list;
  for (int k = 0; k < 3; ++k)
    for (const Sampler sampler : kGgxSamplers)
      list.add({.sampler = sampler, .alpha_x = kAlphas[k].first, .alpha_y = kAlphas[k].second});
  for (const Sampler sampler : kMemorySamplers)
    for (const std::size_t batch : kBatches)
      if (batch != kBatch) list.add({.sampler = sampler, .batch = batch});
  for (const Sampler sampler : kMemorySamplers)
    for (const std::size_t batch : kStandardScaling) list.add_simd({.sampler = sampler, .batch = batch});
  for (const std::size_t batch : {kBatch, kLargestBatch})
    for (const Sampler sampler : kMemorySamplers)
      list.add({.sampler = sampler, .batch = batch, .inputs = Inputs::malloc_placed});
  for (const Sampler sampler : kMemorySamplers)
    list.add({.sampler = sampler, .batch = std::size_t{1} << 20, .inputs = Inputs::fresh});
  for (const Inputs inputs : {Inputs::one_roughness, Inputs::generator, Inputs::backfacing})
    for (const Sampler sampler : kReflectionSamplers)
      list.add({.sampler = sampler, .alpha_x = kAlphas[1].first, .alpha_y = kAlphas[1].second, .inputs = inputs});
  constexpr Sampler kNormals[] = {Sampler::cap};
  for (const Case& which : operations(kReflectionSamplers, kNormals)) list.add(which);
  for (int k = 0; k < 2; ++k) add_shown_models(list, kAlphas[k].first, kAlphas[k].second);
  // Of the rest, what a path tracer calls with visible normals.
  for (const Case& which : model_cases()) {
    const bool called = which.operation == Operation::sample_scattering ||
                        (which.operation == Operation::evaluate_reflection && which.masking == Masking::smith);
    if (called && (which.sampler == Sampler::visible || which.sampler == Sampler::cap)) list.add(which);
  }
  return list.take();
}

std::vector<Case> all_cases() {
  List list;
  constexpr Sampler kNormals[] = {Sampler::ndf, Sampler::heitz, Sampler::cap};
  for (const std::size_t batch : kBatches) {
    for (const auto& [alpha_x, alpha_y] : kAlphas) {
      for (const Inputs inputs : {Inputs::columns, Inputs::malloc_placed, Inputs::fresh, Inputs::one_roughness,
                                  Inputs::generator, Inputs::backfacing}) {
        // There is no one mixed roughness, and the largest batch is fresh as it is.
        if (inputs == Inputs::one_roughness && alpha_x == 0) continue;
        if (inputs == Inputs::fresh && batch == kLargestBatch) continue;
        for (const Sampler sampler : kGgxSamplers)
          list.add({.sampler = sampler, .alpha_x = alpha_x, .alpha_y = alpha_y, .batch = batch, .inputs = inputs});
      }
      for (Case which : operations(kGgxSamplers, kNormals)) {
        which.alpha_x = alpha_x;
        which.alpha_y = alpha_y;
        which.batch = batch;
        list.add(which);
      }
    }
  }
  for (const Sampler sampler : kMemorySamplers)
    for (const std::size_t batch : kStandardScaling) list.add_simd({.sampler = sampler, .batch = batch});
  for (const auto& [alpha_x, alpha_y] : kAlphas)
    for (Case which : model_cases()) {
      which.alpha_x = alpha_x;
      which.alpha_y = alpha_y;
      list.add(which);
    }
  return list.take();
}

}  // namespace

std::string_view name(Implementation implementation) {
  switch (implementation) {
    case Implementation::scalar: return "scalar";
    case Implementation::auto_vectorised: return "auto";
    case Implementation::one_lane: return "one-lane";
    case Implementation::simd: return "simd";
    case Implementation::simd_threads: return "simd-threads";
    case Implementation::remote: return "remote";
  }
  return "";
}

std::string_view name(Inputs inputs) {
  switch (inputs) {
    case Inputs::columns: return "columns";
    case Inputs::malloc_placed: return "malloc";
    case Inputs::fresh: return "fresh";
    case Inputs::one_roughness: return "one-roughness";
    case Inputs::generator: return "generator";
    case Inputs::backfacing: return "backfacing";
  }
  return "";
}

const std::shared_ptr<const SlopeTable>& measured_table() {
  // Some density that no other distribution has: two Gaussians.
  static const std::shared_ptr<const SlopeTable> table = *SlopeTable::build(
      [](double x, double y) { return std::exp(-x * x - y * y) + std::exp(-(x * x + y * y) / 4); }, {.radial = true});
  return table;
}

int Case::input_columns() const {
  int columns = 3;  // incident
  if (inputs != Inputs::one_roughness) columns += 2;
  if (is_sampling()) {
    if (inputs != Inputs::generator) columns += uses_u3() ? 3 : 2;
  } else if (has_outgoing()) {
    columns += 3;  // outgoing
  }
  return columns;
}

int Case::output_columns() const {
  if (is_sampling()) return 4;  // a direction and its pdf
  return (operation == Operation::evaluate_reflection && sampler) || scatters() ? 2 : 1;
}

bool Case::comparable(const Case& other) const {
  return operation == other.operation && distribution == other.distribution && masking == other.masking &&
         sampler == other.sampler && alpha_x == other.alpha_x && alpha_y == other.alpha_y && batch == other.batch &&
         inputs == other.inputs;
}

BenchResult describe(const Case& which) {
  BenchResult result;
  result.operation = which.operation;
  result.distribution = std::string(facetwise::name(which.distribution));
  result.masking = std::string(facetwise::name(which.masking));
  result.sampler = which.sampler ? std::string(facetwise::name(*which.sampler)) : "none";
  // As the decimal that was written, not as the nearest float.
  const auto decimal = [](float value) {
    double parsed = 0;
    (void)absl::SimpleAtod(absl::StrCat(value), &parsed);
    return parsed;
  };
  result.alpha_x = decimal(which.alpha_x);
  result.alpha_y = decimal(which.alpha_y);
  result.implementation = std::string(name(which.implementation));
  result.inputs = std::string(name(which.inputs));
  result.batch = result.samples = which.batch;
  result.bytes_per_sample = 4.0 * (which.input_columns() + which.output_columns());
  return result;
}

absl::StatusOr<std::vector<Case>> choose_cases(const BenchOptions& options) {
  RE2::Options quiet;
  quiet.set_log_errors(false);
  const RE2 filter(options.filter, quiet);
  if (!filter.ok())
    return absl::InvalidArgumentError(
        absl::StrCat("filter: \"", options.filter, "\" is not a regular expression: ", filter.error()));
  std::vector<Case> cases;
  if (options.suite == BenchSuite::quick)
    cases = quick_cases();
  else if (options.suite == BenchSuite::full || !options.filter.empty())
    cases = all_cases();
  else
    cases = standard_cases();
  if (options.remote == nullptr)
    std::erase_if(cases, [](const Case& which) { return which.implementation == Implementation::remote; });
  const Target target = resolve(options.target).value_or(Target::scalar);
  if (!has_auto_loops(target))
    std::erase_if(cases, [](const Case& which) { return which.implementation == Implementation::auto_vectorised; });
  std::erase_if(cases, [&](const Case& which) { return !RE2::PartialMatch(describe(which).name(), filter); });
  if (cases.empty())
    return absl::InvalidArgumentError(
        absl::StrCat("filter: \"", options.filter, "\" matches none of the benchmarks, whose names are like ",
                     "\"sample_reflection/bounded/mixed/65536/simd\"",
                     options.remote == nullptr ? " (and /remote only where a server is given)" : ""));
  return cases;
}

int flops(const Case& which) {
  if (!which.is_ggx_smith() || which.scatters() || which.operation == Operation::albedo) return 0;
  const bool isotropic = which.alpha_x == which.alpha_y && !which.is_mixed();
  constexpr int kLength = 6, kPrepare = 9, kSinCos = 19, kReflect = 8, kBound = 20, kShadowing = 17;
  const int cone = isotropic ? 28 : 80;
  if (which.operation == Operation::masking) return kLength + kPrepare + 2;
  if (which.is_sampling()) {
    int draw = 0;
    switch (*which.sampler) {
      case Sampler::ndf: draw = 26; break;
      case Sampler::heitz: draw = 56; break;
      case Sampler::cap:
      case Sampler::visible: draw = 31; break;
      case Sampler::bounded: draw = 31 + kBound; break;
      case Sampler::exact: draw = cone + (isotropic ? 60 : 62); break;
    }
    const int normal = which.operation == Operation::sample_normal ? 8 : 0;
    return kLength + kPrepare + kSinCos + draw + kReflect + normal;
  }
  constexpr int kDensity = kPrepare + 2 * kLength + 29;
  int sum = kDensity;
  if (which.operation != Operation::pdf_reflection) sum += kShadowing;
  if (which.sampler) {
    switch (*which.sampler) {
      case Sampler::ndf: sum += 5; break;
      case Sampler::heitz:
      case Sampler::cap:
      case Sampler::visible: sum += 2; break;
      case Sampler::bounded: sum += 2 + kBound; break;
      case Sampler::exact: sum += 1 + cone; break;
    }
  }
  return sum;
}

}  // namespace facetwise::bench
