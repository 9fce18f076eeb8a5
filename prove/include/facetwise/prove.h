// SPDX-License-Identifier: Apache-2.0
// Does a BSDF keep its promises? Each property is a number that is measured in every configuration, and a bound.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "facetwise/bsdf.h"

namespace facetwise::prove {

enum class Property : std::uint8_t {
  numbers,  // every number is finite, no pdf, weight or value negative: at grazing and normal incidence, u at its ends
  garbage,  // the same for inputs that are none: NaN, infinite, below the surface, no roughness. Asked for by `strict`
  directions,    // what is drawn has unit length
  density,       // the pdf's integral over the sphere is the share of samples that draw something
  distribution,  // samples follow the pdf (Pearson's chi-square)
  pdf,           // sample() and evaluate() agree on it
  weight,        // a sample's weight is value / pdf
  albedo,        // the mean weight is the value's integral
  energy,        // no more light leaves than arrives
  reciprocity,   // f(i, o) = f(o, i), of reflections
};
std::span<const Property> all_properties();
std::string_view name(Property property);
std::string_view meaning(Property property);  // one sentence

struct Configuration {
  double theta = 0, phi = 0;  // of i, degrees
  float alpha_x = 0, alpha_y = 0;
};
std::string label(const Configuration& configuration);  // "theta 60, alpha 0.3, 0.3"

// What came out for one property in one configuration.
struct Finding {
  Property property;
  bool holds = true;
  double measured = 0, wanted = 0, allowed = 0;  // of what `what` names; `allowed`: how far from `wanted`
  std::string what{};                            // "integral of the pdf 1.2347 instead of 0.9521"
  std::string where{};                           // the lane that is worst, if it is a lane's property
};

// Cells of the directions o: by theta in [0, 180] degrees, kPhis to a row, and by phi.
inline constexpr int kThetas = 64, kPhis = 128;
struct Examined {
  Configuration configuration;
  std::vector<Finding> findings;
  // For pictures: how many samples each cell has, and how many the pdf lets expect.
  std::vector<std::uint64_t> counts;
  std::vector<double> expected;
};

struct Proof {
  std::string bsdf;
  std::size_t samples = 0;            // per configuration
  std::vector<Finding> everywhere{};  // numbers and garbage
  std::vector<Examined> examined{};

  bool holds() const;
  // How a property did in all: how many findings, how many that fail, and the worst of them (null: it was not asked for).
  struct Summary {
    int tried = 0, failed = 0;
    const Finding* worst = nullptr;
    const Configuration* at = nullptr;
  };
  Summary summary(Property property) const;
};

struct Options {
  std::size_t samples = std::size_t{1} << 20;
  std::uint64_t seed = 1;
  bool strict = false;
  std::vector<Configuration> configurations;
  double significance = 1e-6;              // that a right BSDF fails any chi-square test
  std::function<void(double)> progress{};  // the fraction done
};

// An error is the BSDF's own: it could not be asked, or wrote no answer.
absl::StatusOr<Proof> prove(Bsdf& bsdf, const Options& options);

// A page in one file, with pictures of the densities; needs no network.
std::string page(const Proof& proof);
std::string to_json(const Proof& proof);

}  // namespace facetwise::prove
