// SPDX-License-Identifier: Apache-2.0
// sample, pdf, evaluate: the library's calls on files.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>

#include "app/arguments.h"
#include "app/errors.h"
#include "app/file_call.h"
#include "app/progress.h"
#include "app/verbs.h"
#include "facetwise/albedo_table.h"

namespace facetwise::app {
namespace {

constexpr const char* kFiles =
    R"(Files are .csv, .npy, to be read also .npz, or "-" for CSV through standard input and output.
CSV: a header line with the columns' names, then one line per lane; commas, or semicolons or tabs.
.npy: a one-dimensional structured array of float32 (read where they lie if little-endian), float64 or float16; or a plain
array (N, k) with --columns. .npz: a one-dimensional array for each column.
Columns that are not known (ids, names) are in the output as they were.
  ix iy iz         incident direction, a unit vector in the local frame that points away from the surface
  alpha_x alpha_y  roughness: the distribution's own parameter, 1e-4 to 10, phong to 1 (or --alpha)
  mean_slope_x mean_slope_y slope_correlation
                   mean and correlation of the slopes, 0 where they are left out; ggx, beckmann and tables with smith
  eta              eta_o / eta_i, 0.01 to 100; --interface dielectric (or --eta)
  f0 f90           reflectance straight on, and grazing (1 if left out); --interface schlick (or --f0, --f90)
)";
constexpr const char* kRandomColumns =
    "  u1 u2 u3         uniform numbers in [0, 1) (or --seed); u3 for --scattering, for the sampler exact and,\n"
    "                   with --masking vcavity, for visible\n";
constexpr const char* kQueryColumns = "  ox oy oz         outgoing direction\n";
constexpr const char* kStatus =
    R"(  status           0 accepted, 1 occluded, 2 smooth (alpha below 1e-4), 3 invalid (NaN, not a unit
                   vector, ...); such lanes are no error and are counted on standard error
)";

struct FileVerb {
  FileCall call;
  ModelArguments model;
  EngineArguments engine;
  std::optional<Sampler> sampler;
  std::string albedo_table;
  bool json = false;

  // The table of albedo that the call reads, if it does: built with progress, or read from --albedo-table. A server
  // has its own.
  absl::Status prepare_albedo() const {
    const bool given = !albedo_table.empty(), reads = reads_albedo(call.operation, call.model);
    if (given && !reads)
      return invalid("--albedo-table: read by `facetwise albedo`, and by sample and evaluate with --compensation");
    if (given && !engine.remote.empty())
      return invalid("--albedo-table: a server has its own; leave out --albedo-table or --remote");
    if (!reads || !engine.remote.empty()) return absl::OkStatus();
    if (given && std::filesystem::exists(albedo_table)) {
      auto table = AlbedoTable::load(albedo_table);
      if (!table.ok()) return table.status();
      if (!(*table)->fits(call.model))
        return invalid("{}: a table of {}; --albedo-table needs one of the model", albedo_table,
                       (*table)->description());
      use_albedo_table(*std::move(table));
      return absl::OkStatus();
    }
    Progress progress("facetwise: table of albedo");
    const auto table = facetwise::albedo_table(call.model, [&](double done) { progress(done); });
    if (!table.ok()) return table.status();
    return given ? (*table)->save(albedo_table) : absl::OkStatus();
  }
};

// A flag that makes another operation of the verb.
struct Variant {
  const char* flag;
  Operation operation;
  const char* help;
};
constexpr Variant kSampleVariants[] = {
    {"--normals", Operation::sample_normal, "Sample microfacet normals instead of reflections"},
    {"--transmission", Operation::sample_transmission, "Sample what goes through a dielectric instead of reflections"},
    {"--scattering", Operation::sample_scattering, "Sample either of the two, as a dielectric reflects"}};
constexpr Variant kEvaluateVariants[] = {
    {"--transmission", Operation::evaluate_transmission, "Of what goes through a dielectric"},
    {"--scattering", Operation::evaluate_scattering, "Of both, each on its side of the surface"}};

void report(const std::string& verb, const FileVerb& verb_arguments, const FileCallResult& result) {
  const FileCall& call = verb_arguments.call;
  const Statistics& s = result.statistics;
  if (verb_arguments.json) {
    const nlohmann::ordered_json json = {{"operation", name(call.operation)},
                                         {"distribution", name(call.model.distribution)},
                                         {"masking", name(call.model.masking)},
                                         {"interface", name(call.model.interface)},
                                         {"sampler", name(result.sampler)},
                                         {"engine", verb_arguments.engine.shown()},
                                         {"lanes", s.lanes()},
                                         {"accepted", s.accepted},
                                         {"occluded", s.occluded},
                                         {"smooth", s.smooth},
                                         {"invalid", s.invalid},
                                         {"backfacing", result.backfacing},
                                         {"seconds", result.seconds},
                                         {"ignored_columns", result.ignored},
                                         {"passed_columns", result.passed}};
    fmt::print(stderr, "{}\n", json.dump());
    return;
  }
  fmt::print(
      stderr,
      "facetwise {}: {} lanes, {} backfacing: {} accepted, {} occluded, {} smooth, {} invalid; {} by {} in {:.3g} ms\n",
      verb, s.lanes(), result.backfacing, s.accepted, s.occluded, s.smooth, s.invalid,
      has_sampler(call.operation) ? name(result.sampler) : "table", verb_arguments.engine.shown(),
      1e3 * result.seconds);
  if (!result.ignored.empty())
    fmt::print(stderr, "facetwise {}: columns not read: {}\n", verb, fmt::join(result.ignored, " "));
  if (!result.passed.empty())
    fmt::print(stderr, "facetwise {}: columns not known, passed on: {}\n", verb, fmt::join(result.passed, " "));
}

Verb add_file_verb(CLI::App& app, const std::string& verb, Operation operation, std::span<const Variant> variants,
                   const std::string& about, const std::string& columns) {
  auto arguments = std::make_shared<FileVerb>();
  FileCall& call = arguments->call;
  call.operation = operation;
  CLI::App& command = *app.add_subcommand(verb, about);
  command.footer(columns);
  command.add_option("-i,--input", call.input, "File with one lane per row; default -")->type_name("FILE");
  command.add_option("-o,--output", call.output, "File to write; default -. It appears when it is complete")
      ->type_name("FILE");
  command.add_option("--columns", call.columns, "Names of the columns of a plain .npy array, with commas between them")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->option_text("NAME,NAME...");
  command.add_flag("--normalise", call.normalise,
                   "Bring directions to unit length first: those of float16 or interpolation are a little off");
  arguments->model.add(command);
  if (has_sampler(operation))
    add_named(command, "--sampler", arguments->sampler, parse_sampler,
              operation == Operation::sample_reflection
                  ? "How directions are drawn; default exact where the model has it, else visible"
                  : "The sampler whose pdf is meant; default exact where the model has it, else visible",
              kSamplerNames);
  command.add_option("--alpha", call.alpha, "Roughness of all lanes: alpha_x and, if it differs, alpha_y")
      ->expected(1, 2)
      ->type_name("X [Y]");
  const auto add_constant = [&](const char* flag, std::optional<float>& value, const char* help) {
    command.add_option(flag, value, help)->option_text("X");
  };
  if (has_sampler(operation)) {
    add_constant("--eta", call.eta, "eta of all lanes");
    add_constant("--f0", call.f0, "f0 of all lanes");
    add_constant("--f90", call.f90, "f90 of all lanes");
  }
  command
      .add_option("--albedo-table", arguments->albedo_table,
                  "Where the table of albedo is kept: read if it is there, else computed (seconds) and written")
      ->type_name("FILE");
  std::vector<CLI::Option*> others;
  for (const Variant& variant : variants) {
    auto* flag = command.add_flag_callback(
        variant.flag, [&call, &variant] { call.operation = variant.operation; }, variant.help);
    for (CLI::Option* other : others) flag->excludes(other);
    others.push_back(flag);
  }
  if (operation == Operation::sample_reflection) {
    auto* seed = command.add_option("--seed", call.seed, "Seed of the generator of u1 u2 u3")->type_name("N");
    command.add_option("--first-id", call.first_id, "The first lane's id in the generator; default 0")
        ->needs(seed)
        ->option_text("N");
  }
  arguments->engine.add_remote(command);
  arguments->engine.add_target(command);
  command.add_flag("--json", arguments->json, "Counts of lanes as JSON (on standard error)");
  return {&command, [arguments, verb] {
            FileCall& call = arguments->call;
            auto model = arguments->model.open();
            if (!model.ok()) return fail(verb, model.status());
            call.model = *std::move(model);
            call.sampler = arguments->sampler;
            if (const auto status = arguments->prepare_albedo(); !status.ok()) return fail(verb, status);
            auto engine = arguments->engine.open();
            if (!engine.ok()) return fail(verb, engine.status());
            const auto result = run_on_files(call, **engine);
            if (!result.ok()) return fail(verb, result.status());
            report(verb, *arguments, *result);
            return kDone;
          }};
}

}  // namespace

Verb add_sample(CLI::App& app) {
  return add_file_verb(app, "sample", Operation::sample_reflection, kSampleVariants,
                       "Sample reflections, transmissions or normals for the incident directions of a file",
                       std::string(kFiles) + kRandomColumns + R"(Written:
  ox oy oz         the direction (not with --normals)
  mx my mz         the microfacet normal
  pdf              density per steradian: of the direction, with --normals of the normal
  weight           f |cos(theta_o)| / pdf (not with --normals)
  branch_probability
                   with which the event was chosen (--scattering)
  eta_scale        what a path divides its weight by to compare it (--transmission, --scattering)
  event            0 reflection, 1 transmission (--scattering)
)" + kStatus + R"(
Examples:
  facetwise sample --sampler exact --seed 1 --input rays.csv --output samples.csv
  facetwise sample --sampler bounded --seed 1 --alpha 0.8 0.1 --input rays.npy --output samples.npy
  facetwise sample --scattering --distribution beckmann --interface dielectric --eta 1.5 --seed 1 \
      --alpha 0.2 --input rays.csv --output samples.csv
  printf 'ix,iy,iz,u1,u2\n0,0,1,0.25,0.5\n' | facetwise sample --normals --alpha 0.3)");
}

Verb add_pdf(CLI::App& app) {
  return add_file_verb(app, "pdf", Operation::pdf_reflection, {},
                       "Density of a sampler at outgoing directions of a file",
                       std::string(kFiles) + kQueryColumns + R"(Written:
  pdf              density per steradian with which the sampler draws the outgoing direction
)" + kStatus + R"(
Example:
  facetwise pdf --sampler exact --alpha 0.3 --input pairs.csv --output pdf.csv)");
}

Verb add_evaluate(CLI::App& app) {
  return add_file_verb(app, "evaluate", Operation::evaluate_reflection, kEvaluateVariants,
                       "Values f |cos(theta_o)|, and a sampler's density, at outgoing directions of a file",
                       std::string(kFiles) + kQueryColumns + R"(Written:
  pdf              density per steradian with which the sampler draws the outgoing direction
  value            f |cos(theta_o)|, per steradian
  branch_probability
                   of the event that the outgoing direction means (--scattering)
)" + kStatus + R"(
Example:
  facetwise evaluate --shadowing uncorrelated --alpha 0.3 --input pairs.csv --output values.csv)");
}

Verb add_albedo(CLI::App& app) {
  return add_file_verb(app, "albedo", Operation::albedo, {},
                       "What share of the light from each direction a surface reflects, by one scattering with F = 1, "
                       "or as a dielectric",
                       std::string(kFiles) + R"(Written:
  albedo           of that direction; a smooth lane has 1
  mean_albedo      the average over the hemisphere, by the cosine
  transmitted      what goes through (--interface dielectric)
)" + kStatus + R"(
Example:
  facetwise albedo --alpha 0.5 --input directions.csv --output albedo.csv --albedo-table ggx.albedo)");
}

}  // namespace facetwise::app
