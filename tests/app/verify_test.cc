// SPDX-License-Identifier: Apache-2.0
// verify finds one wrong bit, wherever it is, and nothing where nothing is wrong.
#include "app/verify.h"

#include <gtest/gtest.h>

#include <bit>

#include "app/errors.h"

namespace facetwise::app {
namespace {

constexpr std::size_t kLanes = 4096;

scene::Camera& camera() {
  static const auto camera = [] {
    auto mesh = scene::load_mesh(*scene::default_mesh());
    return *scene::Camera::create(*std::move(mesh));
  }();
  return *camera;
}

std::vector<Sampler> samplers() { return {all_samplers().begin(), all_samplers().end()}; }

// The local engine, with one thing wrong in its `wrong`-th answer.
class LyingEngine final : public Engine {
 public:
  enum class Lie { none, bit, status, statistics, unwritten };
  LyingEngine(Lie lie, std::size_t wrong) : lie_(lie), wrong_(wrong) {}

  absl::StatusOr<Statistics> run(Operation operation, const Batch& batch) override {
    Batch copy = batch;
    const bool now = calls_++ == wrong_;
    OutputColumn<float> chosen;
    for (const OutputField& field : output_fields())
      if (field.column(copy).present()) {
        chosen = field.column(copy);
        if (now && lie_ == Lie::unwritten) field.column(copy) = {};
        break;
      }
    auto statistics = facetwise::run(operation, copy);
    if (!now) return statistics;
    if (lie_ == Lie::bit) chosen[1234] = std::bit_cast<float>(std::bit_cast<std::uint32_t>(chosen[1234]) ^ 1u);
    if (lie_ == Lie::status) copy.out.status[kLanes - 1] ^= 1;
    if (lie_ == Lie::statistics) ++statistics->occluded;
    return statistics;
  }
  absl::StatusOr<std::size_t> compact(const Compaction& compaction) override { return facetwise::compact(compaction); }

 private:
  Lie lie_;
  std::size_t wrong_, calls_ = 0;
};

Verification verify_with(LyingEngine::Lie lie, std::size_t wrong) {
  LyingEngine remote(lie, wrong);
  const auto local = local_engine();
  VerifyOptions options;
  options.lanes = kLanes;
  options.samplers = samplers();
  const auto verification = verify(remote, *local, camera(), options, [](const VerifiedBatch&) {});
  EXPECT_TRUE(verification.ok()) << verification.status();
  return *verification;
}

TEST(Verify, NothingWrong) {
  const auto verification = verify_with(LyingEngine::Lie::none, 0);
  EXPECT_TRUE(verification.equal());
  const std::size_t cases = verify_cases(samplers()).size();
  EXPECT_EQ(verification.batches.size(), cases);
  EXPECT_EQ(verification.lanes(), cases * kLanes);
  for (const auto& batch : verification.batches) EXPECT_EQ(batch.statistics.invalid, 0u);
}

TEST(Verify, FindsEveryLieInItsBatch) {
  using Lie = LyingEngine::Lie;
  for (const Lie lie : {Lie::bit, Lie::status, Lie::statistics, Lie::unwritten})
    for (const std::size_t wrong : {0, 7, 15}) {
      const auto verification = verify_with(lie, wrong);
      EXPECT_FALSE(verification.equal());
      for (std::size_t k = 0; k < verification.batches.size(); ++k)
        EXPECT_EQ(verification.batches[k].difference.empty(), k != wrong)
            << "lie " << static_cast<int>(lie) << " in batch " << wrong << ", batch " << k;
    }
}

TEST(Verify, SaysWhere) {
  const auto verification = verify_with(LyingEngine::Lie::bit, 15);
  const std::string& difference = verification.batches[15].difference;
  EXPECT_TRUE(difference.starts_with("out.")) << difference;
  EXPECT_NE(difference.find(" differs in 1 lanes, first in lane 1234: "), difference.npos) << difference;
}

TEST(VerifyCases, CoverEverySamplerAndOperation) {
  const auto cases = verify_cases(samplers());
  EXPECT_GT(cases.size(), 100u);
  for (const Sampler sampler : all_samplers())
    EXPECT_GE(std::count_if(cases.begin(), cases.end(),
                            [&](const VerifyCase& c) {
                              return c.operation == Operation::sample_reflection && c.sampler == sampler;
                            }),
              2);
  for (const Operation operation : all_operations())
    EXPECT_TRUE(std::any_of(cases.begin(), cases.end(), [&](const VerifyCase& c) { return c.operation == operation; }))
        << name(operation);
  for (const Sampler sampler : all_samplers()) {
    const Sampler one[] = {sampler};
    for (const VerifyCase& c : verify_cases(one)) EXPECT_EQ(c.sampler, sampler);
  }
}

TEST(Scene, LanesAreWhatTheComparisonNeeds) {
  EXPECT_EQ(camera().triangles(), 121496u);
  const auto lanes = camera().trace(300000);
  ASSERT_EQ(lanes.size(), 300000u);
  EXPECT_GE(static_cast<double>(camera().hits()), 0.5 * static_cast<double>(camera().rays()));
  const double backfacing = static_cast<double>(lanes.backfacing) / static_cast<double>(lanes.size());
  EXPECT_GT(backfacing, 0.02);
  EXPECT_LT(backfacing, 0.30);
  std::size_t counted = 0, anisotropic = 0;
  float rough = 0, smooth = 10;
  for (std::size_t k = 0; k < lanes.size(); ++k) {
    const float x = lanes.incident_x[k], y = lanes.incident_y[k], z = lanes.incident_z[k];
    ASSERT_NEAR(x * x + y * y + z * z, 1.0f, 1e-6f);
    counted += z <= 0.0f;
    anisotropic += lanes.alpha_x[k] != lanes.alpha_y[k];
    rough = std::max(rough, lanes.alpha_x[k]);
    smooth = std::min(smooth, lanes.alpha_x[k]);
  }
  EXPECT_EQ(counted, lanes.backfacing);
  EXPECT_GT(anisotropic, lanes.size() / 50);
  EXPECT_GT(rough, 0.5f);
  EXPECT_LT(smooth, 0.1f);
  EXPECT_GT(smooth, 1e-3f);
}

TEST(Scene, ErrorsNameTheFile) { EXPECT_EQ(message(scene::load_mesh("/none.glb").status()).find("/none.glb: "), 0u); }

}  // namespace
}  // namespace facetwise::app
