// SPDX-License-Identifier: Apache-2.0
#include "src/measure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace facetwise::experiments {

bool Steps::say(double done) {
  said_ = std::clamp(done / total_, said_, 1.0);
  return !options_.progress || options_.progress(what_, said_);
}

absl::Status Steps::begin(std::string_view what, double weight, int pictures) {
  done_ += std::exchange(weight_, weight);
  pictures_ = pictures;
  picture_ = 0;
  what_ = std::string(what);
  return say(done_) ? absl::OkStatus() : absl::CancelledError("stopped");
}

std::function<bool(double)> Steps::picture() {
  const double before = std::min(picture_++, pictures_ - 1);
  return [this, before](double done) { return say(done_ + weight_ * (before + done) / pictures_); };
}

std::string percent(double share) { return fmt::format("{:.2f} %", 100 * share); }

double share_rejected(const render::Picture& picture) {
  return static_cast<double>(picture.sampled.occluded) /
         static_cast<double>(std::max<std::uint64_t>(1, picture.sampled.lanes()));
}

absl::StatusOr<render::Scene> lit(std::string_view name) {
  auto scene = render::built_in_scene(name);
  if (!scene.ok()) return scene;
  auto environment = render::load_environment("courtyard");
  if (!environment.ok()) return environment.status();
  scene->environment = *std::move(environment);
  return scene;
}

absl::StatusOr<render::Picture> render_here(const render::Scene& scene, render::Settings settings, Steps& steps) {
  static const auto engine = local_engine();
  settings.progress = steps.picture();
  auto picture = render::render(scene, settings, *engine);
  if (picture.ok() && picture->samples() < settings.samples) return absl::CancelledError("stopped");
  return picture;
}

absl::StatusOr<Reference> reference(const render::Scene& scene, render::Settings settings, std::uint32_t samples,
                                    Steps& steps) {
  settings.samples = samples / 2;
  settings.numbers = render::Numbers::sobol;
  // Whatever the pictures under test do, the reference takes all light that it can find.
  settings.light_sampling = true;
  settings.seed = 1001;
  auto a = render_here(scene, settings, steps);
  if (!a.ok()) return a.status();
  settings.seed = 1002;
  auto b = render_here(scene, settings, steps);
  if (!b.ok()) return b.status();
  return Reference{render::merge(*a, *b), 0.5 * render::rmse(*a, *b)};
}

Pictures::One shown(const render::Picture& picture, std::string name, std::string caption, float exposure) {
  return {std::move(name), std::move(caption),
          render::png_bytes(picture.width, picture.height, render::tone_map(picture, exposure))};
}

Pictures::One difference(const render::Picture& a, const render::Picture& b, std::string name, std::string caption,
                         float scale) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t k = 0; k < a.pixels.size(); ++k) {
    const auto x = a.color(k), y = b.color(k);
    for (std::size_t c = 0; c < 3; ++c)
      bytes.push_back(static_cast<std::uint8_t>(255 * std::min(1.0f, scale * std::abs(x[c] - y[c]))));
  }
  return {std::move(name), std::move(caption), render::png_bytes(a.width, a.height, bytes)};
}

}  // namespace facetwise::experiments
