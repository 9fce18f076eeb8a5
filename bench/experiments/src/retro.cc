// SPDX-License-Identifier: Apache-2.0
// Raab 2025, "Properties of the Back-vector Modification for Microfacet BRDF Models": an orb that reflects back, energy,
// and symmetry.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "src/all.h"
#include "src/measure.h"

namespace facetwise::experiments {
namespace {

struct Pairs {
  std::vector<float> x[2], y[2], z[2];
};
// Directions of the upper hemisphere, evenly.
Pairs pairs(std::size_t count) {
  Pairs result;
  std::mt19937_64 engine(2025);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (std::size_t k = 0; k < count; ++k)
    for (int side = 0; side < 2; ++side) {
      const float z = 0.02f + 0.98f * uniform(engine), phi = 2 * std::numbers::pi_v<float> * uniform(engine);
      const float r = std::sqrt(1 - z * z);
      result.x[side].push_back(r * std::cos(phi));
      result.y[side].push_back(r * std::sin(phi));
      result.z[side].push_back(z);
    }
  return result;
}

// f(v, l) of each pair, from the side that `from` says.
absl::StatusOr<std::vector<float>> values(const Model& model, const Pairs& pairs, int from) {
  std::vector<float> value(pairs.x[0].size());
  Batch batch;
  batch.model = model;
  batch.sampler = Sampler::visible;
  batch.lanes = value.size();
  batch.incident = {pairs.x[from], pairs.y[from], pairs.z[from]};
  batch.outgoing = {pairs.x[1 - from], pairs.y[1 - from], pairs.z[1 - from]};
  batch.alpha_x = 0.7f;
  batch.alpha_y = 0.25f;
  batch.out.value = value;
  if (const auto status = evaluate_reflection(batch); !status.ok()) return status.status();
  for (std::size_t k = 0; k < value.size(); ++k) value[k] /= pairs.z[1 - from][k];  // without the cosine
  return value;
}

// The share of light reflected from i, by sampling.
absl::StatusOr<double> albedo_of(const Model& model, double theta, float alpha, std::size_t samples) {
  std::vector<float> weight(samples);
  Batch batch;
  batch.model = model;
  batch.sampler = Sampler::visible;
  batch.lanes = samples;
  batch.incident = {static_cast<float>(std::sin(theta)), 0.0f, static_cast<float>(std::cos(theta))};
  batch.alpha_x = batch.alpha_y = alpha;
  batch.generator = Generator{.seed = 7};
  batch.out.weight = weight;
  if (const auto status = sample_reflection(batch); !status.ok()) return status.status();
  double sum = 0;
  for (const float w : weight) sum += w;
  return sum / static_cast<double>(samples);
}

}  // namespace

absl::StatusOr<Page> retro_page(const Options& options) {
  Page page;
  page.id = "retro";
  page.title = "Reflecting back: the back vector";
  page.source = "Raab 2025, Properties of the Back-vector Modification for Microfacet BRDF Models";
  page.command = "facetwise experiment retro";
  Steps steps(options, 10);
  if (auto status = steps.begin("symmetry", 1); !status.ok()) return status;

  // f(v, l) against f(l, v).
  const Pairs both = pairs(4000);
  double worst = 0;
  for (const Masking masking : {Masking::smith, Masking::vcavity}) {
    Plot plot{fmt::format("f(v, l) against f(l, v), {} masking", name(masking)),
              "For random pairs of directions the two values lie on the diagonal, with retro-reflection and without.",
              "f(v, l)",
              "f(l, v)",
              true,
              true,
              false,
              {}};
    for (const bool retro : {false, true}) {
      Model model;
      model.masking = masking;
      model.retro = retro;
      const auto there = values(model, both, 0), back = values(model, both, 1);
      if (!there.ok()) return there.status();
      if (!back.ok()) return back.status();
      Series series{retro ? "retro" : "not retro", {}};
      for (std::size_t k = 0; k < there->size(); ++k) {
        const double a = (*there)[k], b = (*back)[k];
        worst = std::max(worst, std::abs(a - b) / std::max(a, b));
        if (k < 60) series.points.emplace_back(a, b);
      }
      std::sort(series.points.begin(), series.points.end());
      plot.series.push_back(std::move(series));
    }
    page.figures.emplace_back(std::move(plot));
  }

  // Albedo: that of the turned direction, so the same.
  Plot energy{"Albedo against angle, GGX with Smith masking",
              "With and without retro-reflection the surface reflects the same share of light at each angle.",
              "angle of incidence [degrees]",
              "albedo",
              false,
              false,
              false,
              {}};
  double apart = 0;
  for (const float alpha : {0.3f, 0.8f}) {
    Series plain{fmt::format("alpha {}", alpha), {}}, turned{fmt::format("alpha {}, retro", alpha), {}};
    for (int degrees = 0; degrees <= 85; degrees += 5) {
      Model model;
      const double theta = degrees * std::numbers::pi / 180;
      const auto a = albedo_of(model, theta, alpha, 1 << 18);
      model.retro = true;
      const auto b = albedo_of(model, theta, alpha, 1 << 18);
      if (!a.ok()) return a.status();
      if (!b.ok()) return b.status();
      plain.points.emplace_back(degrees, *a);
      turned.points.emplace_back(degrees, *b);
      apart = std::max(apart, std::abs(*a - *b));
    }
    energy.series.push_back(std::move(plain));
    energy.series.push_back(std::move(turned));
  }
  page.figures.emplace_back(std::move(energy));

  // An orb, with compensation, in the courtyard and in white light.
  auto scene = lit("orb");
  if (!scene.ok()) return scene.status();
  render::Settings settings;
  settings.width = by_size(options, 128, 384, 1024);
  settings.height = static_cast<int>(static_cast<float>(settings.width) / scene->aspect);
  settings.samples = by_size(options, 64u, 256u, 2048u);
  settings.numbers = render::Numbers::sobol;
  for (auto& material : scene->materials) {
    material.alpha_x = material.alpha_y = 0.2f;
    material.f0 = {1.0f, 0.78f, 0.34f};
  }
  // A small bright light beside the eye: what retro-reflectors are for.
  auto lamp = std::make_shared<render::Image>(*scene->environment.probe);
  const render::Vector to_eye = render::normalized(scene->view.eye);
  for (int y = 0; y < lamp->height; ++y)
    for (int x = 0; x < lamp->width; ++x) {
      const float phi =
          2 * std::numbers::pi_v<float> * ((static_cast<float>(x) + 0.5f) / static_cast<float>(lamp->width) - 0.5f);
      const float theta = std::numbers::pi_v<float> * (static_cast<float>(y) + 0.5f) / static_cast<float>(lamp->height);
      const render::Vector d = {std::sin(theta) * std::sin(phi), std::cos(theta), -std::sin(theta) * std::cos(phi)};
      float* pixel = &lamp->values[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(lamp->width) +
                                        static_cast<std::size_t>(x))];
      for (int c = 0; c < 3; ++c) pixel[c] = render::dot(d, to_eye) > 0.995f ? 40.0f : 0.3f * pixel[c];
    }
  scene->environment.probe = lamp;
  Pictures pictures{
      "A golden orb, alpha 0.2, compensated, with a lamp behind the viewer",
      "An orb lit from the viewer's side. Without retro-reflection the lamp makes one highlight in the middle; "
      "with it the whole orb shines back, to its edges.",
      settings.width,
      settings.height,
      {}};
  std::vector<double> means;
  for (const bool retro : {false, true}) {
    if (auto status = steps.begin(retro ? "orb with retro-reflection" : "orb", 3); !status.ok()) return status;
    for (auto& material : scene->materials) material.model.retro = retro;
    const auto picture = render_here(*scene, settings, steps);
    if (!picture.ok()) return picture.status();
    pictures.pictures.push_back(
        shown(*picture, retro ? "retro" : "not retro", fmt::format("{} samples a pixel", settings.samples), 1));
    double edge = 0;
    std::size_t lit_pixels = 0;
    for (std::size_t k = 0; k < picture->pixels.size(); ++k)
      if (picture->pixels[k].surfaces >= picture->pixels[k].samples) {
        edge += picture->color(k)[0] > 1.0f;
        ++lit_pixels;
      }
    means.push_back(edge / static_cast<double>(lit_pixels));
  }
  page.figures.emplace_back(std::move(pictures));
  // White light, white metal: compensated, it must vanish.
  double furnace[2];
  scene->environment = {};
  for (const bool retro : {false, true}) {
    if (auto status = steps.begin("white light", 1); !status.ok()) return status;
    for (auto& material : scene->materials) {
      material.model.retro = retro;
      material.f0 = {1, 1, 1};
      material.alpha_x = material.alpha_y = 0.8f;
    }
    settings.depth = 64;
    const auto picture = render_here(*scene, settings, steps);
    if (!picture.ok()) return picture.status();
    double sum = 0, count = 0;
    for (std::size_t k = 0; k < picture->pixels.size(); ++k)
      if (picture->pixels[k].surfaces >= picture->pixels[k].samples) sum += picture->color(k)[1], ++count;
    furnace[retro] = sum / count;
  }

  page.claims.push_back(
      {"The back vector keeps the BRDF symmetric, with Smith and with V-cavity masking (section 3).",
       fmt::format("The largest relative difference of f(v, l) and f(l, v) over 4,000 pairs and four models is {:.1e}.",
                   worst),
       agrees(worst < 1e-3)});
  page.claims.push_back(
      {"Its albedo is that of the unmodified BRDF for the reflected direction, so the same (equation 15).",
       fmt::format("The largest difference over 36 configurations, of the same random numbers, is {:.1e}.", apart),
       agrees(apart < 2e-3)});
  page.claims.push_back(
      {"Sampling needs only v' for v at the start, and the tables of energy compensation serve as they are (section "
       "4).",
       fmt::format("A compensated white orb of alpha 0.8 in white light sends back {:.4f}, retro-reflecting {:.4f}.",
                   furnace[0], furnace[1]),
       agrees(std::abs(furnace[1] - 1) < 0.02)});
  page.claims.push_back(
      {"The result is retro-reflective.",
       fmt::format("With a lamp beside the viewer {} of the orb is brighter than 1, without retro-reflection {}.",
                   percent(means[1]), percent(means[0])),
       agrees(means[1] > 2 * means[0])});
  page.notes = {"Of the symmetry plot 60 pairs are drawn, of an anisotropic GGX surface (0.7, 0.25)."};
  return page;
}

}  // namespace facetwise::experiments
