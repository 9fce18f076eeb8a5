// SPDX-License-Identifier: Apache-2.0
// A BSDF that somebody else made, whose properties are to be proved.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "facetwise/engine.h"

namespace facetwise::prove {

// Lanes in columns, in the local frame: z is the shading normal; directions are of unit length and point away from the
// surface; pdfs are in 1/sr, values are f |cos(theta_o)|, weights value / pdf.
struct Lanes {
  explicit Lanes(std::size_t count)
      : ix(count),
        iy(count),
        iz(count),
        alpha_x(count),
        alpha_y(count),
        u1(count),
        u2(count),
        u3(count),
        ox(count),
        oy(count),
        oz(count),
        pdf(count),
        weight(count),
        value(count) {}
  std::size_t count() const { return ix.size(); }
  std::vector<float> ix, iy, iz, alpha_x, alpha_y, u1, u2, u3, ox, oy, oz, pdf, weight, value;
};

class Bsdf {
 public:
  virtual ~Bsdf() = default;
  virtual std::string name() const = 0;
  // Reads i, alpha and u, writes o, pdf and weight. An error: it could not be asked.
  virtual absl::Status sample(Lanes& lanes) = 0;
  // Reads i, alpha and o, writes pdf and value.
  virtual absl::Status evaluate(Lanes& lanes) = 0;
};

// A shared library with fw_plugin_open() (facetwise_plugin.h). NotFound: there is none such; FailedPrecondition: it is
// another version's.
absl::StatusOr<std::unique_ptr<Bsdf>> open_plugin(const std::string& path);

// A Python module, by its name or its file, with two functions of NumPy arrays: sample(i, alpha, u) -> (o, pdf, weight)
// and evaluate(i, alpha, o) -> (pdf, value), of shapes (n, 3) for directions and u, (n, 2) for alpha, (n,) for the rest. It
// runs in a process of its own, by `python` ("python3").
absl::StatusOr<std::unique_ptr<Bsdf>> open_python(const std::string& module, const std::string& python);

// An engine's model and sampler: reflections, and with a dielectric interface of this `eta` what is transmitted too. What
// scattering with transport of importance conserves, radiance does not: the model's transport should be importance.
std::unique_ptr<Bsdf> of_engine(std::string name, std::unique_ptr<Engine> engine, const Model& model, Sampler sampler,
                                float eta);

}  // namespace facetwise::prove
