// A picture shows a wrong pdf: the small references are met by the engine, and missed by one whose pdf is 5 % too large.
#include <gtest/gtest.h>

#include "facetwise/render.h"

namespace facetwise::render {
namespace {

// An engine with a fault: the pdf of what it draws, or of what it is asked, is off by a factor.
class WrongPdf final : public Engine {
 public:
  explicit WrongPdf(bool drawn) : drawn_(drawn) {}
  absl::StatusOr<Statistics> run(Operation operation, const Batch& batch) override {
    auto result = facetwise::run(operation, batch);
    if (result.ok() && batch.out.pdf.present() && samples(operation) == drawn_)
      for (std::size_t lane = 0; lane < batch.lanes; ++lane) batch.out.pdf[lane] *= 1.05f;
    return result;
  }
  absl::StatusOr<std::size_t> compact(const Compaction& compaction) override { return facetwise::compact(compaction); }

 private:
  bool drawn_;
};

// The mean of a picture in a smooth environment, where multiple importance sampling splits the light evenly.
double mean_of(Engine& engine, const Model& model, Sampler sampler, double& noise) {
  auto scene = *built_in_scene("orb");
  scene.materials[0].model = model;
  scene.materials[0].sampler = sampler;
  Settings settings;
  settings.width = 48;
  settings.height = 56;
  settings.samples = 128;
  settings.numbers = Numbers::sobol;
  double means[2];
  for (int half = 0; half < 2; ++half) {
    settings.seed = static_cast<std::uint64_t>(half) + 1;
    const auto picture = render(scene, settings, engine);
    EXPECT_TRUE(picture.ok()) << picture.status();
    means[half] = 0;
    for (std::size_t k = 0; k < picture->pixels.size(); ++k)
      means[half] += picture->color(k)[1] / static_cast<double>(picture->pixels.size());
  }
  noise = std::abs(means[0] - means[1]);
  return 0.5 * (means[0] + means[1]);
}

TEST(WrongPdf, ShowsInThePicture) {
  const auto engine = local_engine();
  double noise = 0;
  const double right = mean_of(*engine, {}, Sampler::exact, noise);
  EXPECT_LT(noise, 5e-4);
  // Another sampler, whose pdf is another, agrees.
  for (const Sampler sampler : {Sampler::ndf, Sampler::cap, Sampler::bounded})
    EXPECT_NEAR(mean_of(*engine, {}, sampler, noise), right, 1.5e-3) << name(sampler);
  for (const bool drawn : {true, false}) {
    WrongPdf wrong(drawn);
    EXPECT_GT(std::abs(mean_of(wrong, {}, Sampler::exact, noise) - right), 4e-3) << (drawn ? "drawn" : "asked");
  }
}

}  // namespace
}  // namespace facetwise::render
