// SPDX-License-Identifier: Apache-2.0
// prove: does somebody else's BSDF keep its promises?
#include <fmt/format.h>

#include <memory>
#include <string>

#include "app/arguments.h"
#include "app/errors.h"
#include "app/progress.h"
#include "app/table/output_file.h"
#include "app/verbs.h"
#include "facetwise/prove.h"

namespace facetwise::app {
namespace {

struct ProveVerb {
  std::string what, python = "python3", page, json;
  std::vector<double> theta{0, 30, 60, 85}, alpha{0.1, 0.1, 0.1, 0.5, 0.3, 0.3, 1, 1};  // alpha in pairs
  EngineArguments engine;                                                               // how a server is reached
  ModelArguments model;
  Sampler sampler = Sampler::visible;
  float eta = 1.5f;
  prove::Options options;

  absl::StatusOr<std::unique_ptr<prove::Bsdf>> open() {
    if (what.starts_with("python:")) return prove::open_python(what.substr(7), python);
    if (!what.starts_with("unix:") && (what.ends_with(".so") || what.find(".so.") != std::string::npos))
      return prove::open_plugin(what);
    auto opened = model.open();
    if (!opened.ok()) return opened.status();
    engine.remote = {what};
    auto there = engine.open();
    if (!there.ok()) return there.status();
    return prove::of_engine(
        fmt::format("{}: {} {} {}", what, name(opened->distribution), name(opened->masking), name(sampler)),
        *std::move(there), *opened, sampler, eta);
  }

  int run() {
    if (alpha.size() == 1) alpha.push_back(alpha[0]);
    if (alpha.size() % 2 != 0) {
      fmt::print(stderr, "facetwise prove: --alpha: {} values are no pairs\n", alpha.size());
      return kUsage;
    }
    for (std::size_t k = 0; k < alpha.size(); k += 2)
      for (const double t : theta)
        options.configurations.push_back({t, 40, static_cast<float>(alpha[k]), static_cast<float>(alpha[k + 1])});
    auto bsdf = open();
    if (!bsdf.ok()) return fail("prove", bsdf.status());
    auto progress = std::make_unique<Progress>("facetwise prove");
    options.progress = [&](double done) { (*progress)(done); };
    const auto proof = prove::prove(**bsdf, options);
    progress.reset();
    if (!proof.ok()) return fail("prove", proof.status());

    fmt::print("{}: {} configurations, {} samples each\n", proof->bsdf, proof->examined.size(), proof->samples);
    for (const prove::Property property : prove::all_properties()) {
      const auto summary = proof->summary(property);
      if (summary.worst == nullptr) continue;
      fmt::print("  {:<13} {:<6} {}", prove::name(property), summary.failed > 0 ? "FAILS" : "holds",
                 summary.failed > 0 ? fmt::format("in {} of {}; worst: ", summary.failed, summary.tried) : "");
      fmt::print("{}", summary.worst->what);
      if (summary.at != nullptr) fmt::print(" ({})", prove::label(*summary.at));
      fmt::print("\n");
      if (summary.failed > 0 && !summary.worst->where.empty()) fmt::print("{:23}{}\n", "", summary.worst->where);
    }
    fmt::print("result: {}\n", proof->holds() ? "every property holds" : "it FAILS");
    if (!json.empty())
      if (auto status = write_file(json, prove::to_json(*proof)); !status.ok()) return fail("prove", status);
    if (!page.empty())
      if (auto status = write_file(page, prove::page(*proof)); !status.ok()) return fail("prove", status);
    return proof->holds() ? kDone : kFailed;
  }
};

}  // namespace

Verb add_prove(CLI::App& app) {
  auto arguments = std::make_shared<ProveVerb>();
  CLI::App& command = *app.add_subcommand("prove", "Try the properties that a BSDF should have on somebody else's");
  std::string properties;
  for (const prove::Property property : prove::all_properties())
    properties += fmt::format("  {:<13} {}\n", prove::name(property), prove::meaning(property));
  command.footer(fmt::format(R"(BSDF is one of
  FILE.so          a shared library with fw_plugin_open() (facetwise_plugin.h)
  python:MODULE    a Python module or file with sample(i, alpha, u) -> (o, pdf, weight) and
                   evaluate(i, alpha, o) -> (pdf, value), on NumPy arrays of shapes (n, 3), (n, 2), (n,)
  ADDRESS          a server of ours, unix:PATH or HOST:PORT, with the model and sampler of the options

Properties, each at several angles and roughnesses:
{}
Exit code 1 if one fails.

Examples:
  facetwise prove ./my_bsdf.so --page proof.html
  facetwise prove python:my_bsdf.py --theta 0,45,80 --alpha 0.2 --json proof.json
  facetwise prove unix:/tmp/facetwise.sock --distribution beckmann --sampler exact)",
                             properties));
  command.add_option("BSDF", arguments->what, "What is tried: FILE.so, python:MODULE or ADDRESS")
      ->required()
      ->type_name("BSDF");
  command.add_option("--theta", arguments->theta, "Angles of incidence in degrees; default 0,30,60,85")
      ->delimiter(',')
      ->check(CLI::Range(0.0, 180.0))
      ->type_name("DEGREES");
  command
      .add_option("--alpha", arguments->alpha,
                  "One roughness, or pairs along x and y; default 0.1,0.1,0.1,0.5,0.3,0.3,1,1")
      ->delimiter(',')
      ->check(CLI::Range(1e-4, 10.0))
      ->type_name("ALPHA");
  command.add_option("--samples", arguments->options.samples, "Samples at each; default 1048576")
      ->check(CLI::Range(std::size_t{1000}, std::size_t{1} << 27))
      ->type_name("N");
  command.add_option("--seed", arguments->options.seed, "Seed of the random numbers; default 1")->type_name("N");
  command.add_flag("--strict", arguments->options.strict,
                   "Garbage too: NaN, directions below the surface, no roughness");
  command.add_option("--page", arguments->page, "Write a page with pictures")->type_name("FILE.html");
  command.add_option("--json", arguments->json, "Write what was found as JSON")->type_name("FILE");
  command.add_option("--python", arguments->python, "The Python that runs a module; default python3")
      ->type_name("COMMAND");
  arguments->model.add(command);
  add_named(command, "--sampler", arguments->sampler, parse_sampler, "A server's sampler; default visible",
            kSamplerNames);
  command.add_option("--eta", arguments->eta, "A dielectric's eta_o / eta_i; default 1.5")->type_name("ETA");
  add_connection(command, arguments->engine.connection);
  return {&command, [arguments] { return arguments->run(); }};
}

}  // namespace facetwise::app
