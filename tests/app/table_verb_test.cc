// SPDX-License-Identifier: Apache-2.0
// table: what is built once and saved gives the same samples as the text it was built from.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/app/command.h"

namespace facetwise::test {
namespace {

// Densities exp(-(x - mean)^2 - y^2) over [-3, 3]^2.
std::string text_of_slopes(double mean) {
  constexpr int kSide = 41;
  std::string text = "facetwise-slopes 1 41 41 -3 3 -3 3\n";
  for (int j = 0; j < kSide; ++j) {
    for (int k = 0; k < kSide; ++k) {
      const double x = -3 + 6.0 * k / (kSide - 1) - mean, y = -3 + 6.0 * j / (kSide - 1);
      text += std::to_string(std::exp(-x * x - y * y)) + " ";
    }
    text += "\n";
  }
  return text;
}

const std::string kLane = "ix,iy,iz,alpha_x,alpha_y\n0.6,0,0.8,0.5,0.5\n-0.3,0.4,0.8660254,0.5,0.7\n";

// A table that `facetwise table` builds from such a text, called with `option`.
struct Built {
  Built(double mean, const std::string& option) {
    write_file(text, text_of_slopes(mean));
    result = facetwise({"table", "--input", text, "--output", saved, option});
  }
  const Directory directory;
  const std::string text = directory.path("slopes.txt"), saved = directory.path("slopes.table");
  Result result;
};

TEST(TableVerb, SavedTablesGiveTheSameSamples) {
  const Built table(0.25, "--json");
  const Result& built = table.result;
  ASSERT_EQ(built.code, 0) << built.err;
  EXPECT_NE(built.err.find("facetwise table: 100 %"), std::string::npos) << built.err;
  const auto report = nlohmann::json::parse(built.out);
  EXPECT_FALSE(report["radial"].get<bool>());
  EXPECT_NEAR(report["mean_slope"][0].get<double>(), 0.25, 0.01);
  EXPECT_NEAR(report["mean_slope"][1].get<double>(), 0, 0.01);
  EXPECT_EQ(report["id"].get<std::string>().size(), 16u);

  const auto sample = [&](const std::string& path) {
    const auto result = facetwise({"sample", "--distribution", "table:" + path, "--seed", "5"}, kLane);
    EXPECT_EQ(result.code, 0) << result.err;
    return result.out;
  };
  EXPECT_EQ(sample(table.saved), sample(table.text));
}

TEST(TableVerb, RadialTablesTakeVcavity) {
  const Built table(0, "--radial");
  const Result& built = table.result;
  ASSERT_EQ(built.code, 0) << built.err;
  EXPECT_NE(built.out.find("radial"), std::string::npos) << built.out;
  EXPECT_EQ(built.out.find("not radial"), std::string::npos) << built.out;
  const auto result =
      facetwise({"sample", "--distribution", "table:" + table.saved, "--masking", "vcavity", "--seed", "5"}, kLane);
  EXPECT_EQ(result.code, 0) << result.err;
}

TEST(TableVerb, ErrorsNameTheFile) {
  const Directory directory;
  const std::string bad = directory.path("bad.txt"), saved = directory.path("saved.table");
  write_file(bad, "facetwise-slopes 1 3 3 -1 1 -1 1\n1 2 3\n");
  for (const std::string& input : {bad, directory.path("missing.txt")}) {
    const auto result = facetwise({"table", "--input", input, "--output", saved});
    EXPECT_EQ(result.code, 1);
    EXPECT_NE(result.err.find(input), std::string::npos) << result.err;
  }
  EXPECT_EQ(directory.files(), std::vector<std::string>{"bad.txt"});
  EXPECT_EQ(facetwise({"table", "--input", bad}).code, 2);
}

}  // namespace
}  // namespace facetwise::test
