// SPDX-License-Identifier: Apache-2.0
// table: builds a table of slopes once, so that calls do not.
#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "app/arguments.h"
#include "app/errors.h"
#include "app/progress.h"
#include "app/verbs.h"
#include "facetwise/slope_table.h"

namespace facetwise::app {
namespace {

struct TableVerb {
  std::string input, output;
  bool radial = false, json = false;

  int run() const {
    SlopeTable::Options options;
    options.radial = radial;
    auto progress = std::make_unique<Progress>("facetwise table");
    options.progress = [&](double done) { (*progress)(done); };
    const auto start = std::chrono::steady_clock::now();
    const auto table = SlopeTable::load_any(input, options);
    progress.reset();
    if (!table.ok()) return fail("table", table.status());
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    if (const auto status = (*table)->save(output); !status.ok()) return fail("table", status);

    const SlopeTable& built = **table;
    const std::string id = fmt::format("{:016x}", built.id());
    if (json) {
      const nlohmann::ordered_json report = {{"output", output},
                                             {"id", id},
                                             {"radial", built.radial()},
                                             {"bytes", built.bytes()},
                                             {"mean_slope", {built.view().mean_x, built.view().mean_y}},
                                             {"seconds", seconds.count()}};
      fmt::print("{}\n", report.dump());
    } else {
      fmt::print("{}: table {}, {}, {:.2f} MB, mean slope ({:.4g}, {:.4g}), built in {:.2f} s\n", output, id,
                 built.radial() ? "radial" : "not radial", static_cast<double>(built.bytes()) / 1e6,
                 built.view().mean_x, built.view().mean_y, seconds.count());
    }
    return kDone;
  }
};

}  // namespace

Verb add_table(CLI::App& app) {
  auto arguments = std::make_shared<TableVerb>();
  CLI::App& command = *app.add_subcommand("table", "Build the tables of a distribution of slopes and save them");
  command.footer(
      R"(The input is text: the line "facetwise-slopes 1 nx ny x_min x_max y_min y_max", then nx ny densities of
slopes, x fastest, apart by spaces or lines; linear in between and 0 outside. Building takes seconds; what is saved is
read at once by --distribution table:FILE, and is the same on every machine.

Examples:
  facetwise table --input measured.txt --output measured.table
  facetwise sample --distribution table:measured.table --seed 1 --alpha 1 --input rays.csv --output samples.csv)");
  command.add_option("-i,--input", arguments->input, "Text of densities, or a saved table")
      ->required()
      ->type_name("FILE");
  command.add_option("-o,--output", arguments->output, "Where the table goes")->required()->type_name("FILE");
  command.add_flag("--radial", arguments->radial,
                   "The density depends only on the slope's length: smaller tables, and V-cavity masking too");
  command.add_flag("--json", arguments->json, "What was built as JSON");
  return {&command, [arguments] { return arguments->run(); }};
}

}  // namespace facetwise::app
