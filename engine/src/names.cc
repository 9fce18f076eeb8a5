// SPDX-License-Identifier: Apache-2.0
// Names of the vocabulary's values, as used in flags, JSON and messages.
#include <array>
#include <utility>

#include "facetwise/batch.h"
#include "facetwise/model.h"
#include "facetwise/target.h"

namespace facetwise {
namespace {

template <class T>
struct Named {
  T value;
  std::string_view name;
};

constexpr Named<Distribution> kDistributions[] = {{Distribution::ggx, "ggx"},
                                                  {Distribution::beckmann, "beckmann"},
                                                  {Distribution::student_t, "student_t"},
                                                  {Distribution::phong, "phong"},
                                                  {Distribution::table, "table"}};
constexpr Named<Masking> kMaskings[] = {{Masking::smith, "smith"}, {Masking::vcavity, "vcavity"}};
constexpr Named<Shadowing> kShadowings[] = {{Shadowing::correlated, "correlated"},
                                            {Shadowing::uncorrelated, "uncorrelated"}};
constexpr Named<Normalisation> kNormalisations[] = {{Normalisation::unbiased, "unbiased"},
                                                    {Normalisation::biased, "biased"}};
constexpr Named<Interface> kInterfaces[] = {
    {Interface::conductor, "conductor"}, {Interface::schlick, "schlick"}, {Interface::dielectric, "dielectric"}};
constexpr Named<Transport> kTransports[] = {{Transport::radiance, "radiance"}, {Transport::importance, "importance"}};
constexpr Named<Compensation> kCompensations[] = {
    {Compensation::none, "none"}, {Compensation::turquin, "turquin"}, {Compensation::kelemen, "kelemen"}};
constexpr Named<Sampler> kSamplers[] = {{Sampler::ndf, "ndf"},     {Sampler::heitz, "heitz"},
                                        {Sampler::cap, "cap"},     {Sampler::bounded, "bounded"},
                                        {Sampler::exact, "exact"}, {Sampler::visible, "visible"}};
constexpr Named<LaneStatus> kStatuses[] = {{LaneStatus::accepted, "accepted"},
                                           {LaneStatus::occluded, "occluded"},
                                           {LaneStatus::smooth, "smooth"},
                                           {LaneStatus::invalid, "invalid"}};
constexpr Named<Target> kTargets[] = {{Target::best, "best"},
                                      {Target::scalar, "scalar"},
                                      {Target::avx2, "avx2"},
                                      {Target::avx3, "avx3"},
                                      {Target::neon, "neon"}};
constexpr Named<Operation> kOperations[] = {{Operation::sample_normal, "sample_normal"},
                                            {Operation::sample_reflection, "sample_reflection"},
                                            {Operation::pdf_reflection, "pdf_reflection"},
                                            {Operation::evaluate_reflection, "evaluate_reflection"},
                                            {Operation::masking, "masking"},
                                            {Operation::sample_transmission, "sample_transmission"},
                                            {Operation::evaluate_transmission, "evaluate_transmission"},
                                            {Operation::sample_scattering, "sample_scattering"},
                                            {Operation::evaluate_scattering, "evaluate_scattering"},
                                            {Operation::albedo, "albedo"}};

template <class T, std::size_t n>
std::string_view name_in(const Named<T> (&table)[n], T value) {
  for (const auto& row : table)
    if (row.value == value) return row.name;
  return "unknown";
}

template <class T, std::size_t n>
std::optional<T> parse_in(const Named<T> (&table)[n], std::string_view text) {
  for (const auto& row : table)
    if (row.name == text) return row.value;
  return std::nullopt;
}

}  // namespace

std::string_view name(Distribution value) { return name_in(kDistributions, value); }
std::string_view name(Masking value) { return name_in(kMaskings, value); }
std::string_view name(Shadowing value) { return name_in(kShadowings, value); }
std::string_view name(Normalisation value) { return name_in(kNormalisations, value); }
std::string_view name(Interface value) { return name_in(kInterfaces, value); }
std::string_view name(Transport value) { return name_in(kTransports, value); }
std::string_view name(Compensation value) { return name_in(kCompensations, value); }
std::string_view name(Sampler value) { return name_in(kSamplers, value); }
std::string_view name(LaneStatus value) { return name_in(kStatuses, value); }
std::string_view name(Target value) { return name_in(kTargets, value); }
std::string_view name(Operation value) { return name_in(kOperations, value); }

std::optional<Distribution> parse_distribution(std::string_view text) { return parse_in(kDistributions, text); }
std::optional<Masking> parse_masking(std::string_view text) { return parse_in(kMaskings, text); }
std::optional<Shadowing> parse_shadowing(std::string_view text) { return parse_in(kShadowings, text); }
std::optional<Normalisation> parse_normalisation(std::string_view text) { return parse_in(kNormalisations, text); }
std::optional<Interface> parse_interface(std::string_view text) { return parse_in(kInterfaces, text); }
std::optional<Transport> parse_transport(std::string_view text) { return parse_in(kTransports, text); }
std::optional<Compensation> parse_compensation(std::string_view text) { return parse_in(kCompensations, text); }
std::optional<Sampler> parse_sampler(std::string_view text) { return parse_in(kSamplers, text); }
std::optional<Target> parse_target(std::string_view text) { return parse_in(kTargets, text); }
std::optional<Operation> parse_operation(std::string_view text) { return parse_in(kOperations, text); }

std::span<const Sampler> all_samplers() {
  static constexpr std::array kAll = {Sampler::ndf,     Sampler::heitz, Sampler::cap,
                                      Sampler::bounded, Sampler::exact, Sampler::visible};
  return kAll;
}

std::span<const Operation> all_operations() {
  static constexpr auto kAll = [] {
    std::array<Operation, std::size(kOperations)> all{};
    for (std::size_t k = 0; k < all.size(); ++k) all[k] = kOperations[k].value;
    return all;
  }();
  return kAll;
}

bool samples_normals(Sampler sampler) { return sampler != Sampler::bounded && sampler != Sampler::exact; }

bool uses_u3(const Model& model, Sampler sampler) {
  if (model.compensation == Compensation::kelemen) return true;
  if (sampler == Sampler::exact) return model.distribution != Distribution::beckmann || model.masking != Masking::smith;
  if (sampler != Sampler::visible) return false;
  return model.masking == Masking::vcavity;
}

}  // namespace facetwise
