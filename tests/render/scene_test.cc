// SPDX-License-Identifier: Apache-2.0
// Scenes: real files, those made by code, and what is wrong with others.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "facetwise/render.h"
#include "service/server_process.h"

namespace facetwise::render {
namespace {

using testing::TemporaryFolder;
const std::string kModels = "/usr/share/assimp/models/glTF2/";

TEST(Scene, ShapesFaceOutwards) {
  for (const auto& [mesh, what] : {std::pair(ball({1, 2, 3}, 2, 0), "ball"), {orb({1, 2, 3}, 2, 0), "orb"}}) {
    ASSERT_EQ(mesh.positions.size(), mesh.normals.size());
    ASSERT_EQ(mesh.positions.size(), mesh.tangents.size());
    ASSERT_EQ(mesh.triangles.size(), mesh.parts.size());
    for (const auto& [a, b, c] : mesh.triangles) {
      const Vector face = cross(mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a]);
      for (const std::uint32_t vertex : {a, b, c}) {
        ASSERT_GT(dot(face, mesh.normals[vertex]), 0) << what;
        ASSERT_NEAR(dot(mesh.normals[vertex], mesh.tangents[vertex]), 0, 1e-5) << what;
      }
    }
  }
}

TEST(Scene, EveryBuiltInOneRenders) {
  const auto engine = local_engine();
  for (const std::string& name : built_in_scenes()) {
    const auto scene = built_in_scene(name);
    ASSERT_TRUE(scene.ok()) << scene.status();
    Settings settings;
    settings.width = settings.height = 32;
    settings.samples = 2;
    const auto picture = render(*scene, settings, *engine);
    ASSERT_TRUE(picture.ok()) << picture.status();
    EXPECT_GT(picture->mean_depth(), 0.1) << name;
    for (std::size_t k = 0; k < picture->pixels.size(); ++k)
      for (const float value : picture->color(k)) ASSERT_TRUE(std::isfinite(value) && value >= 0) << name;
  }
  EXPECT_FALSE(built_in_scene("teapot").ok());
}

TEST(Scene, RealModelsRender) {
  const auto engine = local_engine();
  for (const std::string& file :
       {kModels + "2CylinderEngine-glTF-Binary/2CylinderEngine.glb", kModels + "ClearCoat-glTF/ClearCoatTest.gltf"}) {
    auto scene = load_scene(file);
    ASSERT_TRUE(scene.ok()) << scene.status();
    Settings settings;
    settings.width = settings.height = 64;
    settings.samples = 4;
    const auto picture = render(*scene, settings, *engine);
    ASSERT_TRUE(picture.ok()) << picture.status();
    EXPECT_GT(picture->mean_depth(), 0.2) << file;
  }
}

TEST(Scene, NormalMapsAreRead) {
  const auto scene = load_scene(kModels + "ClearCoat-glTF/ClearCoatTest.gltf");
  ASSERT_TRUE(scene.ok()) << scene.status();
  int with = 0;
  for (const Material& material : scene->materials) with += material.normal_map != nullptr;
  EXPECT_GT(with, 0);
}

TEST(Scene, BrokenFilesAreNamed) {
  const TemporaryFolder folder;
  const std::string broken = folder.path("broken.gltf");
  std::ofstream(broken) << "{";
  for (const std::string& path : {broken, folder.path("missing.glb"), kModels + "MissingBin/BoxTextured.gltf",
                                  kModels + "SchemaFailures/sceneWrongType.gltf"}) {
    const auto scene = load_scene(path);
    ASSERT_FALSE(scene.ok()) << path;
    EXPECT_NE(std::string(scene.status().message()).find(path), std::string::npos) << scene.status();
  }
  const auto probe = load_environment("moonrise");
  ASSERT_FALSE(probe.ok());
  EXPECT_NE(std::string(probe.status().message()).find("forest"), std::string::npos) << probe.status();
  EXPECT_FALSE(load_environment(folder.path("none.exr")).ok());
}

TEST(Scene, SettingsOutOfRangeAreNamed) {
  const auto engine = local_engine();
  const Scene scene = *built_in_scene("furnace");
  const auto error = [&](auto change) {
    Settings settings;
    settings.width = settings.height = 4;
    settings.samples = 1;
    change(settings);
    return std::string(render(scene, settings, *engine).status().message());
  };
  EXPECT_TRUE(error([](Settings& s) { s.width = 0; }).starts_with("width"));
  EXPECT_TRUE(error([](Settings& s) { s.height = 20000; }).starts_with("height"));
  EXPECT_TRUE(error([](Settings& s) { s.samples = 0; }).starts_with("samples"));
  EXPECT_TRUE(error([](Settings& s) { s.depth = 0; }).starts_with("depth"));
  EXPECT_EQ(error([](Settings&) {}), "");
}

}  // namespace
}  // namespace facetwise::render
