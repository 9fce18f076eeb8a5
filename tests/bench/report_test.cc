// SPDX-License-Identifier: Apache-2.0
// The report as JSON and as a table.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "facetwise/bench.h"

namespace facetwise {
namespace {

using Json = nlohmann::json;

// Every number is finite (JSON has no others, so that they would be null) and no field is null, except those
// named.
void expect_no_null(const Json& json, const std::set<std::string>& may_be_null, const std::string& path = "") {
  if (json.is_structured()) {
    for (const auto& [key, value] : json.items())
      if (!may_be_null.contains(key)) expect_no_null(value, may_be_null, path + "/" + key);
  } else {
    EXPECT_FALSE(json.is_null()) << path;
  }
}

void expect_result(const Json& r) {
  for (const char* key : {"operation", "distribution", "masking", "sampler", "implementation"})
    EXPECT_TRUE(r.at(key).is_string()) << key;
  EXPECT_EQ(r.at("distribution"), "ggx");
  EXPECT_EQ(r.at("masking"), "smith");
  ASSERT_EQ(r.at("alpha").size(), 2u);
  EXPECT_TRUE(r.at("alpha")[0].is_number() && r.at("alpha")[1].is_number());
  EXPECT_TRUE((std::set<std::string>{"scalar", "one-lane", "simd", "simd-threads", "remote"})
                  .contains(r.at("implementation").get<std::string>()));
  for (const char* key : {"batch", "rejected", "samples"}) EXPECT_TRUE(r.at(key).is_number_unsigned()) << key;
  for (const char* key : {"ns_per_sample", "samples_per_second", "bytes_per_second"}) {
    EXPECT_TRUE(r.at(key).is_number_float()) << key;
    EXPECT_GT(r.at(key).get<double>(), 0) << key;
  }
  EXPECT_NEAR(r.at("ns_per_sample").get<double>() * r.at("samples_per_second").get<double>(), 1e9, 1);
  EXPECT_LE(r.at("rejected").get<double>(), r.at("samples").get<double>());
}

TEST(Report, JsonOfARunFitsTheSchema) {
  BenchOptions options;
  options.filter = "(bounded|exact|none)/0.8,0.1/256/simd";
  options.min_seconds = 0.01;
  const auto report = run_bench(options);
  ASSERT_TRUE(report.ok()) << report.status();
  const Json json = Json::parse(bench_json(*report));
  EXPECT_EQ(json.at("version"), version());
  EXPECT_TRUE(json.at("machine").at("cpu").is_string());
  EXPECT_GE(json.at("machine").at("cores").get<int>(), 1);
  EXPECT_EQ(json.at("machine").at("target"), name(available_targets().front()));
  ASSERT_EQ(json.at("results").size(), report->results.size());
  for (const Json& result : json.at("results")) expect_result(result);
  EXPECT_EQ(json.at("results").at(0).at("alpha"), Json({0.8, 0.1}));
  for (const Json& copy : json.at("limits").at("copy")) {
    EXPECT_GT(copy.at("ns_per_sample").get<double>(), 0);
    EXPECT_GT(copy.at("bytes_per_second").get<double>(), 1e6);
  }
  ASSERT_FALSE(json.at("limits").at("fma").empty());
  for (const Json& fma : json.at("limits").at("fma")) EXPECT_GT(fma.at("flops_per_second").get<double>(), 1e8);
  EXPECT_TRUE(json.at("rejections").is_array());
  EXPECT_TRUE(json.at("targets").is_array());
  expect_no_null(json, {});
}

BenchReport written_report() {
  BenchReport report;
  report.version = "1.2.3";
  report.machine = {"a cpu", 4, "avx2"};
  report.threads = 4;
  BenchResult r{.operation = Operation::sample_reflection,
                .sampler = "ndf",
                .alpha_x = 0.3,
                .alpha_y = 0.3,
                .implementation = "scalar",
                .inputs = "columns",
                .batch = 65536,
                .ns_per_sample = 24,
                .ns_per_sample_min = 23,
                .repetitions = 5,
                .samples = 65536,
                .rejected = 16384,
                .bytes_per_sample = 44};
  report.results.push_back(r);
  r.implementation = "simd";
  r.ns_per_sample = 2;
  r.share_of_copy = 0.5;
  r.share_of_fma = 0.25;
  report.results.push_back(r);
  r.implementation = "remote";
  r.ns_per_sample = 20;
  r.rejected = r.samples;  // nothing was accepted
  report.results.push_back(r);
  for (const Sampler sampler : all_samplers())
    for (const char* experiment : {"table", "sweep", "post-2015"})
      report.rejections.push_back(
          {experiment, "ggx", "smith", std::string(name(sampler)), 30, 0.5, 0.5, 1000000, 195000, 0.1951});
  report.limits.copy = {{7, 4, 65536, 1, 1.0}, {7, 4, 65536, 4, 0.5}};
  report.limits.fma = {{Target::avx2, 1, 1e11}};
  report.targets = {{"fast", 13, true, 14.5, "x", "a note"},
                    {"slow", 1.4, false, 1.5, "x", ""},
                    {"nowhere", 25, true, std::nullopt, "M/s", "no server was given"}};
  return report;
}

TEST(Report, JsonSaysWhatWasNotMeasured) {
  const Json json = Json::parse(bench_json(written_report()));
  expect_no_null(json, {"ns_per_accepted", "measured", "met"});
  EXPECT_DOUBLE_EQ(json.at("results").at(1).at("ns_per_accepted").get<double>(), 2 / 0.75);
  EXPECT_TRUE(json.at("results").at(2).at("ns_per_accepted").is_null());
  EXPECT_FALSE(json.at("results").at(0).contains("share_of_copy"));
  EXPECT_EQ(json.at("targets").at(0).at("met"), true);
  EXPECT_EQ(json.at("targets").at(0).at("at_least"), 13);
  EXPECT_EQ(json.at("targets").at(1).at("met"), false);
  EXPECT_EQ(json.at("targets").at(1).at("at_most"), 1.4);
  EXPECT_TRUE(json.at("targets").at(2).at("met").is_null());
}

TEST(Report, TableHasRatiosAndShares) {
  const std::string table = bench_table(written_report());
  for (const char* expected :
       {"facetwise 1.2.3 on a cpu, 4 cores, 4 threads, target avx2", "sample_reflection", "0.3, 0.3", "64 k", "2 (12x)",
        "20 (1.2x)", "25.00 %", "50 %", "25 %", "100 GFLOP/s", "44.0 GB/s", "0.1950 [0.1951]", ">= 13", "14.50  met",
        "<= 1.4", "1.50  NOT MET", "-  not measured", "a note", "no server was given"})
    EXPECT_NE(table.find(expected), std::string::npos) << expected << "\n" << table;
  // Nothing but the head where nothing was done.
  EXPECT_EQ(bench_table(BenchReport{}).find("Performance to reach"), std::string::npos);
}

}  // namespace
}  // namespace facetwise
