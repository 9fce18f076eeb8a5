// SPDX-License-Identifier: Apache-2.0
// Pictures as files.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "facetwise/render.h"
#include "service/server_process.h"

namespace facetwise::render {
namespace {

using testing::TemporaryFolder;

TEST(Picture, SumsKeepWhatAFloatLoses) {
  Picture::Sum sum;
  double exact = 0;
  for (int k = 0; k < 100000; ++k) {
    const float value = 0.1f + static_cast<float>(k % 7);
    sum.add(value);
    exact += value;
  }
  EXPECT_NEAR(sum.value() / exact, 1, 1e-12);
}

TEST(Picture, ImagesOfOthersAreRefusedForResuming) {
  const auto other = load_exr("/usr/share/blender/datafiles/studiolights/world/city.exr");
  ASSERT_FALSE(other.ok());
  EXPECT_NE(other.status().message().find("city.exr"), absl::string_view::npos);
}

TEST(Picture, BrokenAndMissingFilesAreNamed) {
  const TemporaryFolder folder;
  const std::string broken = folder.path("broken.exr"), text = folder.path("text.png");
  std::ofstream(broken) << "no picture";
  std::ofstream(text) << "no picture";
  for (const std::string& path : {broken, text, folder.path("missing.exr"), folder.path("missing.png")}) {
    const auto image = load_image(path);
    ASSERT_FALSE(image.ok()) << path;
    EXPECT_TRUE(std::string(image.status().message()).starts_with(path)) << image.status();
  }
  const auto picture = load_exr(broken);
  ASSERT_FALSE(picture.ok());
  EXPECT_TRUE(std::string(picture.status().message()).starts_with(broken));
  EXPECT_FALSE(save_exr({}, folder.path("none/at/all.exr")).ok());
  EXPECT_FALSE(save_png({}, folder.path("none/at/all.png")).ok());
}

TEST(Picture, PngIsWhatWasToneMapped) {
  const TemporaryFolder folder;
  Picture picture;
  picture.width = 3, picture.height = 1;
  picture.pixels.resize(3);
  const float values[] = {0, 0.5f, 100};
  for (std::size_t k = 0; k < 3; ++k) {
    picture.pixels[k].samples = 1;
    for (auto& sum : picture.pixels[k].radiance) sum.add(values[k]);
  }
  const std::string path = folder.path("picture.png");
  ASSERT_TRUE(save_png(picture, path, 1, false).ok());
  const auto image = load_image(path);
  ASSERT_TRUE(image.ok()) << image.status();
  ASSERT_EQ(image->width, 3);
  EXPECT_EQ(image->at(0, 0)[0], 0);
  EXPECT_NEAR(image->at(1, 0)[1], 188 / 255.0, 1e-6);  // sRGB of 0.5
  EXPECT_EQ(image->at(2, 0)[2], 1);
}

TEST(Picture, RmseIsTheRootOfTheMeanSquare) {
  Picture a, b;
  for (Picture* p : {&a, &b}) {
    p->width = p->height = 1;
    p->pixels.resize(1);
    p->pixels[0].samples = 2;
  }
  a.pixels[0].radiance[0].add(2);  // a mean of 1 in one of three channels
  EXPECT_NEAR(rmse(a, b), std::sqrt(1.0 / 3), 1e-7);
}

}  // namespace
}  // namespace facetwise::render
