// SPDX-License-Identifier: Apache-2.0
// Options that several verbs share.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "facetwise/client.h"
#include "facetwise/engine.h"

namespace facetwise::app {

// An option whose value is one of facetwise's names: `parse` is parse_sampler() or one of its kind.
template <class T, class Parse>
CLI::Option* add_named(CLI::App& app, const std::string& flag, T& value, Parse parse, const std::string& help,
                       const std::string& names) {
  return app
      .add_option_function<std::string>(
          flag,
          [&value, parse, names, flag](const std::string& text) {
            const auto parsed = parse(text);
            if (!parsed) throw CLI::ValidationError(flag, fmt::format("\"{}\" is not one of {}", text, names));
            value = *parsed;
          },
          help)
      ->type_name(names);
}

inline constexpr const char* kSamplerNames = "ndf|heitz|cap|bounded|exact|visible";

// --distribution, --masking, --shadowing, --normalisation, --interface, --transport, --compensation,
// --retro.
struct ModelArguments {
  Model model;
  std::string table;  // of `--distribution table:FILE`

  void add(CLI::App& app);
  // The model, its table read.
  absl::StatusOr<Model> open() const;
};

// How a server is reached: --tls-ca, --tls-certificate, --tls-key, --tls-name, --token-file.
void add_connection(CLI::App& app, ConnectOptions& connection);

// Which engine runs a call: this machine's, or servers.
struct EngineArguments {
  std::vector<std::string> remote;
  ConnectOptions connection;
  Target target = Target::best;

  void add_remote(CLI::App& app);
  void add_target(CLI::App& app);
  absl::StatusOr<std::unique_ptr<Engine>> open() const;
  std::string shown() const;  // "avx3" or the addresses
};

// Prints "facetwise VERB: MESSAGE" to standard error and returns kFailed.
int fail(std::string_view verb, const absl::Status& status);

}  // namespace facetwise::app
