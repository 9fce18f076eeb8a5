// SPDX-License-Identifier: Apache-2.0
// White light from everywhere: what comes back from a plate is its albedo, by every model and however directions are
// drawn. With the environment sampled too, a wrong value or pdf shows as well as a wrong weight.
#include <gtest/gtest.h>

#include <cmath>

#include "facetwise/albedo_table.h"
#include "facetwise/render.h"

namespace facetwise::render {
namespace {

constexpr int kWidth = 48, kHeight = 4;

// The mean over each column of pixels, red.
std::vector<double> columns_of(const Picture& picture) {
  std::vector<double> columns(kWidth);
  for (std::size_t k = 0; k < picture.pixels.size(); ++k) columns[k % kWidth] += picture.color(k)[0] / kHeight;
  return columns;
}

// E by the engine's albedo, over a grid of points in each column's pixels.
std::vector<double> expected(const Scene& scene) {
  constexpr int kGrid = 4;
  std::vector<float> x, y, z;
  const Vector back = normalized(scene.view.eye);
  const Vector right = normalized(cross(scene.view.up, back)), up = cross(back, right);
  for (int column = 0; column < kWidth; ++column)
    for (int row = 0; row < kHeight; ++row)
      for (int k = 0; k < kGrid * kGrid; ++k) {
        const float size = scene.view.field / kHeight;
        const float px = static_cast<float>(column) + (static_cast<float>(k % kGrid) + 0.5f) / kGrid - 0.5f * kWidth;
        const float py = static_cast<float>(row) + (static_cast<float>(k / kGrid) + 0.5f) / kGrid - 0.5f * kHeight;
        const Vector i = -1.0f * normalized(-1.0f * back + (size * px) * right - (size * py) * up);
        x.push_back(i[0]), y.push_back(i[1]), z.push_back(i[2]);
      }
  std::vector<float> albedo(x.size());
  Batch batch;
  batch.model = scene.materials[0].model;
  batch.lanes = x.size();
  batch.incident = {x, y, z};
  batch.alpha_x = scene.materials[0].alpha_x;
  batch.alpha_y = scene.materials[0].alpha_y;
  batch.out.albedo = albedo;
  EXPECT_TRUE(run(Operation::albedo, batch).ok());
  std::vector<double> columns(kWidth);
  const std::size_t each = albedo.size() / kWidth;
  for (std::size_t k = 0; k < albedo.size(); ++k) columns[k / each] += albedo[k] / static_cast<double>(each);
  return columns;
}

Scene furnace(const Model& model, Sampler sampler, float alpha_x, float alpha_y) {
  auto scene = *built_in_scene("furnace");
  scene.materials[0].model = model;
  scene.materials[0].sampler = sampler;
  scene.materials[0].alpha_x = alpha_x;
  scene.materials[0].alpha_y = alpha_y;
  // The field covers 0 to 85 degrees across the width, not the height.
  scene.view.field *= static_cast<float>(kHeight) / kWidth;
  return scene;
}

Settings settings(bool light_sampling, std::uint32_t samples = 8192) {
  Settings settings;
  settings.width = kWidth;
  settings.height = kHeight;
  settings.samples = samples;
  settings.light_sampling = light_sampling;
  return settings;
}

TEST(Furnace, EveryConductorReflectsItsAlbedo) {
  const auto engine = local_engine();
  for (const Model& model : all_models()) {
    // Smaller than a call would build, and in a tenth of the time.
    AlbedoTable::Options options;
    options.sizes = {.v = 65, .a = 65, .ratio_v = 17, .ratio_a = 17, .ratio_r = 9, .ratio_t = 9};
    const auto table = AlbedoTable::build(model, options);
    ASSERT_TRUE(table.ok()) << table.status();
    use_albedo_table(*table);
    const Sampler sampler = samplers_for(Operation::sample_reflection, model).back();
    const Scene scene = furnace(model, sampler, 0.7f, 0.4f);
    const auto albedo = expected(scene);
    for (const bool light_sampling : {false, true}) {
      const auto picture = render(scene, settings(light_sampling), *engine);
      ASSERT_TRUE(picture.ok()) << picture.status();
      const auto columns = columns_of(*picture);
      double square = 0;
      for (std::size_t k = 0; k < columns.size(); ++k) square += std::pow(columns[k] - albedo[k], 2);
      // Anisotropic albedo is stated to 5e-3; the rest is noise.
      EXPECT_LT(std::sqrt(square / kWidth), 0.006) << name(model.distribution) << "-" << name(model.masking) << " by "
                                                   << name(sampler) << (light_sampling ? ", light sampled too" : "");
    }
  }
}

TEST(Furnace, SamplersAgree) {
  const auto engine = local_engine();
  const Model ggx;
  const auto albedo = expected(furnace(ggx, Sampler::exact, 0.5f, 0.5f));
  for (const Sampler sampler : samplers_for(Operation::sample_reflection, ggx)) {
    const auto picture = render(furnace(ggx, sampler, 0.5f, 0.5f), settings(true), *engine);
    ASSERT_TRUE(picture.ok()) << picture.status();
    const auto columns = columns_of(*picture);
    for (std::size_t k = 0; k < columns.size(); ++k)
      EXPECT_NEAR(columns[k], albedo[k], 0.01) << name(sampler) << ", column " << k;
  }
}

TEST(Furnace, CompensatedConductorsReflectAll) {
  const auto engine = local_engine();
  Scene scene = furnace({}, Sampler::exact, 0.8f, 0.8f);
  scene.materials[0].compensated = true;
  const auto picture = render(scene, settings(true), *engine);
  ASSERT_TRUE(picture.ok()) << picture.status();
  for (const double value : columns_of(*picture)) EXPECT_NEAR(value, 1, 0.01);
}

// A white matte base under a clear surface: together they reflect nearly all, and the two ways of finding light agree.
TEST(Furnace, BasesTakeWhatTheSurfaceLeaves) {
  const auto engine = local_engine();
  for (const float alpha : {0.0f, 0.3f, 0.8f}) {
    Scene scene = furnace({}, Sampler::exact, alpha, alpha);
    scene.materials[0].f0 = {0.04f, 0.04f, 0.04f};
    scene.materials[0].base = {1, 1, 1};
    std::vector<double> columns[2];
    for (const bool light_sampling : {false, true}) {
      const auto picture = render(scene, settings(light_sampling), *engine);
      ASSERT_TRUE(picture.ok()) << picture.status();
      columns[light_sampling] = columns_of(*picture);
    }
    for (std::size_t k = 0; k < kWidth; ++k) {
      EXPECT_NEAR(columns[0][k], columns[1][k], 0.02) << "alpha " << alpha << ", column " << k;
      // Towards grazing the surface reflects more than the base gives up, since only its F at normal incidence counts.
      EXPECT_GT(columns[1][k], 0.97) << "alpha " << alpha << ", column " << k;
      EXPECT_LT(columns[1][k], k < kWidth / 2 ? 1.03 : 1.9) << "alpha " << alpha << ", column " << k;
    }
  }
}

// Light comes back from a plate of glass too, except what single scattering loses each time: a smooth one loses none.
TEST(Furnace, GlassLosesNothingButMultipleScattering) {
  const auto engine = local_engine();
  for (const bool light_sampling : {false, true}) {
    auto scene = *built_in_scene("glass");
    scene.view.field = 0.02f;
    scene.environment = {};
    for (const auto& [alpha, low, high] : {std::tuple(0.0f, 0.999, 1.001), {0.05f, 0.985, 1.005}, {0.3f, 0.75, 1.0}}) {
      scene.materials[0].alpha_x = scene.materials[0].alpha_y = alpha;
      Settings how = settings(light_sampling, 1024);
      how.depth = 64;
      const auto picture = render(scene, how, *engine);
      ASSERT_TRUE(picture.ok()) << picture.status();
      double mean = 0;
      for (const double value : columns_of(*picture)) mean += value / kWidth;
      EXPECT_GT(mean, low) << "alpha " << alpha;
      EXPECT_LT(mean, high) << "alpha " << alpha;
    }
  }
}

}  // namespace
}  // namespace facetwise::render
