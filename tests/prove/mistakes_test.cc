// SPDX-License-Identifier: Apache-2.0
// A right BSDF, and the same with one mistake each: the property that it breaks says so.
#include <cmath>
#include <limits>
#include <set>

#include "facetwise/prove.h"
#include "gtest/gtest.h"

namespace facetwise::prove {
namespace {

// What is done to the answers of sample() and evaluate().
struct Mistake {
  const char* name;
  Property breaks;
  void (*before)(Lanes&) = nullptr;
  void (*sampled)(Lanes&) = nullptr;
  void (*evaluated)(Lanes&) = nullptr;
};

class Mistaken : public Bsdf {
 public:
  Mistaken(const Mistake& mistake, const Model& model, Sampler sampler)
      : mistake_(mistake), right_(of_engine("right", local_engine(), model, sampler, 1.5f)) {}
  std::string name() const override { return mistake_.name; }
  absl::Status sample(Lanes& lanes) override {
    if (mistake_.before != nullptr) mistake_.before(lanes);
    auto status = right_->sample(lanes);
    if (mistake_.sampled != nullptr) mistake_.sampled(lanes);
    return status;
  }
  absl::Status evaluate(Lanes& lanes) override {
    auto status = right_->evaluate(lanes);
    if (mistake_.evaluated != nullptr) mistake_.evaluated(lanes);
    return status;
  }

 private:
  const Mistake mistake_;
  const std::unique_ptr<Bsdf> right_;
};

template <class Body>
void each(Lanes& lanes, const Body& body) {
  for (std::size_t k = 0; k < lanes.count(); ++k) body(k);
}

const Mistake kMistakes[] = {
    {.name = "one NaN", .breaks = Property::numbers, .sampled = [](Lanes& l) { l.pdf[17] = NAN; }},
    {.name = "a negative weight at grazing incidence",
     .breaks = Property::numbers,
     .sampled =
         [](Lanes& l) {
           each(l, [&](auto k) {
             if (l.iz[k] < 1e-3f) l.weight[k] = -1e-6f;
           });
         }},
    {.name = "NaN from NaN",
     .breaks = Property::garbage,
     .evaluated =
         [](Lanes& l) {
           each(l, [&](auto k) {
             if (std::isnan(l.ix[k])) l.value[k] = NAN;
           });
         }},
    {.name = "directions that are too long",
     .breaks = Property::directions,
     .sampled = [](Lanes& l) { each(l, [&](auto k) { l.oz[k] *= 1.01f; }); }},
    {.name = "pdf of one hundredth too much",
     .breaks = Property::density,
     .sampled = [](Lanes& l) { each(l, [&](auto k) { l.pdf[k] *= 1.01f, l.weight[k] /= 1.01f; }); },
     .evaluated = [](Lanes& l) { each(l, [&](auto k) { l.pdf[k] *= 1.01f; }); }},
    {.name = "u not uniform",
     .breaks = Property::distribution,
     .before = [](Lanes& l) { each(l, [&](auto k) { l.u2[k] *= 0.5f + 0.5f * l.u2[k]; }); }},
    {.name = "a sample's pdf one hundredth too large",
     .breaks = Property::pdf,
     .sampled = [](Lanes& l) { each(l, [&](auto k) { l.pdf[k] *= 1.01f; }); }},
    {.name = "weights one hundredth too small",
     .breaks = Property::weight,
     .sampled = [](Lanes& l) { each(l, [&](auto k) { l.weight[k] *= 0.99f; }); }},
    {.name = "a mean weight that is not the value's",
     .breaks = Property::albedo,
     .sampled = [](Lanes& l) { each(l, [&](auto k) { l.weight[k] *= 0.99f; }); }},
    {.name = "more light than arrives",
     .breaks = Property::energy,
     .sampled = [](Lanes& l) { each(l, [&](auto k) { l.weight[k] *= 1.5f; }); },
     .evaluated = [](Lanes& l) { each(l, [&](auto k) { l.value[k] *= 1.5f; }); }},
    {.name = "a value that depends on where the light comes from",
     .breaks = Property::reciprocity,
     .sampled = [](Lanes& l) { each(l, [&](auto k) { l.weight[k] *= 0.7f + 0.2f * l.iz[k]; }); },
     .evaluated = [](Lanes& l) { each(l, [&](auto k) { l.value[k] *= 0.7f + 0.2f * l.iz[k]; }); }},
};

std::set<Property> broken(Bsdf& bsdf) {
  Options options;
  options.samples = 200'000;
  options.strict = true;
  options.configurations = {{30, 40, 0.3f, 0.3f}, {75, 200, 0.2f, 0.6f}};
  const auto proof = prove(bsdf, options);
  EXPECT_TRUE(proof.ok()) << proof.status();
  std::set<Property> failed;
  if (!proof.ok()) return failed;
  for (const Property property : all_properties()) {
    const auto summary = proof->summary(property);
    EXPECT_GT(summary.tried, 0) << name(property);
    if (summary.failed == 0) continue;
    failed.insert(property);
    std::printf("  %s: %s\n", std::string(name(property)).c_str(), summary.worst->what.c_str());
  }
  EXPECT_EQ(proof->holds(), failed.empty());
  return failed;
}

TEST(Prove, EachMistakeIsFoundByWhatItBreaks) {
  for (const Mistake& mistake : kMistakes) {
    Mistaken bsdf(mistake, {}, Sampler::exact);
    const auto failed = broken(bsdf);
    EXPECT_TRUE(failed.contains(mistake.breaks)) << mistake.name;
    // What has it in common breaks with it, and nothing else.
    std::set<Property> may{mistake.breaks, Property::albedo};
    if (mistake.breaks == Property::numbers || mistake.breaks == Property::reciprocity) may.insert(Property::garbage);
    if (mistake.breaks == Property::weight || mistake.breaks == Property::albedo || mistake.breaks == Property::pdf)
      may.insert(Property::weight);
    if (mistake.breaks == Property::directions)
      may.insert({Property::pdf, Property::weight, Property::distribution, Property::reciprocity});
    for (const Property property : failed)
      EXPECT_TRUE(may.contains(property)) << mistake.name << ": " << name(property);
  }
}

TEST(Prove, EveryModelOfTheLibraryHolds) {
  const Mistake none{.name = "right", .breaks = Property::numbers};
  for (const Distribution distribution :
       {Distribution::ggx, Distribution::beckmann, Distribution::student_t, Distribution::phong})
    for (const Masking masking : {Masking::smith, Masking::vcavity}) {
      Model model;
      model.distribution = distribution;
      model.masking = masking;
      for (const Sampler sampler : all_samplers()) {
        const auto fits = samplers_for(Operation::sample_reflection, model);
        if (std::find(fits.begin(), fits.end(), sampler) == fits.end()) continue;
        Mistaken bsdf(none, model, sampler);
        EXPECT_TRUE(broken(bsdf).empty()) << name(distribution) << ' ' << name(masking) << ' ' << name(sampler);
      }
    }
  Model glass;
  glass.interface = Interface::dielectric;
  glass.transport = Transport::importance;
  Mistaken bsdf(none, glass, Sampler::visible);
  EXPECT_TRUE(broken(bsdf).empty());
}

}  // namespace
}  // namespace facetwise::prove
