// SPDX-License-Identifier: Apache-2.0
// The same seed gives the same picture, bit for bit: here or on a server, on one thread or more, in one go or resumed.
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <cstring>

#include "facetwise/client.h"
#include "facetwise/render.h"
#include "service/server_process.h"

namespace facetwise::render {
namespace {

using testing::ServerProcess;
using testing::TemporaryFolder;

Scene scene_of(const std::string& name) {
  auto scene = *built_in_scene(name);
  auto probe = load_environment("forest");
  EXPECT_TRUE(probe.ok()) << probe.status();
  scene.environment = *std::move(probe);
  return scene;
}

Settings small(Numbers numbers = Numbers::random) {
  Settings settings;
  settings.width = 96;
  settings.height = 40;
  settings.samples = 6;
  settings.numbers = numbers;
  return settings;
}

bool same(const Picture& a, const Picture& b) {
  return a.pixels.size() == b.pixels.size() &&
         std::memcmp(a.pixels.data(), b.pixels.data(), sizeof(Picture::Pixel) * a.pixels.size()) == 0;
}

TEST(SamePicture, LocalAndRemote) {
  const TemporaryFolder folder;
  const ServerProcess server({"--listen", "unix:" + folder.path("socket")});
  ASSERT_TRUE(server.ready());
  auto remote = connect(std::vector<std::string>{server.addresses()[0]});
  ASSERT_TRUE(remote.ok()) << remote.status();
  const auto local = local_engine();
  for (const char* name : {"orbs", "glass"})
    for (const Numbers numbers : {Numbers::random, Numbers::sobol}) {
      const Scene scene = scene_of(name);
      const auto here = render(scene, small(numbers), *local);
      ASSERT_TRUE(here.ok()) << here.status();
      const auto there = render(scene, small(numbers), **remote);
      ASSERT_TRUE(there.ok()) << there.status();
      EXPECT_TRUE(same(*here, *there)) << name;
      EXPECT_EQ(here->sampled, there->sampled);
    }
}

TEST(SamePicture, OneThreadAndTwo) {
  const Scene scene = scene_of("orbs");
  std::optional<Picture> first;
  for (const int threads : {1, 2}) {
    tbb::task_arena arena(threads);
    const auto engine = local_engine();
    absl::StatusOr<Picture> picture = absl::UnknownError("");
    arena.execute([&] { picture = render(scene, small(), *engine); });
    ASSERT_TRUE(picture.ok()) << picture.status();
    if (!first) first = *picture;
    EXPECT_TRUE(same(*first, *picture));
  }
}

TEST(SamePicture, StoppedAndResumedThroughAFile) {
  const TemporaryFolder folder;
  const Scene scene = scene_of("orb");
  const auto engine = local_engine();
  Settings settings = small();
  settings.width = 300, settings.height = 300;  // one pass is more than one wave
  const auto whole = render(scene, settings, *engine);
  ASSERT_TRUE(whole.ok()) << whole.status();
  int passes = 0;
  settings.progress = [&](double) { return ++passes < 2; };
  const auto stopped = render(scene, settings, *engine);
  ASSERT_TRUE(stopped.ok()) << stopped.status();
  EXPECT_EQ(stopped->samples(), 2u);
  const std::string path = folder.path("stopped.exr");
  ASSERT_TRUE(save_exr(*stopped, path).ok());
  const auto loaded = load_exr(path);
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  EXPECT_TRUE(same(*stopped, *loaded));
  settings.progress = {};
  const auto resumed = render(scene, settings, *engine, *loaded);
  ASSERT_TRUE(resumed.ok()) << resumed.status();
  EXPECT_TRUE(same(*whole, *resumed));
  // Another picture is not gone on from.
  settings.seed = 2;
  EXPECT_FALSE(render(scene, settings, *engine, *loaded).ok());
}

TEST(SamePicture, SeedsDiffer) {
  const Scene scene = scene_of("orb");
  const auto engine = local_engine();
  Settings settings = small();
  const auto one = render(scene, settings, *engine);
  settings.seed = 2;
  const auto two = render(scene, settings, *engine);
  ASSERT_TRUE(one.ok() && two.ok());
  EXPECT_FALSE(same(*one, *two));
}

// What users of the scalar baseline would see: the same picture up to rounding and the order of its numbers.
TEST(SamePicture, TheScalarBaselineDiffersByNoiseOnly) {
  Scene scene = scene_of("orbs");
  scene.materials.erase(scene.materials.begin());  // alpha = 0.01: too bright and rare a highlight for so few samples
  for (auto& part : scene.mesh.parts) part = part == 0 ? 0 : part - 1;
  Settings settings = small(Numbers::sobol);
  settings.samples = 64;
  const auto engine = local_engine();
  const auto scalar = scalar_engine();
  const auto a = render(scene, settings, *engine), b = render(scene, settings, *scalar);
  ASSERT_TRUE(a.ok()) << a.status();
  ASSERT_TRUE(b.ok()) << b.status();
  settings.seed = 2;
  const auto c = render(scene, settings, *engine);
  ASSERT_TRUE(c.ok());
  EXPECT_LT(rmse(*a, *b), rmse(*a, *c));
}

}  // namespace
}  // namespace facetwise::render
