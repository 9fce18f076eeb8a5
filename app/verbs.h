// SPDX-License-Identifier: Apache-2.0
// The verbs of the command. Each function adds one to the command line and returns what it does.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace facetwise::app {

// Exit codes: 0 done; 1 it failed, or verify found a difference; 2 the command line is wrong.
inline constexpr int kDone = 0, kFailed = 1, kUsage = 2;

struct Verb {
  CLI::App* command;
  std::function<int()> run;  // called if the command line chose it; returns the exit code
};

Verb add_sample(CLI::App& app);
Verb add_pdf(CLI::App& app);
Verb add_evaluate(CLI::App& app);
Verb add_albedo(CLI::App& app);
Verb add_verify(CLI::App& app);
Verb add_serve(CLI::App& app);
Verb add_prove(CLI::App& app);
Verb add_bench(CLI::App& app);
Verb add_info(CLI::App& app);
Verb add_load(CLI::App& app);
Verb add_transport(CLI::App& app);
Verb add_summary(CLI::App& app);
Verb add_table(CLI::App& app);
Verb add_render(CLI::App& app);
Verb add_experiment(CLI::App& app);
Verb add_report(CLI::App& app);

}  // namespace facetwise::app
