// SPDX-License-Identifier: Apache-2.0
// serve: the library's calls for other processes and machines.
#include <fmt/format.h>
#include <pwd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <stdexcept>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "app/arguments.h"
#include "app/benchmark_messages.h"
#include "app/errors.h"
#include "app/verbs.h"
#include "facetwise/server.h"

namespace facetwise::app {
namespace {

constexpr std::size_t kMiB = std::size_t{1} << 20;

// Of a name or a number.
std::optional<unsigned> user_id(const std::string& user) {
  unsigned id = 0;
  if (absl::SimpleAtoi(user, &id)) return id;
  const passwd* entry = getpwnam(user.c_str());
  return entry == nullptr ? std::nullopt : std::optional<unsigned>(entry->pw_uid);
}

std::optional<LogFormat> parse_log(std::string_view name) {
  if (name == "none") return LogFormat::none;
  if (name == "text") return LogFormat::text;
  if (name == "json") return LogFormat::json;
  return std::nullopt;
}

std::optional<LogLevel> parse_level(std::string_view name) {
  if (name == "debug") return LogLevel::debug;
  if (name == "info") return LogLevel::info;
  if (name == "warning") return LogLevel::warning;
  return std::nullopt;
}

struct ServeVerb {
  ServerOptions options;
  std::size_t max_message_mib = 16, max_mib_in_flight = 4096;
  std::size_t max_tables_mib = 256, shared_memory_mib = 0;
  int drain_seconds = 10, read_seconds = 20, write_seconds = 60, patience_ms = 2000, stream_idle_seconds = 300,
      table_idle_seconds = 3600;
  std::string unix_mode = "0600", config;
  std::vector<std::string> unix_users;

  int run() {
    if (max_mib_in_flight < 5 * max_message_mib)
      return fail("serve",
                  invalid("--max-mib-in-flight: {} is below five times --max-message-mib ({}), which one call may "
                          "need; it could never be answered",
                          max_mib_in_flight, max_message_mib));
    options.max_message_bytes = max_message_mib * kMiB;
    options.read_timeout = std::chrono::seconds(read_seconds);
    options.write_timeout = std::chrono::seconds(write_seconds);
    options.patience = std::chrono::milliseconds(patience_ms);
    options.stream_idle_timeout = std::chrono::seconds(stream_idle_seconds);
    options.max_bytes_in_flight = max_mib_in_flight * kMiB;
    options.max_tables_bytes = max_tables_mib * kMiB;
    options.max_shared_bytes = shared_memory_mib * kMiB;
    options.max_table_bytes = std::min(options.max_table_bytes, options.max_tables_bytes);
    options.table_idle_timeout = std::chrono::seconds(table_idle_seconds);
    options.drain_timeout = std::chrono::seconds(drain_seconds);
    options.unix_mode = static_cast<unsigned>(std::stoul(unix_mode, nullptr, 8));
    for (const std::string& user : unix_users) options.unix_users.push_back(*user_id(user));
    options.benchmark = benchmark_runner(options.execution.target, options.threads);
    const absl::Status status = serve(options, [&](const Server& server) {
      const Target target = *resolve(options.execution.target);
      for (const std::string& address : server.addresses())
        fmt::print("facetwise {} listens on {} ({} kernels)\n", version(), address, name(target));
      if (!server.metrics().empty()) fmt::print("metrics at http://{}/metrics\n", server.metrics());
      std::fflush(stdout);
    });
    return status.ok() ? kDone : fail("serve", status);
  }
};

// Gives the options that the command line does not: from the environment, else from a file.
absl::Status fill_options(CLI::App& command, const std::string& path) {
  std::map<std::string, std::vector<std::string>> file;
  if (!path.empty()) {
    std::ifstream in(path);
    if (!in || std::filesystem::is_directory(path))
      return absl::NotFoundError(fmt::format("--config: {}: cannot be read", path));
    try {
      for (const CLI::ConfigItem& item : CLI::ConfigTOML().from_config(in)) file[item.fullname()] = item.inputs;
    } catch (const CLI::Error& error) {
      return invalid("--config: {}: {}", path, error.what());
    }
  }
  for (const auto& [name, values] : file)
    if (name == "config" || command.get_option_no_throw("--" + name) == nullptr)
      return invalid("{}: {}: not an option of serve", path, name);
  for (CLI::Option* option : command.get_options()) {
    const std::string name = option->get_lnames().front();
    if (option->count() > 0 || name == "help" || name == "config") continue;
    std::string variable = "FACETWISE_SERVE_" + name;
    for (char& letter : variable) letter = letter == '-' ? '_' : absl::ascii_toupper(letter);
    std::vector<std::string> values;
    std::string where = variable;
    if (const char* value = std::getenv(variable.c_str())) {
      values = {value};
    } else if (const auto in_file = file.find(name); in_file != file.end()) {
      values = in_file->second;
      where = fmt::format("{}: {}", path, name);
    } else {
      continue;
    }
    try {
      const bool is_flag = option->get_type_size() == 0;
      for (const std::string& value : values) option->add_result(is_flag ? option->get_flag_value(name, value) : value);
      option->run_callback();
    } catch (const CLI::Error& error) {
      return invalid("{}: {}", where, error.what());
    }
  }
  return absl::OkStatus();
}

std::string check_mode(const std::string& text) {
  const bool octal = !text.empty() && text.size() <= 4 && text.find_first_not_of("01234567") == std::string::npos;
  return octal && std::stoul(text, nullptr, 8) <= 0777 ? "" : fmt::format("\"{}\" is not a mode such as 0660", text);
}

}  // namespace

Verb add_serve(CLI::App& app) {
  auto arguments = std::make_shared<ServeVerb>();
  ServerOptions& options = arguments->options;
  options.log = LogFormat::text;
  CLI::App& command = *app.add_subcommand("serve", "Answer the library's calls over gRPC until SIGTERM");
  command.footer(
      R"(On SIGTERM or SIGINT it takes no new calls, finishes those in flight and exits with 0. The protocol
is proto/facetwise/v1/sampler.proto; health checks and reflection are on. For other machines give a certificate
(--tls-certificate, --tls-key), and ask for tokens (--token-file) or for clients' certificates (--tls-client-ca). All
these files are read again when they change. An option that is not given is taken from the environment (FACETWISE_SERVE_THREADS
for --threads), else from the file of --config.

Examples:
  facetwise serve --listen unix:/tmp/facetwise.sock
  facetwise serve --listen 0.0.0.0:7777 --tls-certificate server.pem --tls-key server.key --token-file tokens.txt
  facetwise serve --listen 127.0.0.1:7777 --listen unix:/run/facetwise.sock --unix-mode 0660 --threads 8)");
  command
      .add_option("--listen", options.listen,
                  "Where to listen; may be repeated. Port 0 takes a free one, which is printed")
      ->allow_extra_args(false)
      ->option_text("unix:PATH|HOST:PORT (required)");
  const auto add_number = [&](const char* flag, auto& number, int least, int most, const char* help) {
    command.add_option(flag, number, help)->check(CLI::Range(least, most))->option_text("N");
  };
  add_number("--threads", options.threads, 1, 4096, "Threads that compute; default as many as there are cores");
  add_number("--max-message-mib", arguments->max_message_mib, 1, 1024, "Largest request and response; default 16");
  add_number("--max-mib-in-flight", arguments->max_mib_in_flight, 1, 1 << 24,
             "Messages held at once: half are requests on their way, which wait for room; beyond the rest, calls get "
             "RESOURCE_EXHAUSTED; default 4096");
  add_number("--max-calls", options.max_calls, 1, 1 << 20,
             "Calls worked on at once; beyond, they get RESOURCE_EXHAUSTED; default 128");
  add_number("--max-open-calls", options.max_open_calls, 1, 1 << 20,
             "Calls at once with those that wait for their client; default 1024");
  add_number("--max-connections", options.max_connections, 1, 1 << 20,
             "Connections at once; further ones wait; default 4096, less where fewer files may be open");
  add_number("--read-seconds", arguments->read_seconds, 1, 86400, "Longest wait for a call's message; default 20");
  add_number("--stream-idle-seconds", arguments->stream_idle_seconds, 1, 86400,
             "Longest wait for a stream's next message; default 300");
  add_number("--write-seconds", arguments->write_seconds, 1, 86400,
             "Longest wait for a client to receive its answer; default 60");
  add_number("--patience-ms", arguments->patience_ms, 1, 86400000,
             "The same waits where others are refused or wait for room; default 2000");
  add_number("--max-tables-mib", arguments->max_tables_mib, 1, 1 << 20,
             "Tables of slopes that clients upload, together; default 256");
  add_number("--shared-memory-mib", arguments->shared_memory_mib, 0, 1 << 24,
             "Memory that clients on this machine may share with the server instead of sending columns, all together; "
             "default 0: none");
  add_number("--table-idle-seconds", arguments->table_idle_seconds, 1, 1 << 30,
             "How long a table stays that nobody uses; default 3600");
  const auto add_file = [&](const char* flag, std::string& file, const char* help) {
    command.add_option(flag, file, help)->option_text("FILE");
  };
  add_file("--tls-certificate", options.tls_certificate,
           "TLS on every HOST:PORT: the server's certificate with those that signed it, PEM");
  add_file("--tls-key", options.tls_key, "The certificate's key, PEM");
  add_file("--tls-client-ca", options.tls_client_ca, "Take only clients with a certificate signed by one of these");
  add_file("--token-file", options.token_file,
           "Take only calls with one of these tokens (a line each, 16 characters at least)");
  command.add_flag("--insecure", options.insecure,
                   "Allow --listen on addresses that other machines reach, without TLS");
  command.add_option("--unix-mode", arguments->unix_mode, "Permissions of Unix sockets, octal; default 0600")
      ->check(check_mode)
      ->option_text("MODE");
  command
      .add_option("--unix-user", arguments->unix_users,
                  "Only this user's processes may connect to Unix sockets; may be repeated")
      ->check([](const std::string& user) {
        return user_id(user) ? "" : fmt::format("\"{}\" is no user of this machine", user);
      })
      ->allow_extra_args(false)
      ->option_text("NAME|ID");
  command
      .add_option(
          "--metrics", options.metrics,
          "Give counts and load at http://IP:PORT/metrics, for Prometheus, without TLS; port 0 takes a free one")
      ->option_text("IP:PORT");
  add_named(command, "--log", options.log, parse_log,
            "Write what happens to standard error, a line an event; default text", "none|text|json");
  add_named(command, "--log-level", options.log_level, parse_level,
            "debug: each call too; info: also calls that fail; warning: only what the server lacks; default info",
            "debug|info|warning");
  add_number("--drain-seconds", arguments->drain_seconds, 0, 86400,
             "Longest wait for calls in flight at the end; default 10");
  command.add_flag("--allow-benchmark", options.allow_benchmark, "Let clients run benchmarks on this machine");
  add_named(command, "--target", options.execution.target, parse_target, "Instruction set of the kernels; default best",
            "best|scalar|avx2|avx3|neon");
  command.add_option("--config", arguments->config, "Take options from this file too, a line each as in threads=4")
      ->option_text("FILE");
  return {&command, [arguments, &command] {
            const absl::Status status = fill_options(command, arguments->config);
            if (!status.ok()) return fail("serve", status);
            if (!arguments->options.listen.empty()) return arguments->run();
            fmt::print(stderr, "--listen is required\nRun with --help for more information.\n");
            return kUsage;
          }};
}

}  // namespace facetwise::app
