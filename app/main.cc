// SPDX-License-Identifier: Apache-2.0
// The facetwise command.
#include <csignal>
#include <cstdio>
#include <string>
#include <vector>

#include "app/manual.h"
#include "app/verbs.h"
#include "facetwise/engine.h"
#include "facetwise/tune_malloc.h"

namespace {

constexpr const char* kAbout =
    "facetwise samples microfacet surfaces (GGX, Beckmann and others; Smith, V-cavity) in bulk: here, or on "
    "servers.\n"
    "`facetwise VERB --help` explains a verb.";

constexpr const char* kExamples = R"(Examples:
  facetwise info
  facetwise sample --sampler exact --seed 1 --alpha 0.3 --input incident.csv --output samples.csv
  facetwise pdf --sampler exact --input pairs.npy --output pdf.npy
  facetwise serve --listen unix:/tmp/facetwise.sock --listen 127.0.0.1:7777
  facetwise verify --remote unix:/tmp/facetwise.sock

Exit codes: 0 done; 1 it failed, or `verify` found a difference; 2 the command line is wrong.)";

}  // namespace

int main(int argc, char** argv) {
  using namespace facetwise::app;
  // A reader of our output that goes away is an error of the write, with a message.
  std::signal(SIGPIPE, SIG_IGN);
  facetwise::tune_malloc();  // for messages to and from servers

  CLI::App app{kAbout, "facetwise"};
  app.set_version_flag("--version", std::string(facetwise::version()));
  app.footer(kExamples);
  app.require_subcommand(1);
  app.get_formatter()->column_width(34);
  const std::vector<Verb> verbs = {add_sample(app),  add_pdf(app),    add_evaluate(app), add_albedo(app),
                                   add_serve(app),   add_verify(app), add_prove(app),    add_bench(app),
                                   add_summary(app), add_table(app),  add_render(app),   add_experiment(app),
                                   add_report(app),  add_info(app),   add_load(app),     add_transport(app)};
  // For the installation; no verbs of their own.
  if (argc == 3 && std::string(argv[1]) == "--write") {
    const std::string what = argv[2];
    const std::string text = what == "manual" ? manual_page(app) : what == "completion" ? bash_completion(app) : "";
    std::fputs(text.c_str(), stdout);
    return text.empty() ? kUsage : kDone;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsage;
  }
  for (const Verb& verb : verbs)
    if (verb.command->parsed()) return verb.run();
  return kUsage;
}
