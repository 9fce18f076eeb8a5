// SPDX-License-Identifier: Apache-2.0
// load: how long a server's calls take.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/arguments.h"
#include "app/interrupt.h"
#include "app/load.h"
#include "app/progress.h"
#include "app/verbs.h"

namespace facetwise::app {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::pair<const char*, double> kPercentiles[] = {
    {"p50", 0.5}, {"p90", 0.9}, {"p99", 0.99}, {"p99.9", 0.999}, {"max", 1}};

// Four bars to a doubling, from the one that holds the least to the one that holds the most.
struct Bar {
  double from, to;  // microseconds
  std::size_t calls;
};
std::vector<Bar> bars(const LoadResult& result) {
  std::vector<Bar> all;
  if (result.microseconds.empty()) return all;
  const auto place = [](double microseconds) {
    return static_cast<int>(std::floor(4 * std::log2(std::max(microseconds, 1.0))));
  };
  const int first = place(result.microseconds.front());
  for (int k = first; k <= place(result.microseconds.back()); ++k)
    all.push_back({std::exp2(k / 4.0), std::exp2((k + 1) / 4.0), 0});
  for (const double microseconds : result.microseconds)
    ++all[static_cast<std::size_t>(place(microseconds) - first)].calls;
  return all;
}

struct LoadVerb {
  LoadOptions options;
  EngineArguments engine;
  bool json = false;

  int run() {
    options.servers = engine.remote;
    options.connection = engine.connection;
    catch_interrupts();
    Progress progress("load");
    const auto result = run_load(
        options, [&](double done) { progress(done); }, interrupted);
    if (!result.ok()) return fail("load", result.status());
    if (json)
      print_json(*result);
    else
      print(*result);
    if (result->failed == 0) return kDone;
    fmt::print(stderr, "facetwise load: {} calls failed; the first: {}\n", result->failed, result->error);
    return kFailed;
  }

  void print(const LoadResult& result) const {
    fmt::print("{} calls of {} lanes in {:.1f} s, {} failed; milliseconds from when each was due\n",
               result.microseconds.size() + result.failed, options.lanes, result.seconds, result.failed);
    if (options.beside > 0)
      fmt::print("beside {} callers of {} lanes, who got {:.1f} million lanes a second\n", options.beside,
                 options.beside_lanes, result.beside_lanes_per_second * 1e-6);
    for (const auto& [name, p] : kPercentiles) fmt::print("{:>6} {:>9.3f}\n", name, result.percentile(p) * 1e-3);
    const std::vector<Bar> all = bars(result);
    std::size_t most = 1;
    for (const Bar& bar : all) most = std::max(most, bar.calls);
    fmt::print("\n");
    for (const Bar& bar : all)
      fmt::print("{:>9.3f} {:>8} {}\n", bar.from * 1e-3, bar.calls, std::string(60 * bar.calls / most, '#'));
  }

  void print_json(const LoadResult& result) const {
    Json out = {{"lanes", options.lanes},
                {"rate", options.rate},
                {"seconds", result.seconds},
                {"connections", options.connections},
                {"calls", result.microseconds.size() + result.failed},
                {"failed", result.failed}};
    for (const auto& [name, p] : kPercentiles) out["microseconds"][name] = result.percentile(p);
    out["histogram"] = Json::array();
    for (const Bar& bar : bars(result))
      out["histogram"].push_back({{"from", bar.from}, {"to", bar.to}, {"calls", bar.calls}});
    out["beside"] = {{"callers", options.beside},
                     {"lanes", options.beside_lanes},
                     {"lanes_per_second", result.beside_lanes_per_second}};
    fmt::print("{}\n", out.dump(2));
  }
};

}  // namespace

Verb add_load(CLI::App& app) {
  auto arguments = std::make_shared<LoadVerb>();
  LoadOptions& options = arguments->options;
  CLI::App& command = *app.add_subcommand("load", "Measure how long a server's calls take under load");
  command.footer(
      R"(Calls come at a fixed rate, whether or not those before them are answered, and a call's time runs from when it was due. So a
server that cannot keep up shows it. A call that fails is tried again as by every client, and its time goes on.

Examples:
  facetwise load --remote unix:/tmp/facetwise.sock --rate 500
  facetwise load --remote unix:/tmp/facetwise.sock --rate 50 --beside 8 --json)");
  arguments->engine.add_remote(command);
  command.get_option("--remote")->required()->description("The servers: unix:PATH or HOST:PORT, separated by commas");
  const auto add_number = [&](const char* flag, auto& number, double least, double most, const char* help,
                              const char* unit) {
    command.add_option(flag, number, help)->check(CLI::Range(least, most))->option_text(unit);
  };
  add_number("--lanes", options.lanes, 1, 1e8, "Lanes of a call; default 1024", "N");
  add_number("--rate", options.rate, 0.01, 1e6, "Calls a second; default 100", "R");
  add_number("--seconds", options.seconds, 0.1, 86400, "How long; default 10", "S");
  add_number("--connections", options.connections, 1, 1000, "Calls at once at most; default 8", "N");
  add_number("--beside", options.beside, 0, 1000, "Callers of large batches meanwhile, one after another; default 0",
             "N");
  add_number("--beside-lanes", options.beside_lanes, 1, 1e8, "Lanes of those; default 4194304", "N");
  command.add_flag("--json", arguments->json, "Print JSON");
  return {&command, [arguments] { return arguments->run(); }};
}

}  // namespace facetwise::app
