// SPDX-License-Identifier: Apache-2.0
// Pictures show what is wrong: small stored references are met by the engine, and missed by one whose pdf is a little off, in
// RMSE and in how different they look. FACETWISE_WRITE_REFERENCES=FOLDER makes the references anew.
#include <ImfRgbaFile.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "facetwise/render.h"
#include "render/likeness.h"

namespace facetwise::render {
namespace {

// An engine with a fault: the pdf of what it draws, or of what it is asked, is off by a factor.
class WrongPdf final : public Engine {
 public:
  explicit WrongPdf(bool drawn) : drawn_(drawn) {}
  absl::StatusOr<Statistics> run(Operation operation, const Batch& batch) override {
    auto result = facetwise::run(operation, batch);
    if (result.ok() && batch.out.pdf.present() && samples(operation) == drawn_)
      for (std::size_t lane = 0; lane < batch.lanes; ++lane) batch.out.pdf[lane] *= 1.1f;
    return result;
  }
  absl::StatusOr<std::size_t> compact(const Compaction& compaction) override { return facetwise::compact(compaction); }

 private:
  bool drawn_;
};

struct Case {
  const char* scene;
  int width, height;
  std::uint32_t samples;
  float rmse, looks;  // bounds: above the engine's noise, below a pdf that is 10 % off
};
constexpr Case kCases[] = {{"orb", 40, 48, 256, 0.0055f, 0.0015f}, {"normal-map", 64, 32, 1024, 0.006f, 0.0015f}};

// White light from above, grey below: smooth, so that little noise hides what is wrong.
Environment sky() {
  auto image = std::make_shared<Image>();
  image->width = 8, image->height = 16;
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 8; ++x)
      for (const float tint : {0.9f, 1.0f, 1.1f}) image->values.push_back(tint * (y < 8 ? 0.7f : 0.25f));
  return {.probe = image};
}

Picture rendered(const Case& which, Engine& engine, std::uint32_t samples, std::uint64_t seed) {
  auto scene = *built_in_scene(which.scene);
  scene.environment = sky();
  Settings settings;
  settings.width = which.width;
  settings.height = which.height;
  settings.samples = samples;
  settings.seed = seed;
  settings.numbers = Numbers::sobol;
  const auto picture = render(scene, settings, engine);
  EXPECT_TRUE(picture.ok()) << picture.status();
  return *picture;
}

std::vector<Color> colors(const Picture& picture) {
  std::vector<Color> result;
  for (std::size_t k = 0; k < picture.pixels.size(); ++k) result.push_back(picture.color(k));
  return result;
}

std::string path_of(const std::string& folder, const Case& which) { return folder + "/" + which.scene + ".exr"; }

std::vector<Color> stored(const Case& which) {
  const auto image = load_image(path_of(FACETWISE_REFERENCES, which));
  EXPECT_TRUE(image.ok()) << image.status();
  std::vector<Color> result;
  for (int y = 0; y < which.height; ++y)
    for (int x = 0; x < which.width; ++x)
      result.push_back({image->at(x, y)[0], image->at(x, y)[1], image->at(x, y)[2]});
  return result;
}

double rmse_of(const std::vector<Color>& a, const std::vector<Color>& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k)
    for (std::size_t c = 0; c < 3; ++c) sum += std::pow(a[k][c] - b[k][c], 2);
  return std::sqrt(sum / (3.0 * static_cast<double>(a.size())));
}

TEST(References, AreMetAndAWrongPdfMissesThem) {
  const auto engine = local_engine();
  for (const Case& which : kCases) {
    if (const char* folder = std::getenv("FACETWISE_WRITE_REFERENCES")) {
      const auto all = colors(rendered(which, *engine, 8192, 7));
      std::vector<Imf::Rgba> half;
      for (const Color& c : all) half.emplace_back(c[0], c[1], c[2]);
      Imf::RgbaOutputFile file(path_of(folder, which).c_str(), which.width, which.height, Imf::WRITE_RGB);
      file.setFrameBuffer(half.data(), 1, static_cast<std::size_t>(which.width));
      file.writePixels(which.height);
    }
    const auto reference = stored(which);
    const auto compare = [&](Engine& any) {
      const auto picture = colors(rendered(which, any, which.samples, 1));
      return std::pair(rmse_of(picture, reference), looks_different(picture, reference, which.width, which.height));
    };
    const auto [rmse, looks] = compare(*engine);
    EXPECT_LT(rmse, which.rmse) << which.scene;
    EXPECT_LT(looks, which.looks) << which.scene;
    for (const bool drawn : {true, false}) {
      WrongPdf wrong(drawn);
      const auto [wrong_rmse, wrong_looks] = compare(wrong);
      EXPECT_GT(wrong_rmse, which.rmse) << which.scene << (drawn ? ", drawn" : ", asked");
      EXPECT_GT(wrong_looks, which.looks) << which.scene << (drawn ? ", drawn" : ", asked");
    }
  }
}

TEST(Likeness, IsZeroForTheSameAndAboutOneForBlackAndWhite) {
  const std::vector<Color> black(64), white(64, Color{1, 1, 1});
  EXPECT_EQ(looks_different(white, white, 8, 8), 0);
  EXPECT_NEAR(looks_different(black, white, 8, 8), 1, 0.01);
  // Noise of single pixels looks less different than the same error all over.
  auto noise = std::vector<Color>(64, Color{0.5f, 0.5f, 0.5f}), shifted = noise;
  const auto flat = noise;
  for (std::size_t k = 0; k < 64; ++k)
    for (std::size_t c = 0; c < 3; ++c) noise[k][c] += (k / 8 + k) % 2 ? 0.1f : -0.1f, shifted[k][c] += 0.1f;
  EXPECT_LT(looks_different(noise, flat, 8, 8), 0.5 * looks_different(shifted, flat, 8, 8));
}

// What the samplers draw by densities of their own has one mean.
TEST(References, SamplersAgree) {
  const auto engine = local_engine();
  auto scene = *built_in_scene("orb");
  Settings settings;
  settings.width = 48, settings.height = 56, settings.samples = 128;
  settings.numbers = Numbers::sobol;
  std::vector<double> means;
  for (const Sampler sampler : {Sampler::exact, Sampler::ndf, Sampler::cap, Sampler::bounded}) {
    scene.materials[0].sampler = sampler;
    const auto picture = render(scene, settings, *engine);
    ASSERT_TRUE(picture.ok()) << picture.status();
    double sum = 0;
    for (const Color& c : colors(*picture)) sum += c[1];
    means.push_back(sum / static_cast<double>(picture->pixels.size()));
    EXPECT_NEAR(means.back(), means.front(), 1.5e-3) << name(sampler);
  }
}

}  // namespace
}  // namespace facetwise::render
