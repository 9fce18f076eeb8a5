// SPDX-License-Identifier: Apache-2.0
#include "facetwise/experiments.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "absl/strings/escaping.h"

namespace facetwise::experiments {
namespace {

// Those of a few seconds; what is random in them has fixed seeds. (`wasted` is tests/report's.)
class Quick : public ::testing::TestWithParam<std::string> {};

absl::StatusOr<Page> run(std::string_view id, const Options& options) {
  for (const Experiment& experiment : all_experiments())
    if (experiment.id == id) return experiment.run(options);
  return absl::NotFoundError("no such experiment");
}

TEST_P(Quick, FindsWhatTheTextClaims) {
  Options options;
  options.size = Options::Size::quick;
  double last = 0;
  options.progress = [&](std::string_view, double done) {
    EXPECT_GE(done, last - 1e-9);
    EXPECT_LE(done, 1);
    last = done;
    return true;
  };
  const auto page = run(GetParam(), options);
  ASSERT_TRUE(page.ok()) << page.status();
  EXPECT_GT(last, 0.5);
  EXPECT_FALSE(page->claims.empty());
  for (const auto& claim : page->claims)
    EXPECT_NE(claim.verdict, Verdict::differs) << claim.says << "\n" << claim.measured;

  // The page as JSON has all of it.
  const auto json = nlohmann::json::parse(page_json(*page));
  EXPECT_EQ(json["id"], GetParam());
  EXPECT_EQ(json["claims"].size(), page->claims.size());
  ASSERT_EQ(json["figures"].size(), page->figures.size());
  for (const auto& figure : json["figures"]) {
    EXPECT_FALSE(figure["title"].get<std::string>().empty());
    if (figure["type"] == "table") {
      EXPECT_FALSE(figure["rows"].empty());
      for (const auto& row : figure["rows"]) EXPECT_EQ(row.size(), figure["columns"].size());
    } else {
      EXPECT_FALSE(figure["alt"].get<std::string>().empty());
    }
    if (figure["type"] == "pictures")
      for (const auto& picture : figure["pictures"]) {
        std::string png;
        ASSERT_TRUE(absl::Base64Unescape(picture["png"].get<std::string>(), &png));
        EXPECT_EQ(png.substr(1, 3), "PNG");
      }
  }
}

INSTANTIATE_TEST_SUITE_P(All, Quick, ::testing::Values("backfacing", "relief", "retro"),
                         [](const auto& info) { return info.param; });

TEST(Experiments, StopWhenAsked) {
  for (const Experiment& experiment : all_experiments()) {
    Options options;
    options.size = Options::Size::quick;
    int steps = 0;
    options.progress = [&](std::string_view, double) { return ++steps < 3; };
    const auto page = experiment.run(options);
    EXPECT_TRUE(absl::IsCancelled(page.status())) << experiment.id << ": " << page.status();
  }
}

}  // namespace
}  // namespace facetwise::experiments
