#include "app/arguments.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdio>

#include "app/errors.h"
#include "app/verbs.h"
#include "facetwise/client.h"

namespace facetwise::app {

void add_model(CLI::App& app, Model& model) {
  add_named(app, "--distribution", model.distribution, parse_distribution,
            "Distribution of normals; default ggx", "ggx");
  add_named(app, "--masking", model.masking, parse_masking, "Masking function; default smith", "smith");
  add_named(app, "--shadowing", model.shadowing, parse_shadowing,
            "Masking-shadowing of weights and values; default correlated", "correlated|uncorrelated");
}

void EngineArguments::add_remote(CLI::App& app) {
  app.add_option("--remote", remote,
                 "Servers that run it instead of this machine: unix:PATH or HOST:PORT, separated by commas")
      ->delimiter(',')
      ->expected(1, -1)
      ->allow_extra_args(false)  // so that `--remote A B` is an error
      ->option_text("ADDRESS[,ADDRESS...]");
}

void EngineArguments::add_target(CLI::App& app) {
  add_named(app, "--target", target, parse_target,
            "Instruction set of the local kernels; the bits are the same on each",
            "best|scalar|avx2|avx3|neon");
}

absl::StatusOr<std::unique_ptr<Engine>> EngineArguments::open() const {
  if (!remote.empty()) {
    if (target != Target::best)
      return invalid("--target: a server chooses its own; leave out --target or --remote");
    return connect(remote);
  }
  if (!resolve(target)) return invalid("--target: this CPU or build has no {}", name(target));
  return local_engine({.target = target});
}

std::string EngineArguments::shown() const {
  if (!remote.empty()) return fmt::format("{}", fmt::join(remote, ","));
  return std::string(name(*resolve(target)));
}

int fail(std::string_view verb, const absl::Status& status) {
  fmt::print(stderr, "facetwise {}: {}\n", verb, message(status));
  return kFailed;
}

}  // namespace facetwise::app
