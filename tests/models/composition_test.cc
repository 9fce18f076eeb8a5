// SPDX-License-Identifier: Apache-2.0
// Which models, samplers and operations fit together, and what is said where they do not.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "models/compositions.h"

namespace facetwise::test {
namespace {

bool has(const std::vector<Sampler>& samplers, Sampler sampler) {
  return std::find(samplers.begin(), samplers.end(), sampler) != samplers.end();
}

// Runs a batch that must be refused: InvalidArgument, a message that starts with the field, and nothing
// written.
std::string refused(Operation operation, const Composition& c, std::string_view field,
                    const std::function<void(Batch&)>& change = {}) {
  const std::vector<Point> points(5);
  std::vector<Result> results(5);
  std::memset(static_cast<void*>(results.data()), 0x5A, results.size() * sizeof(Result));
  const std::vector<Result> before = results;
  Batch batch = make_batch(operation, c, points, results);
  if (change) change(batch);
  const auto statistics = run(operation, batch);
  const std::string what = std::string(name(operation)) + " " + describe(c);
  EXPECT_FALSE(statistics.ok()) << what;
  if (statistics.ok()) return "";
  EXPECT_EQ(statistics.status().code(), absl::StatusCode::kInvalidArgument) << what;
  const std::string message(statistics.status().message());
  EXPECT_EQ(message.rfind(std::string(field) + ": ", 0), 0u) << what << ": " << message;
  EXPECT_EQ(check(operation, batch), statistics.status()) << what;
  EXPECT_EQ(std::memcmp(results.data(), before.data(), results.size() * sizeof(Result)), 0) << what << " wrote";
  return message;
}

constexpr Operation kSampled[] = {Operation::sample_normal,       Operation::sample_reflection,
                                  Operation::pdf_reflection,      Operation::evaluate_reflection,
                                  Operation::sample_transmission, Operation::evaluate_transmission,
                                  Operation::sample_scattering,   Operation::evaluate_scattering};

class ModelComposition : public testing::TestWithParam<Family> {};

// A sampler fits or is refused with a list of those that do.
TEST_P(ModelComposition, SamplersThatDoNotFitAreRefusedByName) {
  for (const Operation operation : kSampled) {
    const std::vector<Sampler> fit = samplers_of(GetParam(), operation);
    for (const Sampler sampler : all_samplers()) {
      Composition c = plain(GetParam(), sampler);
      if (operation >= Operation::sample_transmission) c.model.interface = Interface::dielectric;
      if (has(fit, sampler)) {
        run_points(operation, c, std::vector<Point>(5));
        continue;
      }
      const std::string message = refused(operation, c, "sampler");
      EXPECT_NE(message.find(name(sampler)), std::string::npos) << message;
      EXPECT_NE(message.find(name(operation)), std::string::npos) << message;
      const auto list = message.find("what does:");
      ASSERT_NE(list, std::string::npos) << message;
      for (const Sampler other : all_samplers())
        EXPECT_EQ(message.find(name(other), list) != std::string::npos, has(fit, other))
            << name(other) << ": " << message;
    }
  }
}

// samplers_for() says the same as run().
TEST_P(ModelComposition, SamplersForIsWhatRunTakes) {
  if (GetParam().affine) return;
  for (const Operation operation : kSampled) {
    Model model = plain(GetParam(), Sampler::visible).model;
    if (operation >= Operation::sample_transmission) model.interface = Interface::dielectric;
    EXPECT_EQ(samplers_for(operation, model), samplers_of(GetParam(), operation)) << name(operation);
  }
  EXPECT_TRUE(samplers_for(Operation::masking, plain(GetParam(), Sampler::visible).model).empty());
}

// Every family has `ndf` and `visible`, for normals and reflections; samplers of only reflections draw no
// normals.
TEST_P(ModelComposition, NdfAndVisibleAlwaysFit) {
  for (const Operation operation :
       {Operation::sample_normal, Operation::sample_reflection, Operation::pdf_reflection}) {
    const std::vector<Sampler> fit = samplers_of(GetParam(), operation);
    EXPECT_TRUE(has(fit, Sampler::ndf));
    EXPECT_TRUE(has(fit, Sampler::visible));
    for (const Sampler sampler : fit) {
      EXPECT_TRUE(operation != Operation::sample_normal || samples_normals(sampler)) << name(sampler);
    }
  }
}

// Values and masking are no sampler's: any is taken as long as no pdf is asked for.
TEST_P(ModelComposition, ValuesTakeAnySampler) {
  const std::vector<Point> points(5);
  for (const Sampler sampler : all_samplers()) {
    Composition c = plain(GetParam(), sampler);
    run_points(Operation::masking, c, points);
    for (const Operation operation :
         {Operation::evaluate_reflection, Operation::evaluate_transmission, Operation::evaluate_scattering}) {
      if (operation >= Operation::sample_transmission) c.model.interface = Interface::dielectric;
      std::vector<Result> results(points.size());
      Batch batch = make_batch(operation, c, points, results);
      batch.out.pdf = {};
      const auto statistics = run(operation, batch);
      EXPECT_TRUE(statistics.ok()) << statistics.status();
    }
  }
}

TEST_P(ModelComposition, TransmissionNeedsADielectric) {
  for (const Operation operation : kSampled) {
    if (operation < Operation::sample_transmission) continue;
    for (const Interface interface : {Interface::conductor, Interface::schlick}) {
      Composition c = plain(GetParam(), Sampler::visible);
      c.model.interface = interface;
      refused(operation, c, "model.interface", [](Batch& batch) { batch.f0 = batch.f90 = {}; });
    }
  }
}

// Columns of another interface, and a missing one.
TEST_P(ModelComposition, ColumnsFollowTheInterface) {
  const auto with = [](Interface interface) {
    Composition c = plain(GetParam(), Sampler::visible);
    c.model.interface = interface;
    return c;
  };
  refused(Operation::evaluate_reflection, with(Interface::conductor), "eta", [](Batch& b) { b.eta = 1.5f; });
  refused(Operation::evaluate_reflection, with(Interface::conductor), "f0", [](Batch& b) { b.f0 = 0.5f; });
  refused(Operation::evaluate_reflection, with(Interface::schlick), "eta", [](Batch& b) { b.eta = 1.5f; });
  refused(Operation::evaluate_reflection, with(Interface::schlick), "f0", [](Batch& b) { b.f0 = {}; });
  refused(Operation::evaluate_reflection, with(Interface::dielectric), "f90", [](Batch& b) { b.f90 = 1.0f; });
  refused(Operation::evaluate_reflection, with(Interface::dielectric), "eta", [](Batch& b) { b.eta = {}; });
}

// Operations that have no use for the reflectance run with any interface.
TEST_P(ModelComposition, OperationsWithoutReflectanceTakeAnyInterface) {
  for (const Interface interface : {Interface::schlick, Interface::dielectric})
    for (const Operation operation : {Operation::sample_normal, Operation::pdf_reflection, Operation::masking}) {
      Composition c = plain(GetParam(), Sampler::visible);
      c.model.interface = interface;
      run_points(operation, c, std::vector<Point>(5));
    }
}

TEST_P(ModelComposition, RetroTakesNoMeanSlope) {
  if (!GetParam().affine) return;
  Composition c = plain(GetParam(), Sampler::visible);
  c.model.retro = true;
  for (const Operation operation : {Operation::sample_reflection, Operation::pdf_reflection, Operation::masking}) {
    refused(operation, c, "model.retro", [](Batch& batch) { batch.mean_slope_x = 0.1f; });
    refused(operation, c, "model.retro", [](Batch& batch) { batch.mean_slope_y = 0.1f; });
    run_points(operation, c, std::vector<Point>(5));  // a correlation it takes
  }
}

INSTANTIATE_TEST_SUITE_P(Families, ModelComposition, testing::ValuesIn(families()),
                         [](const auto& info) { return name(info.param); });

struct Moment {
  std::string_view field;
  Column<float> Batch::*column;
};
const Moment kMoments[] = {{"mean_slope_x", &Batch::mean_slope_x},
                           {"mean_slope_y", &Batch::mean_slope_y},
                           {"slope_correlation", &Batch::slope_correlation}};

// Only Smith takes mean slopes and correlation, with ggx and beckmann.
TEST(ModelRefusals, MomentsAreRefusedByTheOthers) {
  for (const Family& family : families()) {
    if (family.affine || (family.masking == Masking::smith && family.distribution != Distribution::student_t)) continue;
    for (const Operation operation : {Operation::sample_reflection, Operation::evaluate_reflection, Operation::masking})
      for (const Moment& moment : kMoments)
        refused(operation, plain(family, Sampler::visible), moment.field,
                [&](Batch& batch) { batch.*moment.column = 0.25f; });
  }
}

TEST(ModelRefusals, MaskingsAndTablesFollowTheDistribution) {
  for (const Operation operation : {Operation::sample_normal, Operation::evaluate_reflection, Operation::masking}) {
    const std::string message =
        refused(operation, plain({Distribution::phong, Masking::smith}, Sampler::visible), "model.masking");
    EXPECT_NE(message.find("vcavity"), std::string::npos) << message;
    refused(operation, plain({Distribution::table, Masking::smith}, Sampler::visible), "model.table");
  }
}

TEST(ModelRefusals, UnknownValuesAreRefused) {
  const Family family = families()[0];
  const auto changed = [&](const std::function<void(Model&)>& change) {
    Composition c = plain(family, Sampler::visible);
    change(c.model);
    return c;
  };
  const Operation op = Operation::sample_reflection;
  refused(op, changed([](Model& m) { m.distribution = Distribution{5}; }), "model.distribution");
  refused(op, changed([](Model& m) { m.masking = Masking{2}; }), "model.masking");
  refused(op, changed([](Model& m) { m.shadowing = Shadowing{2}; }), "model.shadowing");
  refused(op, changed([](Model& m) { m.normalisation = Normalisation{2}; }), "model.normalisation");
  refused(op, changed([](Model& m) { m.interface = Interface{3}; }), "model.interface");
  refused(op, changed([](Model& m) { m.transport = Transport{2}; }), "model.transport");
  refused(op, plain(family, Sampler{6}), "sampler");
}

}  // namespace
}  // namespace facetwise::test
