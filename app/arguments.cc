// SPDX-License-Identifier: Apache-2.0
#include "app/arguments.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdio>

#include "app/errors.h"
#include "app/verbs.h"
#include "facetwise/client.h"
#include "facetwise/slope_table.h"

namespace facetwise::app {

namespace {

constexpr std::string_view kTable = "table:";
constexpr const char* kDistributions = "ggx|beckmann|student_t|phong|table:FILE";

// Reads the table of slopes of `--distribution table:FILE`.
absl::StatusOr<std::shared_ptr<const SlopeTable>> read_slope_table(const std::string& path) {
  return SlopeTable::load_any(path, {});
}

}  // namespace

void ModelArguments::add(CLI::App& app) {
  app.add_option_function<std::string>(
         "--distribution",
         [this](const std::string& text) {
           const bool is_table = text.starts_with(kTable) && text.size() > kTable.size();
           const auto parsed = is_table ? Distribution::table : parse_distribution(text);
           if (!parsed || (*parsed == Distribution::table && !is_table))
             throw CLI::ValidationError("--distribution", fmt::format("\"{}\" is not one of {}", text, kDistributions));
           model.distribution = *parsed;
           table = is_table ? text.substr(kTable.size()) : "";
         },
         "Distribution of normals; default ggx. A table is a file of slopes' densities")
      ->type_name(kDistributions);
  add_named(app, "--masking", model.masking, parse_masking, "Masking function; default smith; phong has only vcavity",
            "smith|vcavity");
  add_named(app, "--shadowing", model.shadowing, parse_shadowing,
            "Masking-shadowing of weights and values; default correlated", "correlated|uncorrelated");
  add_named(app, "--normalisation", model.normalisation, parse_normalisation,
            "Densities of visible normals for directions behind the surface; default unbiased", "unbiased|biased");
  add_named(app, "--interface", model.interface, parse_interface,
            "What reflects: all (conductor, the default), by Schlick's formula (f0, f90) or Fresnel's (eta)",
            "conductor|schlick|dielectric");
  add_named(app, "--transport", model.transport, parse_transport, "What transmission carries; default radiance",
            "radiance|importance");
  add_named(app, "--compensation", model.compensation, parse_compensation,
            "What is added for light that is scattered more than once, to weights and values; default none. Its table "
            "takes seconds on first use",
            "none|turquin|kelemen");
  app.add_flag("--retro", model.retro, "Reflect back to where the light comes from");
}

absl::StatusOr<Model> ModelArguments::open() const {
  Model opened = model;
  if (table.empty()) return opened;
  auto read = read_slope_table(table);
  if (!read.ok()) return read.status();
  opened.table = *std::move(read);
  return opened;
}

void EngineArguments::add_remote(CLI::App& app) {
  app.add_option("--remote", remote,
                 "Servers that run it instead of this machine: unix:PATH or HOST:PORT, separated by commas")
      ->delimiter(',')
      ->expected(1, -1)
      ->allow_extra_args(false)  // so that `--remote A B` is an error
      ->option_text("ADDRESS[,ADDRESS...]");
  add_connection(app, connection);
  connection.absent = [](const std::string& message) {
    fmt::print(stderr, "facetwise: {}; going on with the others\n", message);
  };
}

void add_connection(CLI::App& app, ConnectOptions& connection) {
  const auto add_file = [&](const char* flag, std::string& file, const char* help) {
    app.add_option(flag, file, help)->option_text("FILE")->group("Servers that ask for more");
  };
  add_file("--tls-ca", connection.tls_ca,
           "TLS, to every HOST:PORT: who may have signed a server's certificate, PEM; Debian's authorities are "
           "/etc/ssl/certs/ca-certificates.crt");
  add_file("--tls-certificate", connection.tls_certificate,
           "This client's certificate, PEM, for servers that ask for one");
  add_file("--tls-key", connection.tls_key, "The certificate's key");
  add_file("--token-file", connection.token_file, "A file whose first line is the token that the server asks for");
  app.add_option("--tls-name", connection.tls_name, "The name in the server's certificate, where it is not the host's")
      ->option_text("NAME")
      ->group("Servers that ask for more");
}

void EngineArguments::add_target(CLI::App& app) {
  add_named(app, "--target", target, parse_target,
            "Instruction set of the local kernels; the bits are the same on each", "best|scalar|avx2|avx3|neon");
}

absl::StatusOr<std::unique_ptr<Engine>> EngineArguments::open() const {
  if (!remote.empty()) {
    if (target != Target::best) return invalid("--target: a server chooses its own; leave out --target or --remote");
    return connect(remote, connection);
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
