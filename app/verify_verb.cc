// SPDX-License-Identifier: Apache-2.0
// verify: is a server's every byte what this machine computes?
#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <tuple>
#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "app/arguments.h"
#include "app/errors.h"
#include "app/table/output_file.h"
#include "app/verbs.h"
#include "app/verify.h"
#include "facetwise/bench.h"

namespace facetwise::app {
namespace {

using Json = nlohmann::ordered_json;

// Renderers built on Embree run with denormals flushed, as Embree's manual asks; so does this one. The
// results must not depend on it.
void flush_denormals() {
#if defined(__SSE2__)
  _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
  _mm_setcsr(_mm_getcsr() | 0x0040);  // denormals are zero
#endif
}

double percent(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

double millions(std::uint64_t lanes, double seconds) {
  return seconds > 0 ? 1e-6 * static_cast<double>(lanes) / seconds : 0.0;
}

// "exact", "beckmann-smith/exact": as in the benchmarks' names.
std::string sampler_name(const VerifyCase& what) {
  return bench_name(name(what.model.distribution), name(what.model.masking), name(what.sampler));
}

std::string shown(const VerifyCase& what) {
  std::string text(name(what.operation));
  const bool samples = text.starts_with("sample_");
  if (has_sampler(what.operation))
    text += fmt::format(" {}", sampler_name(what));
  else if (const std::string model = model_name(name(what.model.distribution), name(what.model.masking));
           !model.empty())
    text += " " + model;
  if (what.model.shadowing != Shadowing::correlated) text += fmt::format(" {}", name(what.model.shadowing));
  if (what.model.interface != Interface::conductor) text += fmt::format(" {}", name(what.model.interface));
  if (what.model.compensation != Compensation::none) text += fmt::format(" {}", name(what.model.compensation));
  if (what.model.retro) text += " retro";
  if (what.affine) text += " with mean slopes";
  if (samples) text += what.generator ? " by seed" : " by columns";
  return text;
}

struct Totals {
  std::uint64_t lanes = 0, backfacing = 0, bytes = 0;
  double remote_seconds = 0, local_seconds = 0;
  struct Count {
    std::uint64_t samples = 0, occluded = 0;
  };
  // By distribution, masking and sampler, in the enumerations' order.
  std::map<std::tuple<Distribution, Masking, Sampler>, Count> reflections;

  explicit Totals(const Verification& verification) {
    for (const VerifiedBatch& batch : verification.batches) {
      lanes += batch.statistics.lanes();
      backfacing += batch.backfacing;
      bytes += batch.bytes;
      remote_seconds += batch.remote_seconds;
      local_seconds += batch.local_seconds;
      if (batch.what.operation != Operation::sample_reflection) continue;
      // Retro-reflection and mean slopes have shares of their own.
      if (batch.what.model.retro || batch.what.affine) continue;
      Count& count = reflections[{batch.what.model.distribution, batch.what.model.masking, batch.what.sampler}];
      count.samples += batch.statistics.lanes();
      count.occluded += batch.statistics.occluded;
    }
  }
};

void print(const Verification& verification, const std::string& mesh) {
  const Totals totals(verification);
  fmt::print("mesh        {}: {} triangles\n", mesh, verification.triangles);
  fmt::print("rays        {}, of which {} hit ({:.1f} %)\n", verification.rays, verification.hits,
             percent(verification.hits, verification.rays));
  fmt::print("lanes       {} in {} batches, {} backfacing ({:.1f} %)\n", totals.lanes, verification.batches.size(),
             totals.backfacing, percent(totals.backfacing, totals.lanes));
  for (const auto& [what, count] : totals.reflections) {
    const auto& [distribution, masking, sampler] = what;
    fmt::print("occluded    {:<26} {:>9} of {} reflections ({:.2f} %)\n",
               bench_name(name(distribution), name(masking), name(sampler)), count.occluded, count.samples,
               percent(count.occluded, count.samples));
  }
  fmt::print("throughput  remote {:.1f}, local {:.0f} million lanes/s, all outputs\n",
             millions(totals.lanes, totals.remote_seconds), millions(totals.lanes, totals.local_seconds));
  if (verification.equal())
    fmt::print("result      every one of {} bytes is equal\n", totals.bytes);
  else
    fmt::print("result      DIFFERENT\n");
}

Json to_json(const Verification& verification, const std::string& mesh, const EngineArguments& engine) {
  const Totals totals(verification);
  Json json = {{"version", version()},
               {"remote", engine.remote},
               {"mesh", mesh},
               {"triangles", verification.triangles},
               {"rays", verification.rays},
               {"hits", verification.hits},
               {"lanes", totals.lanes},
               {"backfacing", totals.backfacing},
               {"bytes_compared", totals.bytes},
               {"equal", verification.equal()},
               {"remote_lanes_per_second", 1e6 * millions(totals.lanes, totals.remote_seconds)},
               {"local_lanes_per_second", 1e6 * millions(totals.lanes, totals.local_seconds)},
               {"reflections", Json::array()},
               {"batches", Json::array()}};
  for (const auto& [what, count] : totals.reflections) {
    const auto& [distribution, masking, sampler] = what;
    json["reflections"].push_back({{"distribution", name(distribution)},
                                   {"masking", name(masking)},
                                   {"sampler", name(sampler)},
                                   {"samples", count.samples},
                                   {"occluded", count.occluded}});
  }
  for (const VerifiedBatch& batch : verification.batches)
    json["batches"].push_back({{"operation", name(batch.what.operation)},
                               {"distribution", name(batch.what.model.distribution)},
                               {"masking", name(batch.what.model.masking)},
                               {"sampler", name(batch.what.sampler)},
                               {"shadowing", name(batch.what.model.shadowing)},
                               {"normalisation", name(batch.what.model.normalisation)},
                               {"interface", name(batch.what.model.interface)},
                               {"transport", name(batch.what.model.transport)},
                               {"retro", batch.what.model.retro},
                               {"mean_slopes", batch.what.affine},
                               {"random", batch.what.generator ? "seed" : "columns"},
                               {"lanes", batch.statistics.lanes()},
                               {"accepted", batch.statistics.accepted},
                               {"occluded", batch.statistics.occluded},
                               {"smooth", batch.statistics.smooth},
                               {"invalid", batch.statistics.invalid},
                               {"backfacing", batch.backfacing},
                               {"remote_seconds", batch.remote_seconds},
                               {"local_seconds", batch.local_seconds},
                               {"difference", batch.difference}});
  return json;
}

struct VerifyVerb {
  EngineArguments engine;
  VerifyOptions options;
  std::string mesh, json;

  int run() {
    flush_denormals();
    if (mesh.empty()) {
      auto found = scene::default_mesh();
      if (!found.ok()) return fail("verify", found.status());
      mesh = *found;
    }
    auto loaded = scene::load_mesh(mesh);
    if (!loaded.ok()) return fail("verify", loaded.status());
    auto camera = scene::Camera::create(*std::move(loaded));
    if (!camera.ok()) return fail("verify", camera.status());
    auto remote = engine.open();
    if (!remote.ok()) return fail("verify", remote.status());
    const auto local = local_engine();
    if (options.batches == 0) options.batches = verify_cases(options.samplers).size();
    std::size_t done = 0;
    const auto verification = verify(**remote, *local, **camera, options, [&](const VerifiedBatch& batch) {
      const Statistics& s = batch.statistics;
      fmt::print(stderr, "[{:>2}/{}] {:<64} {} lanes, {:5.2f} % occluded, remote {:5.1f} M/s: {}\n", ++done,
                 options.batches, shown(batch.what), s.lanes(), percent(s.occluded, s.lanes()),
                 millions(s.lanes(), batch.remote_seconds), batch.difference.empty() ? "equal" : batch.difference);
    });
    if (!verification.ok()) return fail("verify", verification.status());
    print(*verification, mesh);
    if (!json.empty())
      if (auto status = write_file(json, to_json(*verification, mesh, engine).dump(1) + "\n"); !status.ok())
        return fail("verify", status);
    return verification->equal() ? kDone : kFailed;
  }
};

}  // namespace

Verb add_verify(CLI::App& app) {
  auto arguments = std::make_shared<VerifyVerb>();
  CLI::App& command = *app.add_subcommand("verify", "Compare every byte of servers' answers with this machine's");
  command.footer(
      R"(Rays are traced from a fixed camera at a mesh; what they hit, with normals bent by a procedural
normal map and roughness that varies over the mesh, is sent batch by batch, and every answer is
recomputed here. The first batches sample GGX's reflections by each sampler, the others normals, densities,
values and masking, and then the same of each distribution and masking, and what dielectrics transmit. Exit
code 1 if a byte differs.

Examples:
  facetwise verify --remote unix:/tmp/facetwise.sock
  facetwise verify --remote host1:7777,host2:7777 --sampler exact --batches 4 --mesh bunny.ply)");
  arguments->engine.add_remote(command);
  command.get_option("--remote")->required()->option_text("ADDRESS[,ADDRESS...] (required)");
  command
      .add_option("--mesh", arguments->mesh,
                  "Any format that assimp reads; default 2CylinderEngine.glb of assimp-testmodels")
      ->type_name("FILE");
  command.add_option("--batches", arguments->options.batches, "Batches to send; default one of each kind")
      ->check(CLI::PositiveNumber)
      ->option_text("N");
  command.add_option("--lanes", arguments->options.lanes, "Lanes in a batch; default 1048576")
      ->check(CLI::Range(std::size_t{1}, std::size_t{1} << 28))
      ->option_text("N");
  arguments->options.samplers.assign(all_samplers().begin(), all_samplers().end());
  command
      .add_option_function<std::string>(
          "--sampler",
          [arguments](const std::string& text) {
            if (text == "all") return;
            const auto sampler = parse_sampler(text);
            if (!sampler)
              throw CLI::ValidationError("--sampler", fmt::format("\"{}\" is not one of {}|all", text, kSamplerNames));
            arguments->options.samplers = {*sampler};
          },
          "Only this sampler; default all")
      ->type_name(std::string(kSamplerNames) + "|all");
  command.add_option("--seed", arguments->options.seed, "Seed of the random numbers; default 1")->type_name("N");
  command.add_option("--json", arguments->json, "Write the result as JSON")->type_name("FILE");
  return {&command, [arguments] { return arguments->run(); }};
}

}  // namespace facetwise::app
