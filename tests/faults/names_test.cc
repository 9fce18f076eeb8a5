// SPDX-License-Identifier: Apache-2.0
// Names and tables of the vocabulary.
#include <set>

#include "facetwise/engine.h"
#include "gtest/gtest.h"

namespace facetwise::test {
namespace {

template <class T>
void expect_round_trip(std::initializer_list<T> values, std::optional<T> (*parse)(std::string_view)) {
  std::set<std::string_view> names;
  for (const T value : values) {
    EXPECT_EQ(parse(name(value)), value) << name(value);
    EXPECT_TRUE(names.insert(name(value)).second) << name(value);
  }
  for (const std::string_view text : {"", " ", "unknown", "GGX", "cap ", "exactly"})
    EXPECT_EQ(parse(text), std::nullopt) << text;
}

TEST(Names, RoundTrip) {
  expect_round_trip(
      {Distribution::ggx, Distribution::beckmann, Distribution::student_t, Distribution::phong, Distribution::table},
      parse_distribution);
  expect_round_trip({Masking::smith, Masking::vcavity}, parse_masking);
  expect_round_trip({Shadowing::correlated, Shadowing::uncorrelated}, parse_shadowing);
  expect_round_trip({Normalisation::unbiased, Normalisation::biased}, parse_normalisation);
  expect_round_trip({Interface::conductor, Interface::schlick, Interface::dielectric}, parse_interface);
  expect_round_trip({Transport::radiance, Transport::importance}, parse_transport);
  expect_round_trip({Compensation::none, Compensation::turquin, Compensation::kelemen}, parse_compensation);
  expect_round_trip({Sampler::ndf, Sampler::heitz, Sampler::cap, Sampler::bounded, Sampler::exact, Sampler::visible},
                    parse_sampler);
  expect_round_trip({Target::best, Target::scalar, Target::avx2, Target::avx3, Target::neon}, parse_target);
  expect_round_trip({Operation::sample_normal, Operation::sample_reflection, Operation::pdf_reflection,
                     Operation::evaluate_reflection, Operation::masking, Operation::sample_transmission,
                     Operation::evaluate_transmission, Operation::sample_scattering, Operation::evaluate_scattering,
                     Operation::albedo},
                    parse_operation);
  EXPECT_EQ(name(Sampler::cap), "cap");
  EXPECT_EQ(name(LaneStatus::accepted), "accepted");
  EXPECT_EQ(name(LaneStatus::invalid), "invalid");
}

TEST(Names, OfValuesThatDoNotExist) {
  EXPECT_EQ(name(static_cast<Sampler>(99)), "unknown");
  EXPECT_EQ(name(static_cast<Operation>(99)), "unknown");
  EXPECT_EQ(name(static_cast<Target>(99)), "unknown");
}

// The columns' tables name each column of a batch once.
TEST(Names, FieldTables) {
  Batch batch;
  std::set<const void*> columns;
  std::set<std::string_view> names;
  for (const InputField& field : input_fields()) {
    EXPECT_TRUE(columns.insert(&field.column(batch)).second);
    EXPECT_TRUE(names.insert(field.name).second);
    EXPECT_NE(field.operations, 0u);
  }
  for (const OutputField& field : output_fields()) {
    EXPECT_TRUE(columns.insert(&field.column(batch)).second);
    EXPECT_TRUE(names.insert(field.name).second);
    EXPECT_EQ(field.name.substr(0, 4), "out.");
    EXPECT_NE(field.operations, 0u);
  }
  EXPECT_EQ(input_fields().size(), 17u);
  EXPECT_EQ(output_fields().size(), 18u);
  EXPECT_EQ(byte_fields().size(), 2u);
}

}  // namespace
}  // namespace facetwise::test
