// SPDX-License-Identifier: Apache-2.0
// bench and summary, as processes.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/app/command.h"

namespace facetwise::test {
namespace {

using Json = nlohmann::json;

// What a report must have for others to read it.
void expect_schema(const Json& report) {
  EXPECT_TRUE(report["version"].is_string());
  EXPECT_TRUE(report["machine"]["cpu"].is_string());
  EXPECT_TRUE(report["machine"]["cores"].is_number_integer());
  EXPECT_TRUE(report["machine"]["target"].is_string());
  ASSERT_FALSE(report["results"].empty());
  for (const Json& result : report["results"]) {
    for (const char* key : {"operation", "distribution", "masking", "sampler", "implementation"})
      EXPECT_TRUE(result[key].is_string()) << key;
    ASSERT_EQ(result["alpha"].size(), 2u);
    EXPECT_GT(result["ns_per_sample"], 0);
    EXPECT_NEAR(result["samples_per_second"].get<double>() * result["ns_per_sample"].get<double>(), 1e9, 1e3);
    EXPECT_GT(result["batch"], 0);
    EXPECT_GT(result["samples"], 0);
    EXPECT_TRUE(result["rejected"].is_number_integer());
  }
}

TEST(Bench, MeasuresHereAndRemotely) {
  const Directory directory;
  const Server server(directory);
  const std::string path = directory.path("report.json");
  const auto result = facetwise({"bench", "--filter", "^sample_reflection/cap/0.3,0.3/4096/[a-z-]*$", "--min-seconds",
                                 "0.01", "--no-limits", "--remote", server.address(), "--json", path});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_NE(result.out.find("sample_reflection"), std::string::npos) << result.out;
  const Json report = Json::parse(read_file(path));
  expect_schema(report);
  std::vector<std::string> implementations;
  for (const Json& row : report["results"]) implementations.push_back(row["implementation"]);
  std::sort(implementations.begin(), implementations.end());
  std::erase(implementations, "auto");  // where the compiler has vector functions for the target
  EXPECT_EQ(implementations, (std::vector<std::string>{"one-lane", "remote", "scalar", "simd", "simd-threads"}));
}

TEST(Bench, RunsOnAServersMachineIfAllowed) {
  const Directory directory;
  const Server closed(directory, "closed.sock"), open(directory, "open.sock", {"--allow-benchmark"});
  const std::string path = directory.path("report.json");
  const auto run_at = [&](const Server& server, const std::string& filter) {
    return facetwise({"bench", "--at", server.address(), "--filter", filter, "--min-seconds", "0.01", "--json", path});
  };
  const std::string filter = "^masking/.*/0.3,0.3/256/simd$";
  const auto refused = run_at(closed, filter);
  EXPECT_EQ(refused.code, 1);
  EXPECT_NE(refused.err.find("--allow-benchmark"), std::string::npos) << refused.err;
  EXPECT_FALSE(std::filesystem::exists(path));
  const auto wrong = run_at(open, "[");
  EXPECT_EQ(wrong.code, 1);
  EXPECT_NE(wrong.err.find("filter"), std::string::npos) << wrong.err;
  const auto allowed = run_at(open, filter);
  ASSERT_EQ(allowed.code, 0) << allowed.err;
  const Json report = Json::parse(read_file(path));
  expect_schema(report);
  for (const Json& row : report["results"]) EXPECT_EQ(row["operation"], "masking");
}

TEST(Bench, SaysWhatIsWrong) {
  const auto nothing = facetwise({"bench", "--filter", "no such benchmark"});
  EXPECT_EQ(nothing.code, 1);
  EXPECT_NE(nothing.err.find("filter"), std::string::npos) << nothing.err;
  EXPECT_EQ(facetwise({"bench", "--quick", "--full"}).code, 2);
  EXPECT_EQ(facetwise({"bench", "--at", "unix:/none", "--remote", "unix:/none"}).code, 2);
  const auto unwritable = facetwise({"bench", "--quick", "--json", "/none/report.json"});
  EXPECT_EQ(unwritable.code, 1);
  EXPECT_NE(unwritable.err.find("/none/report.json: "), std::string::npos) << unwritable.err;
}

Json row(const std::string& implementation, double rate, const std::string& inputs = "columns") {
  return {{"operation", "sample_reflection"}, {"sampler", "exact"}, {"alpha", {0.3, 0.3}},       {"inputs", inputs},
          {"implementation", implementation}, {"batch", 65536},     {"samples_per_second", rate}};
}

TEST(Summary, ShowsRatesRatiosAndCounts) {
  const Directory directory;
  Json report = {{"version", "1.2.3"}, {"machine", {{"cpu", "A CPU"}, {"cores", 2}, {"target", "avx2"}}}};
  report["results"] = {row("scalar", 40e6),         row("simd", 700e6),  row("simd", 800e6),
                       row("simd-threads", 1500e6), row("remote", 30e6), row("simd", 999e6, "generator")};
  const Json verification = {{"mesh", "m.glb"},
                             {"triangles", 7},
                             {"rays", 200},
                             {"hits", 120},
                             {"lanes", 100},
                             {"backfacing", 5},
                             {"bytes_compared", 3300},
                             {"equal", true},
                             {"reflections", {{{"sampler", "cap"}, {"samples", 100}, {"occluded", 12}}}}};
  write_file(directory.path("r.json"), report.dump());
  write_file(directory.path("v.json"), verification.dump());
  const std::vector<std::string> arguments = {"summary", "--report", directory.path("r.json"), "--verification",
                                              directory.path("v.json")};
  const auto result = facetwise(arguments);
  ASSERT_EQ(result.code, 0) << result.err;
  for (const char* text : {"facetwise 1.2.3 on A CPU", "60.0 % hit", "5.0 % backfacing", "every one equal",
                           "12 of 100 (12.00 %)", "40.0", "800.0", "1500.0", "30.0", "20.00", "1.88"})
    EXPECT_NE(result.out.find(text), std::string::npos) << text << " in\n" << result.out;
  EXPECT_EQ(result.out.find("999"), std::string::npos);

  write_file(directory.path("v.json"), "{}");
  EXPECT_EQ(facetwise(arguments).code, 1);
  write_file(directory.path("v.json"), "{");
  const auto broken = facetwise(arguments);
  EXPECT_EQ(broken.code, 1);
  EXPECT_NE(broken.err.find("v.json: not JSON"), std::string::npos) << broken.err;
}

}  // namespace
}  // namespace facetwise::test
