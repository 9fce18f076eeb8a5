// SPDX-License-Identifier: Apache-2.0
// experiment: the texts' experiments, as JSON for the report.
#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <memory>

#include "app/arguments.h"
#include "app/errors.h"
#include "app/interrupt.h"
#include "app/table/output_file.h"
#include "app/verbs.h"
#include "facetwise/experiments.h"

namespace facetwise::app {
namespace {

struct ExperimentVerb {
  std::vector<std::string> ids;
  std::string folder = "out/experiments";
  bool quick = false, paper = false;

  int run() {
    using Size = experiments::Options::Size;
    catch_interrupts();
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) return fail("experiment", invalid("{}: {}", folder, error.message()));
    experiments::Options options;
    options.size = quick ? Size::quick : paper ? Size::paper : Size::standard;
    for (const auto& experiment : experiments::all_experiments()) {
      if (!ids.empty() && std::find(ids.begin(), ids.end(), experiment.id) == ids.end()) continue;
      if (const auto status = run_one(experiment, options); !status.ok()) return fail("experiment", status);
    }
    return kDone;
  }

 private:
  absl::Status run_one(const experiments::Experiment& experiment, experiments::Options& options) const {
    const auto started = std::chrono::steady_clock::now();
    const auto seconds = [&] {
      return std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    };
    std::string before;
    options.progress = [&](std::string_view what, double done) {
      if (std::string text = fmt::format("[{:3.0f} %] {}: {}", 100 * done, experiment.id, what);
          text.substr(7) != before) {
        before = text.substr(7);
        fmt::print(stderr, "{}\n", text);
      }
      return !interrupted;
    };
    auto page = experiment.run(options);
    if (!page.ok()) return page.status();
    page->seconds = seconds();
    if (quick) page->command += " --quick";
    if (paper) page->command += " --paper";
    const std::string path = fmt::format("{}/{}.json", folder, experiment.id);
    if (auto status = write_file(path, experiments::page_json(*page)); !status.ok()) return status;
    fmt::print("{}: {} ({:.0f} s, {})\n", page->id, page->title, page->seconds, path);
    for (const auto& claim : page->claims)
      fmt::print("  {}\n    {}: {}\n", claim.says, name(claim.verdict), claim.measured);
    return absl::OkStatus();
  }
};

}  // namespace

Verb add_experiment(CLI::App& app) {
  auto arguments = std::make_shared<ExperimentVerb>();
  CLI::App& command =
      *app.add_subcommand("experiment", "Run the texts' experiments: what they claim, and what is measured");
  std::string list = "Experiments:\n";
  std::vector<std::string> ids;
  for (const auto& experiment : experiments::all_experiments()) {
    list += fmt::format("  {:<10} {}\n", experiment.id, experiment.title);
    ids.emplace_back(experiment.id);
  }
  command.footer(list + R"(
Each writes a page for `facetwise report` as JSON, and prints what the text says and what was measured.

Examples:
  facetwise experiment wasted
  facetwise experiment --quick)");
  command.add_option("experiments", arguments->ids, "Which; default all")
      ->check(CLI::IsMember(ids))
      ->option_text("NAME...");
  command.add_option("--folder", arguments->folder, "Where the pages go; default out/experiments")
      ->option_text("FOLDER");
  auto* quick = command.add_flag("--quick", arguments->quick, "Small pictures and few samples: about three minutes");
  command.add_flag("--paper", arguments->paper, "The texts' sizes: hours")->excludes(quick);
  return {&command, [arguments] { return arguments->run(); }};
}

}  // namespace facetwise::app
