// SPDX-License-Identifier: Apache-2.0
// Which models, samplers and operations fit together: those for which there is a kernel.
#include "src/composition.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "facetwise/slope_table.h"
#include "facetwise/target.h"
#include "src/tile.h"

namespace facetwise {
namespace {

absl::Status invalid(absl::string_view field, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat(field, ": ", what));
}

absl::string_view view(std::string_view text) { return {text.data(), text.size()}; }

template <class T>
absl::string_view named(T value) {
  return view(name(value));
}

bool evaluates(Operation operation) {
  return operation == Operation::evaluate_reflection || operation == Operation::evaluate_transmission ||
         operation == Operation::evaluate_scattering;
}

const SurfaceKernels& surface_of(const DistributionKernels& kernels, Masking masking, bool affine) {
  static constexpr SurfaceKernels kNone{};
  if (masking == Masking::vcavity) return affine ? kNone : kernels.vcavity;
  return affine ? kernels.smith_affine : kernels.smith;
}

// Every target has kernels for the same compositions.
const TargetKernels& any_kernels() {
  static const TargetKernels& table = kernels(*resolve(Target::best), false);
  return table;
}

const DistributionKernels& kernels_of(Distribution distribution) {
  return *any_kernels().distribution[static_cast<std::size_t>(distribution)];
}

std::string model_name(const Model& model) {
  return absl::StrCat(named(model.distribution), " with ", named(model.masking), " masking");
}

std::string names_of(const std::vector<Sampler>& samplers) {
  return absl::StrJoin(samplers, ", ", [](std::string* out, Sampler sampler) { absl::StrAppend(out, named(sampler)); });
}

std::vector<Sampler> samplers_for(Operation operation, const Model& model, bool affine) {
  std::vector<Sampler> samplers;
  const TargetKernels& table = any_kernels();
  for (const Sampler sampler : all_samplers())
    if (has_sampler(operation) && find_kernel(table, operation, model, sampler, affine)) samplers.push_back(sampler);
  return samplers;
}

}  // namespace

Sampler sampler_of(Operation operation, const Batch& batch) {
  const bool reads_it = has_sampler(operation) && (!evaluates(operation) || batch.out.pdf.present());
  return reads_it ? batch.sampler : Sampler::visible;
}

Kernel find_kernel(const TargetKernels& table, Operation operation, const Model& model, Sampler sampler, bool affine,
                   bool ahead) {
  const SurfaceKernels& surface = find_surface(table, model, affine);
  const auto index = static_cast<std::size_t>(sampler);
  switch (operation) {
    case Operation::sample_normal: return samples_normals(sampler) ? surface.sample[index] : nullptr;
    case Operation::sample_reflection:
      return ahead && surface.sample_ahead[index] ? surface.sample_ahead[index] : surface.sample[index];
    case Operation::pdf_reflection:
    case Operation::evaluate_reflection: return surface.query[index];
    case Operation::masking: return surface.masking;
    case Operation::sample_transmission:
    case Operation::sample_scattering: return surface.scatter[index];
    case Operation::evaluate_transmission:
    case Operation::evaluate_scattering: return surface.scatter_query[index];
    case Operation::albedo: return surface.albedo;
  }
  return nullptr;
}

const SurfaceKernels& find_surface(const TargetKernels& table, const Model& model, bool affine) {
  return surface_of(*table.distribution[static_cast<std::size_t>(model.distribution)], model.masking, affine);
}

std::vector<Sampler> samplers_for(Operation operation, const Model& model) {
  return samplers_for(operation, model, false);
}

Sampler default_sampler(Operation operation, const Batch& batch) {
  const bool exact = operation <= Operation::albedo && has_sampler(operation) &&
                     find_kernel(any_kernels(), operation, batch.model, Sampler::exact, is_affine(batch));
  return exact ? Sampler::exact : Sampler::visible;
}

std::vector<Model> all_models(const std::shared_ptr<const SlopeTable>& table) {
  std::vector<Model> models;
  for (const Masking masking : {Masking::smith, Masking::vcavity})
    for (std::size_t k = 0; k < std::size(any_kernels().distribution); ++k) {
      Model model{.distribution = static_cast<Distribution>(k), .masking = masking};
      if (model.distribution == Distribution::table) {
        // V-cavity's grooves are the same on both sides.
        if (table == nullptr || (masking == Masking::vcavity && !table->radial())) continue;
        model.table = table;
      }
      if (!samplers_for(Operation::sample_normal, model).empty()) models.push_back(model);
    }
  return models;
}

bool takes_slopes(const Model& model) {
  return surface_of(kernels_of(model.distribution), model.masking, true).masking != nullptr;
}

absl::Status check_composition(Operation operation, const Batch& batch) {
  const Model& model = batch.model;
  if (operation > Operation::albedo) return invalid("operation", "unknown value");
  if (model.distribution > Distribution::table) return invalid("model.distribution", "unknown value");
  if (model.masking > Masking::vcavity) return invalid("model.masking", "unknown value");
  if (model.shadowing > Shadowing::uncorrelated) return invalid("model.shadowing", "unknown value");
  if (model.normalisation > Normalisation::biased) return invalid("model.normalisation", "unknown value");
  if (model.interface > Interface::dielectric) return invalid("model.interface", "unknown value");
  if (model.transport > Transport::importance) return invalid("model.transport", "unknown value");
  if (model.compensation > Compensation::kelemen) return invalid("model.compensation", "unknown value");
  if (batch.sampler > Sampler::visible) return invalid("sampler", "unknown value");

  const DistributionKernels& distribution = kernels_of(model.distribution);
  const bool affine = is_affine(batch);
  if (!surface_of(distribution, model.masking, false).masking)
    return invalid("model.masking",
                   absl::StrCat(named(model.distribution), " has no projected area in closed form, which ",
                                "Smith needs; it takes vcavity, or a table of it"));
  const bool table = model.distribution == Distribution::table;
  if (table != (model.table != nullptr))
    return invalid("model.table",
                   table ? "missing: the distribution `table` needs it" : "given, but the distribution is not `table`");
  if (scatters(operation) && model.interface != Interface::dielectric)
    return invalid("model.interface", absl::StrCat(named(operation), " needs a dielectric; this is a ",
                                                   named(model.interface), " one, which transmits nothing"));
  if (affine && !surface_of(distribution, model.masking, true).masking) {
    const absl::string_view field = batch.mean_slope_x.present()   ? "mean_slope_x"
                                    : batch.mean_slope_y.present() ? "mean_slope_y"
                                                                   : "slope_correlation";
    return invalid(field, absl::StrCat(model_name(model), " does not take it; ggx, beckmann and table with smith do"));
  }
  const bool skewed = model.table != nullptr && !model.table->radial();
  if (skewed && model.masking == Masking::vcavity)
    return invalid("model.masking",
                   "vcavity needs a density that is the same on both sides of a groove: a radial table");
  if (skewed && batch.slope_correlation.present())
    return invalid("slope_correlation", "correlated roughness needs a radial table");
  if (skewed && model.retro)
    return invalid("model.retro", "needs normals that are distributed symmetrically about n: a radial table");
  if (model.retro && (batch.mean_slope_x.present() || batch.mean_slope_y.present()))
    return invalid("model.retro", "needs normals that are distributed symmetrically about n: not with a mean slope");

  const bool asymmetric = skewed || batch.mean_slope_x.present() || batch.mean_slope_y.present();
  constexpr absl::string_view kSymmetric =
      "needs normals that are distributed symmetrically about n: no mean slope, a radial table";
  if (operation == Operation::albedo && asymmetric)
    return invalid(skewed                         ? "model.table"
                   : batch.mean_slope_x.present() ? "mean_slope_x"
                                                  : "mean_slope_y",
                   absl::StrCat("albedo ", kSymmetric));
  if (model.compensation != Compensation::none) {
    const absl::string_view compensation = named(model.compensation);
    if (model.interface == Interface::dielectric && model.compensation == Compensation::kelemen)
      return invalid("model.compensation",
                     "kelemen needs a conductor or schlick interface; turquin takes a dielectric");
    if (asymmetric) return invalid("model.compensation", absl::StrCat(compensation, " ", kSymmetric));
  }

  if (find_kernel(any_kernels(), operation, model, sampler_of(operation, batch), affine)) return absl::OkStatus();
  const char* with = !affine                             ? ""
                     : batch.slope_correlation.present() ? " and correlated roughness"
                                                         : " and a mean slope";
  return invalid("sampler",
                 absl::StrCat(named(batch.sampler), " does not fit ", named(operation), " of ", model_name(model), with,
                              "; what does: ", names_of(samplers_for(operation, model, affine))));
}

}  // namespace facetwise
