// SPDX-License-Identifier: Apache-2.0
// Tables of directional albedo: what share of the light from i a rough surface reflects by one scattering, with F = 1.
// What is missing in it is scattered again inside the surface, and is what energy compensation puts back. docs/albedo.md
// has the design and the measured errors.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "facetwise/batch.h"

namespace facetwise {

// Numbers of nodes. v, a, r, t, e: docs/albedo.md.
struct AlbedoSizes {
  std::uint32_t v = 129, a = 129;                                        // of isotropic roughness
  std::uint32_t ratio_v = 33, ratio_a = 65, ratio_r = 17, ratio_t = 17;  // of anisotropic over isotropic; dielectric: 0
  std::uint32_t e = 0;                                                   // of a dielectric's eta, else 0
  bool dielectric() const { return e != 0; }
  std::size_t isotropic() const { return std::size_t{v} * a; }
  std::size_t ratio() const { return std::size_t{ratio_v} * ratio_a * ratio_r * ratio_t; }
  std::size_t mean() const { return std::size_t{a} * (dielectric() ? e : ratio_r); }
  // A dielectric has two values a node.
  std::size_t total() const { return dielectric() ? 2 * isotropic() * e + mean() : isotropic() + ratio() + mean(); }
  bool operator==(const AlbedoSizes&) const = default;
};
inline constexpr AlbedoSizes kDielectricAlbedo{65, 33, 0, 0, 0, 0, 65};

// What kernels read.
struct AlbedoTableView {
  const float* isotropic;  // E(v, a): [a][v]
  const float* ratio;      // E(v, a, r, t) / E(v, a): [t][r][a][v]
  const float* mean;       // the cosine-weighted average of E over the hemisphere: [r][a]; dielectric: [e][a]
  // Of a dielectric, instead of the first two: what is reflected and transmitted together, [e][a][v]; and what share of
  // it is reflected, less Fresnel's reflectance of a smooth surface, [e][a][u], u = sqrt(i_z).
  const float *both, *share;
  AlbedoSizes sizes;
  float inverse_range;  // 1 / (alpha / (1 + alpha)) of the largest roughness
};

// Immutable; any number of threads may use one.
class AlbedoTable {
 public:
  struct Options {
    AlbedoSizes sizes{}, dielectric_sizes = kDielectricAlbedo;
    // Samples a node of `ratio` and of a dielectric's, a power of two; nodes of `isotropic` have 32 times as many. Four
    // times both for V-cavity without an `exact` sampler.
    std::size_t samples = 512;
    // Told the fraction done, rising to 1; one call at a time, from any thread.
    std::function<void(double)> progress{};
  };

  // Computes a model's table in the caller's TBB arena: the same bits on every machine. Of the model its distribution,
  // masking, shadowing and table of slopes matter, and whether it is a dielectric. InvalidArgument: a model without
  // visible normals, a table of slopes that is not radial, sizes that no table has.
  static absl::StatusOr<std::shared_ptr<const AlbedoTable>> build(const Model& model, const Options& options);

  // As SlopeTable's. The bytes name the model; a table of slopes by SlopeTable::id().
  std::string serialise() const;
  static absl::StatusOr<std::shared_ptr<const AlbedoTable>> parse(std::string_view bytes);
  absl::Status save(const std::string& path) const;
  static absl::StatusOr<std::shared_ptr<const AlbedoTable>> load(const std::string& path);

  const AlbedoTableView& view() const { return view_; }
  // Whether it is this model's.
  bool fits(const Model& model) const;
  // "ggx with smith masking, correlated shadowing"
  std::string description() const;

  AlbedoTable(const AlbedoTable&) = delete;
  AlbedoTable& operator=(const AlbedoTable&) = delete;

  // Which model a table is of.
  struct Key {
    Distribution distribution;
    Masking masking;
    Shadowing shadowing;
    std::uint64_t slopes;  // SlopeTable::id(), else 0
    bool dielectric;
    bool operator==(const Key&) const = default;
  };
  static Key key_of(const Model& model);
  const Key& key() const { return key_; }

 private:
  friend struct AlbedoTableMaker;
  AlbedoTable() = default;
  std::vector<float> values_;
  AlbedoTableView view_{};
  Key key_{};
};

// Whether an operation has Kelemen's lobe beside the model's own.
constexpr bool has_lobe(Operation operation, const Model& model) {
  return model.compensation == Compensation::kelemen &&
         (operation == Operation::sample_reflection || operation == Operation::pdf_reflection ||
          operation == Operation::evaluate_reflection);
}
// Whether an operation reads the model's table: albedo, and those that its compensation changes.
constexpr bool reads_albedo(Operation operation, const Model& model) {
  return operation == Operation::albedo || has_lobe(operation, model) ||
         (model.compensation == Compensation::turquin &&
          (operation == Operation::sample_reflection || operation == Operation::evaluate_reflection ||
           scatters(operation)));
}

// The table that calls use for a model, kept for the life of the process: built with the default options on first use
// (seconds; other calls that need it wait), unless use_albedo_table() has put one in its place.
absl::StatusOr<std::shared_ptr<const AlbedoTable>> albedo_table(const Model& model,
                                                                const std::function<void(double)>& progress = {});
void use_albedo_table(std::shared_ptr<const AlbedoTable> table);
// Forgets those of a table of slopes, by SlopeTable::id(). Calls that use one finish with it.
void drop_albedo_tables(std::uint64_t slopes);

}  // namespace facetwise
