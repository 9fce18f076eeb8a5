// SPDX-License-Identifier: Apache-2.0
// What the experiments share: references, errors, progress.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "facetwise/experiments.h"
#include "facetwise/render.h"

namespace facetwise::experiments {

// Steps of an experiment, for its progress.
class Steps {
 public:
  Steps(const Options& options, double total) : options_(options), total_(total) {}
  // Says what begins; `weight` of the total is done when the next step begins. The step renders that many pictures,
  // about equally long.
  absl::Status begin(std::string_view what, double weight = 1, int pictures = 1);
  // Progress of the step's next picture, in the form that render() asks for.
  std::function<bool(double)> picture();

 private:
  bool say(double done);

  const Options& options_;
  double total_, done_ = 0, weight_ = 0, said_ = 0;
  int pictures_ = 1, picture_ = 0;
  std::string what_;
};

inline std::string text(std::string_view view) { return std::string(view); }
std::string percent(double share);  // "1.86 %"
inline Verdict agrees(bool yes) { return yes ? Verdict::agrees : Verdict::differs; }
double share_rejected(const render::Picture& picture);
// A scene made by code, in the light probe that all experiments use: with much contrast, but without a sun.
absl::StatusOr<render::Scene> lit(std::string_view name);

// Renders here, on all cores. Cancelled if it was stopped.
absl::StatusOr<render::Picture> render_here(const render::Scene& scene, render::Settings settings, Steps& steps);

// A picture to measure errors against: two independent halves, whose difference bounds its own error.
struct Reference {
  render::Picture picture;
  double error = 0;  // RMSE of the mean, estimated: half the halves' difference
};
absl::StatusOr<Reference> reference(const render::Scene& scene, render::Settings settings, std::uint32_t samples,
                                    Steps& steps);

// Pictures for the report, all of one tone-mapping.
Pictures::One shown(const render::Picture& picture, std::string name, std::string caption, float exposure = 1);
// |a - b| in each pixel, `scale` times, as a picture.
Pictures::One difference(const render::Picture& a, const render::Picture& b, std::string name, std::string caption,
                         float scale);

template <class T>
T by_size(const Options& options, T quick, T standard, T paper) {
  return options.size == Options::Size::quick ? quick : options.size == Options::Size::standard ? standard : paper;
}

}  // namespace facetwise::experiments
