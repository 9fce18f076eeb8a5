// SPDX-License-Identifier: Apache-2.0
// report: the page.
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "app/arguments.h"
#include "app/errors.h"
#include "app/table/output_file.h"
#include "app/verbs.h"
#include "facetwise/experiments.h"
#include "facetwise/report.h"

namespace facetwise::app {
namespace {

constexpr const char* kBench = "out/report.json";
constexpr const char* kVerification = "out/verify.json";

struct ReportVerb {
  std::string bench = kBench, verification = kVerification, folder = "out/experiments", output = "out/report.html";
  std::vector<std::string> compared, commands;

  int run() const {
    const auto status = try_run();
    return status.ok() ? kDone : fail("report", status);
  }

 private:
  absl::Status try_run() const {
    const auto page = compared.empty() ? report::page(inputs()) : report::comparison(compared[0], compared[1]);
    if (!page.ok()) return page.status();
    if (auto status = write_file(output, *page); !status.ok()) return status;
    fmt::print("{}: {:.1f} MB, for any browser\n", output, 1e-6 * static_cast<double>(page->size()));
    return absl::OkStatus();
  }

  report::Inputs inputs() const {
    report::Inputs inputs;
    // A default that is not there is left out; what was asked for must be.
    const auto wanted = [](const std::string& path, const char* otherwise) {
      return path == otherwise && !std::filesystem::exists(path) ? std::string() : path;
    };
    inputs.bench = wanted(bench, kBench);
    inputs.verification = wanted(verification, kVerification);
    inputs.commands = commands;
    for (const auto& experiment : experiments::all_experiments())
      if (std::string path = fmt::format("{}/{}.json", folder, experiment.id); std::filesystem::exists(path))
        inputs.pages.push_back(std::move(path));
    return inputs;
  }
};

}  // namespace

Verb add_report(CLI::App& app) {
  auto arguments = std::make_shared<ReportVerb>();
  CLI::App& command = *app.add_subcommand("report", "Make a page of the results, for a browser, without network");
  command.footer(R"(Examples:
  facetwise report
  facetwise report --bench out/report.json --folder out/experiments --output report.html
  facetwise report --compare before.json after.json --output changes.html)");
  command.add_option("--bench", arguments->bench, "JSON of `facetwise bench`; default out/report.json, if it is there")
      ->option_text("FILE");
  command
      .add_option("--verification", arguments->verification,
                  "JSON of `facetwise verify`; default out/verify.json, if it is there")
      ->option_text("FILE");
  command.add_option("--folder", arguments->folder, "Pages of `facetwise experiment`; default out/experiments")
      ->option_text("FOLDER");
  command
      .add_option("--command", arguments->commands,
                  "A command to show among those that made the page; may be given again")
      ->allow_extra_args(false)
      ->option_text("TEXT");
  command.add_option("--compare", arguments->compared, "Two JSON files of `facetwise bench`: a page of what changed")
      ->expected(2)
      ->option_text("A.json B.json");
  command.add_option("--output", arguments->output, "Default out/report.html")->option_text("FILE");
  return {&command, [arguments] { return arguments->run(); }};
}

}  // namespace facetwise::app
