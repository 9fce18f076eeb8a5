// SPDX-License-Identifier: Apache-2.0
// summary: what run.sh ends with, from the JSON that bench and verify wrote.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/arguments.h"
#include "app/errors.h"
#include "app/verbs.h"
#include "facetwise/bench.h"

namespace facetwise::app {
namespace {

using Json = nlohmann::json;

constexpr std::array kImplementations = {"scalar", "auto", "one-lane", "simd", "simd-threads", "remote"};
enum Implementation { kScalar, kAuto, kOneLane, kSimd, kThreads, kRemote, kCount };

absl::StatusOr<Json> read_json(const std::string& path) {
  std::ifstream file(path);
  if (!file) return invalid("{}: cannot read", path);
  Json json = Json::parse(file, nullptr, false);
  if (json.is_discarded()) return invalid("{}: not JSON", path);
  return json;
}

// GGX with Smith masking where neither is said.
std::string sampler_name(const Json& json) {
  return bench_name(json.value("distribution", "ggx"), json.value("masking", "smith"),
                    json.at("sampler").get<std::string>());
}

// The rates of one operation, sampler and roughness; each implementation at its best batch size.
struct Row {
  std::array<double, kCount> rate{};  // samples per second, 0 if not measured
  int measured() const {
    return static_cast<int>(std::count_if(rate.begin(), rate.end(), [](double r) { return r > 0; }));
  }
};

std::string millions(double rate) { return rate > 0 ? fmt::format("{:.1f}", 1e-6 * rate) : "-"; }
std::string ratio(double a, double b) { return a > 0 && b > 0 ? fmt::format("{:.2f}", a / b) : "-"; }

struct Table {
  struct Group {
    std::string operation, sampler;  // as in the benchmarks' names
    std::map<std::pair<double, double>, Row> by_alpha;
  };
  std::vector<Group> groups;  // in the report's order

  explicit Table(const Json& report) {
    for (const Json& result : report.at("results")) {
      const auto found = std::find(kImplementations.begin(), kImplementations.end(), result.at("implementation"));
      if (found == kImplementations.end() || result.value("inputs", "columns") != "columns") continue;
      const Json& alpha = result.at("alpha");  // or "mixed"
      const auto key = alpha.is_array() ? std::pair<double, double>(alpha.at(0), alpha.at(1)) : std::pair(0.0, 0.0);
      Row& row = group(result.at("operation"), sampler_name(result)).by_alpha[key];
      double& rate = row.rate[static_cast<std::size_t>(found - kImplementations.begin())];
      rate = std::max(rate, result.at("samples_per_second").get<double>());
    }
  }

  Group& group(const std::string& operation, const std::string& sampler) {
    for (Group& group : groups)
      if (group.operation == operation && group.sampler == sampler) return group;
    return groups.emplace_back(Group{operation, sampler, {}});
  }

  void print() const {
    constexpr const char* kLine = "  {:<20} {:<25} {:>9} {:>7} {:>7} {:>9} {:>7} {:>8} {:>7} {:>12} {:>13} {:>12}\n";
    fmt::print("\nThroughput, million samples a second, each at its best batch size\n");
    fmt::print(kLine, "operation", "sampler", "alpha", "scalar", "auto", "one lane", "SIMD", "threads", "remote",
               "SIMD/scalar", "threads/SIMD", "remote/SIMD");
    for (const Group& group : groups) {
      // The roughness that most implementations were measured at.
      const auto& [alpha, row] =
          *std::max_element(group.by_alpha.begin(), group.by_alpha.end(),
                            [](const auto& a, const auto& b) { return a.second.measured() < b.second.measured(); });
      const auto& rate = row.rate;
      fmt::print(kLine, group.operation, group.sampler, alpha_text(alpha.first, alpha.second), millions(rate[kScalar]),
                 millions(rate[kAuto]), millions(rate[kOneLane]), millions(rate[kSimd]), millions(rate[kThreads]),
                 millions(rate[kRemote]), ratio(rate[kSimd], rate[kScalar]), ratio(rate[kThreads], rate[kSimd]),
                 ratio(rate[kRemote], rate[kSimd]));
    }
  }
};

void print_verification(const Json& verification) {
  const auto count = [&](const char* key) { return verification.at(key).get<std::uint64_t>(); };
  const auto percent = [](std::uint64_t part, std::uint64_t whole) {
    return whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
  };
  fmt::print("\nReal input\n");
  fmt::print("  mesh {}: {} triangles\n", verification.at("mesh").get<std::string>(), count("triangles"));
  fmt::print("  {} rays, {:.1f} % hit; {} lanes, {:.1f} % backfacing\n", count("rays"),
             percent(count("hits"), count("rays")), count("lanes"), percent(count("backfacing"), count("lanes")));
  fmt::print("  server against this process: {} bytes, {}\n", count("bytes_compared"),
             verification.at("equal").get<bool>() ? "every one equal" : "DIFFERENT");
  fmt::print("\nReflections occluded on it, by sampler\n");
  for (const Json& sampler : verification.at("reflections")) {
    const auto occluded = sampler.at("occluded").get<std::uint64_t>(),
               samples = sampler.at("samples").get<std::uint64_t>();
    fmt::print("  {:<24} {:>9} of {} ({:.2f} %)\n", sampler_name(sampler), occluded, samples,
               percent(occluded, samples));
  }
}

int run(const std::string& report_path, const std::string& verification_path) {
  const auto report = read_json(report_path);
  if (!report.ok()) return fail("summary", report.status());
  const auto verification = read_json(verification_path);
  if (!verification.ok()) return fail("summary", verification.status());
  try {
    const Json& machine = report->at("machine");
    fmt::print("facetwise {} on {}, {} cores, {}\n", report->at("version").get<std::string>(),
               machine.at("cpu").get<std::string>(), machine.at("cores").get<int>(),
               machine.at("target").get<std::string>());
    print_verification(*verification);
    Table(*report).print();
  } catch (const Json::exception& error) {
    return fail("summary",
                invalid("{}, {}: not what bench and verify write: {}", report_path, verification_path, error.what()));
  }
  return kDone;
}

}  // namespace

Verb add_summary(CLI::App& app) {
  struct Arguments {
    std::string report, verification;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App& command = *app.add_subcommand("summary", "Print a summary of what bench and verify wrote as JSON");
  command.footer("Example:\n  facetwise summary --report out/report.json --verification out/verify.json");
  command.add_option("--report", arguments->report, "What `bench --json` wrote")->required()->type_name("FILE");
  command.add_option("--verification", arguments->verification, "What `verify --json` wrote")
      ->required()
      ->type_name("FILE");
  return {&command, [arguments] { return run(arguments->report, arguments->verification); }};
}

}  // namespace facetwise::app
