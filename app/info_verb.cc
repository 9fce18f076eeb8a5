// SPDX-License-Identifier: Apache-2.0
// info: what this program, this machine or a server is.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/arguments.h"
#include "app/errors.h"
#include "app/verbs.h"
#include "bench/machine.h"
#include "facetwise/remote_tables.h"
#include "facetwise/v1/sampler.pb.h"
#include "wire/fields.h"

namespace facetwise::app {
namespace {

using Json = nlohmann::ordered_json;

std::uint64_t memory_bytes() {
  return static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(sysconf(_SC_PAGE_SIZE));
}

Json local_info() {
  Json targets = Json::array();
  for (const Target target : available_targets()) targets.push_back(name(target));
  const Target best = *resolve(Target::best);
  return {{"version", version()},          {"target", name(best)},
          {"available_targets", targets},  {"vector_lanes", vector_lanes(best)},
          {"cpu", bench::cpu_model()},     {"cores", bench::usable_cores()},
          {"memory_bytes", memory_bytes()}};
}

absl::StatusOr<Json> remote_info(const std::string& address, const ConnectOptions& options) {
  constexpr std::chrono::seconds kPatience{5};
  const auto channel = open_channel(address, options);
  if (!channel.ok()) return channel.status();
  v1::InfoResponse info;
  const grpc::Status status = ask_info(*channel, std::chrono::system_clock::now() + kPatience, false, info);
  if (!status.ok()) return absl::UnavailableError(fmt::format("server {}: {}", address, status.error_message()));
  const auto tables = list_tables(*channel, std::chrono::system_clock::now() + kPatience);
  if (!tables.ok()) return tables.status();
  Json ids = Json::array();
  for (const RemoteTable& table : *tables) ids.push_back(fmt::format("{:016x}", table.id));
  Json targets = Json::array();
  for (const std::string& target : info.available_targets()) targets.push_back(target);
  Json models = Json::array();
  for (const v1::ModelInfo& model : info.models()) {
    std::string line =
        fmt::format("{}-{}:", name(wire::distribution_from(model.distribution()).value_or(Distribution())),
                    name(wire::masking_from(model.masking()).value_or(Masking())));
    for (const int sampler : model.samplers())
      line += fmt::format(" {}", name(wire::sampler_from(sampler, Sampler::visible).value_or(Sampler::visible)));
    models.push_back(line);
  }
  const v1::ServerLimits& limits = info.limits();
  const v1::ServerLoad& load = info.load();
  return Json{{"version", info.version()},
              {"target", info.target()},
              {"available_targets", targets},
              {"cpu", info.cpu()},
              {"threads", info.threads()},
              {"max_message_bytes", info.max_message_bytes()},
              {"benchmark_allowed", info.benchmark_allowed()},
              {"slope_tables", ids},
              {"models", models},
              {"limits",
               {{"calls", limits.calls()},
                {"open_calls", limits.open_calls()},
                {"held_bytes", limits.held_bytes()},
                {"connections", limits.connections()},
                {"table_bytes", limits.table_bytes()},
                {"lanes", limits.lanes()},
                {"shared_bytes", limits.shared_bytes()}}},
              {"load",
               {{"calls", load.calls()},
                {"open_calls", load.open_calls()},
                {"held_bytes", load.held_bytes()},
                {"connections", load.connections()},
                {"table_bytes", load.table_bytes()},
                {"lanes", load.lanes()},
                {"shared_bytes", load.shared_bytes()},
                {"uptime_seconds", load.uptime_seconds()},
                {"serving", load.serving()}}}};
}

void print(const Json& info) {
  for (const auto& [key, value] : info.items()) {
    std::string text;
    if (value.is_array()) {
      text = fmt::format("{}", fmt::join(value.get<std::vector<std::string>>(), key == "models" ? ", " : " "));
    } else if (value.is_object()) {
      for (const auto& [name, number] : value.items()) text += fmt::format("{} {}  ", name, number.dump());
    } else
      text = value.is_string() ? value.get<std::string>() : value.dump();
    fmt::print("{:<18} {}\n", key, text);
  }
}

}  // namespace

Verb add_info(CLI::App& app) {
  struct Arguments {
    std::string remote;
    ConnectOptions connection;
    bool json = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App& command = *app.add_subcommand("info", "Print the version, the instruction sets and the machine");
  command.footer("Examples:\n  facetwise info\n  facetwise info --json --remote unix:/tmp/facetwise.sock");
  command.add_option("--remote", arguments->remote, "A server's instead of this machine's: unix:PATH or HOST:PORT")
      ->option_text("ADDRESS");
  add_connection(command, arguments->connection);
  command.add_flag("--json", arguments->json, "As JSON");
  return {&command, [arguments] {
            const absl::StatusOr<Json> info = arguments->remote.empty()
                                                  ? absl::StatusOr<Json>(local_info())
                                                  : remote_info(arguments->remote, arguments->connection);
            if (!info.ok()) return fail("info", info.status());
            if (arguments->json)
              fmt::print("{}\n", info->dump(1));
            else
              print(*info);
            return kDone;
          }};
}

}  // namespace facetwise::app
