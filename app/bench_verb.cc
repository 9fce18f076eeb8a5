// SPDX-License-Identifier: Apache-2.0
// bench: the benchmarks, here, against a server, or on a server's machine.
#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "app/arguments.h"
#include "app/benchmark_messages.h"
#include "app/errors.h"
#include "app/table/output_file.h"
#include "app/verbs.h"
#include "facetwise/bench.h"
#include "facetwise/client.h"

namespace facetwise::app {
namespace {

struct BenchVerb {
  BenchOptions options;
  EngineArguments engine;
  std::string at, json;
  bool full = false, quick = false, no_limits = false, no_rejections = false, no_targets = false;

  int run() {
    // Made first: a file that cannot be written should not be found out after minutes.
    std::optional<OutputFile> file;
    if (!json.empty()) {
      auto created = OutputFile::create(json);
      if (!created.ok()) return fail("bench", created.status());
      file.emplace(*std::move(created));
    }
    const auto report =
        at.empty() ? run_here() : benchmark_server(at, engine.connection, options.filter, options.min_seconds, show);
    if (!report.ok()) return fail("bench", report.status());
    fmt::print("{}", bench_table(*report));
    if (!file) return kDone;
    auto status = file->write(bench_json(*report));
    if (status.ok()) status = file->commit();
    return status.ok() ? kDone : fail("bench", status);
  }

 private:
  absl::StatusOr<BenchReport> run_here() {
    options.suite = full ? BenchSuite::full : quick ? BenchSuite::quick : BenchSuite::standard;
    options.limits = !no_limits;
    options.rejections = !no_rejections;
    options.targets = !no_targets;
    std::unique_ptr<Engine> remote;
    if (!engine.remote.empty()) {
      auto connected = connect(engine.remote, engine.connection);
      if (!connected.ok()) return connected.status();
      remote = *std::move(connected);
      options.remote = remote.get();
    }
    return run_bench(options, show);
  }

  static bool show(const BenchProgress& progress) {
    if (progress.result != nullptr)
      fmt::print(stderr, "[{}/{}] {}: {:.3g} ns a sample\n", progress.done, progress.total, progress.result->name(),
                 progress.result->ns_per_sample);
    else
      fmt::print(stderr, "[{}/{}] {}\n", progress.done, progress.total, progress.part);
    return true;
  }
};

}  // namespace

Verb add_bench(CLI::App& app) {
  auto arguments = std::make_shared<BenchVerb>();
  BenchOptions& options = arguments->options;
  CLI::App& command = *app.add_subcommand("bench", "Measure throughput, the machine's limits and rejection counts");
  command.footer(
      R"(Implementations: scalar (plain std:: code, as a renderer contains it), auto (the same, vectorised by gcc), one-lane (the kernel without
vectors), simd (one thread), simd-threads, and remote (with --remote). Each result is shown beside the
machine's limits.
Names are OPERATION/SAMPLER/ALPHA_X,ALPHA_Y/BATCH/IMPLEMENTATION ("mixed" for the roughness that differs by lane), with DISTRIBUTION-MASKING/ before SAMPLER
for other models than GGX with Smith masking.

Examples:
  facetwise bench --quick --json report.json
  facetwise bench --remote unix:/tmp/facetwise.sock
  facetwise bench --filter 'sample_reflection/exact/mixed/65536/.*' --min-seconds 1
  facetwise bench --filter 'sample_reflection/beckmann-smith/visible/0.3,0.3/65536/.*'
  facetwise bench --at render7:7777 --filter 'sample_reflection/.*/65536/simd$')");
  command.add_option("--filter", options.filter, "Run the benchmarks whose names contain this regular expression")
      ->option_text("REGEX");
  auto* quick = command.add_flag("--quick", arguments->quick, "Fewer: a minute and a half; default three minutes");
  auto* full = command.add_flag("--full", arguments->full, "All: about an hour")->excludes(quick);
  command.add_option("--min-seconds", options.min_seconds, "Seconds that each benchmark runs, up to 10; default 0.2")
      ->option_text("S");
  auto* threads = command.add_option("--threads", options.threads, "Threads of simd-threads; default all cores")
                      ->check(CLI::Range(1, 4096))
                      ->option_text("N");
  add_named(command, "--target", options.target, parse_target, "Instruction set of the kernels; default best",
            "best|scalar|avx2|avx3|neon");
  auto* limits = command.add_flag("--no-limits", arguments->no_limits, "Leave out copy bandwidth and peak of FMA");
  auto* rejections = command.add_flag("--no-rejections", arguments->no_rejections, "Leave out the rejection counts");
  auto* targets = command.add_flag("--no-targets", arguments->no_targets, "Leave out the performance to reach");
  auto* flags = command
                    .add_option("--benchmark-flag", options.benchmark_flags,
                                "A flag of Google Benchmark, as in --benchmark-flag=--benchmark_repetitions=9")
                    ->allow_extra_args(false)
                    ->option_text("FLAG");
  arguments->engine.add_remote(command);
  auto* remote = command.get_option("--remote");
  remote->description("Measure these servers too: unix:PATH or HOST:PORT, separated by commas");
  auto* at = command.add_option("--at", arguments->at,
                                "Run on this server's machine instead (it must allow it: serve --allow-benchmark)");
  at->option_text("ADDRESS");
  for (CLI::Option* here :
       {quick, full, threads, command.get_option("--target"), limits, rejections, targets, flags, remote})
    at->excludes(here);
  command.add_option("--json", arguments->json, "Write the results as JSON")->option_text("FILE");
  return {&command, [arguments] { return arguments->run(); }};
}

}  // namespace facetwise::app
