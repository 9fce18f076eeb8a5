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
  expect_round_trip({Distribution::ggx}, parse_distribution);
  expect_round_trip({Masking::smith}, parse_masking);
  expect_round_trip({Shadowing::correlated, Shadowing::uncorrelated}, parse_shadowing);
  expect_round_trip({Sampler::ndf, Sampler::heitz, Sampler::cap, Sampler::bounded, Sampler::exact},
                    parse_sampler);
  expect_round_trip({Target::best, Target::scalar, Target::avx2, Target::avx3, Target::neon}, parse_target);
  expect_round_trip({Operation::sample_normal, Operation::sample_reflection, Operation::pdf_reflection,
                     Operation::evaluate_reflection, Operation::evaluate_and_pdf, Operation::masking},
                    parse_operation);
  EXPECT_EQ(parse_sampler("visible"), Sampler::cap);
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
  EXPECT_EQ(input_fields().size(), 11u);
  EXPECT_EQ(output_fields().size(), 13u);
}

}  // namespace
}  // namespace facetwise::test
