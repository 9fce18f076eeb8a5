// SPDX-License-Identifier: Apache-2.0
// Which benchmarks there are, and which a filter chooses.
#include "bench/case.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <set>
#include <string>

namespace facetwise::bench {
namespace {

std::set<std::string> names(const BenchOptions& options) {
  const auto cases = choose_cases(options);
  EXPECT_TRUE(cases.ok()) << cases.status();
  std::set<std::string> names;
  for (const Case& which : *cases) EXPECT_TRUE(names.insert(describe(which).name()).second) << describe(which).name();
  return names;
}

class Cases : public testing::Test {
 protected:
  Cases() { options_.remote = engine_.get(); }
  std::unique_ptr<Engine> engine_ = local_engine();
  BenchOptions options_;
};

TEST_F(Cases, FullHasEveryCombination) {
  options_.suite = BenchSuite::full;
  const auto all = names(options_);
  for (const char* operation :
       {"sample_normal/ndf", "sample_normal/heitz", "sample_normal/cap", "sample_reflection/ndf",
        "sample_reflection/heitz", "sample_reflection/cap", "sample_reflection/bounded", "sample_reflection/exact",
        "pdf_reflection/ndf", "pdf_reflection/exact", "evaluate_reflection/none", "evaluate_reflection/cap",
        "evaluate_reflection/exact", "masking/none"})
    for (const char* alpha : {"mixed", "0.01,0.01", "0.3,0.3", "1,1", "0.8,0.1"})
      for (const char* batch : {"256", "4096", "65536", "1048576", "16777216"})
        for (const char* implementation : {"scalar", "one-lane", "simd", "simd-threads", "remote"}) {
          const std::string name = std::string(operation) + "/" + alpha + "/" + batch + "/" + implementation;
          EXPECT_TRUE(all.contains(name)) << name;
        }
}

TEST_F(Cases, QuickIsPartOfStandardIsPartOfFull) {
  options_.suite = BenchSuite::full;
  const auto full = names(options_);
  options_.suite = BenchSuite::standard;
  const auto standard = names(options_);
  options_.suite = BenchSuite::quick;
  const auto quick = names(options_);
  EXPECT_TRUE(std::includes(full.begin(), full.end(), standard.begin(), standard.end()));
  EXPECT_TRUE(std::includes(standard.begin(), standard.end(), quick.begin(), quick.end()));
  EXPECT_LT(quick.size(), standard.size());
  EXPECT_LT(standard.size(), full.size());
}

TEST_F(Cases, ComparableCasesAreTogether) {
  // A group that came back later would be measured apart, and its ratios would not be of one moment.
  options_.suite = BenchSuite::full;
  const auto cases = choose_cases(options_);
  ASSERT_TRUE(cases.ok());
  std::set<std::string> finished;
  for (std::size_t k = 0; k < cases->size(); ++k) {
    Case group = (*cases)[k];
    group.implementation = Implementation::simd;
    const std::string name = describe(group).name();
    EXPECT_FALSE(finished.contains(name)) << name;
    if (k + 1 < cases->size() && !(*cases)[k].comparable((*cases)[k + 1])) finished.insert(name);
  }
}

TEST_F(Cases, FilterSearchesInNames) {
  options_.filter = "^sample_reflection/(bounded|exact)/0.3,0.3/65536/simd$";
  EXPECT_EQ(names(options_), (std::set<std::string>{"sample_reflection/bounded/0.3,0.3/65536/simd",
                                                    "sample_reflection/exact/0.3,0.3/65536/simd"}));
  // Beyond the standard ones, unless a suite is named too.
  options_.filter = "sample_reflection/ndf/0.01,0.01/256/scalar$";
  EXPECT_EQ(names(options_).size(), 1u);
  options_.suite = BenchSuite::quick;
  EXPECT_EQ(choose_cases(options_).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(Cases, FilterThatIsNoExpressionOrMatchesNothingIsAnError) {
  for (const char* filter : {"(", "[", "*", "a{2,1}", "no such benchmark", "bounded/0.3,0.3/65537"}) {
    options_.filter = filter;
    const auto cases = choose_cases(options_);
    EXPECT_EQ(cases.status().code(), absl::StatusCode::kInvalidArgument) << filter;
    EXPECT_EQ(cases.status().message().substr(0, 8), "filter: ") << cases.status();
  }
}

TEST_F(Cases, RemoteNeedsAServer) {
  EXPECT_TRUE(names(options_).contains("sample_reflection/bounded/0.3,0.3/65536/remote"));
  options_.remote = nullptr;
  for (const std::string& name : names(options_)) EXPECT_EQ(name.find("remote"), std::string::npos) << name;
  options_.filter = "/remote";
  EXPECT_EQ(choose_cases(options_).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(Case, BytesAreThoseOfTheColumns) {
  Case which{.sampler = Sampler::bounded};
  EXPECT_EQ(describe(which).bytes_per_sample, 4.0 * (3 + 2 + 2 + 4));
  which.sampler = Sampler::exact;
  EXPECT_EQ(describe(which).bytes_per_sample, 4.0 * (3 + 2 + 3 + 4));
  which.inputs = Inputs::generator;
  EXPECT_EQ(describe(which).bytes_per_sample, 4.0 * (3 + 2 + 4));
  which.inputs = Inputs::one_roughness;
  EXPECT_EQ(describe(which).bytes_per_sample, 4.0 * (3 + 3 + 4));
  EXPECT_EQ(describe({.operation = Operation::evaluate_reflection, .sampler = Sampler::exact}).bytes_per_sample,
            4.0 * (3 + 2 + 3 + 2));
  EXPECT_EQ(describe({.operation = Operation::masking, .sampler = std::nullopt}).bytes_per_sample, 4.0 * (3 + 2 + 1));
}

}  // namespace
}  // namespace facetwise::bench
