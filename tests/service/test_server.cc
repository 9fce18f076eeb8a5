// SPDX-License-Identifier: Apache-2.0
// A server process for the tests: the library's serve() with its limits as flags. Prints each address that it
// listens on, then "ready". Its Benchmark call answers with made-up results, slowly, so that tests can watch.
#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <thread>

#include "CLI/CLI.hpp"
#include "facetwise/server.h"

namespace {

// Reports the request's filter as the operation, `total` times.
absl::Status report_steps(const facetwise::v1::BenchmarkRequest& request, const facetwise::BenchmarkReport& report) {
  if (request.filter() == "fail") return absl::InvalidArgumentError("filter: the runner says no");
  const unsigned total = request.filter() == "long" ? 1000 : 3;
  for (unsigned k = 1; k <= total; ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    facetwise::v1::BenchmarkProgress progress;
    progress.set_done(k);
    progress.set_total(total);
    progress.mutable_result()->set_operation(request.filter());
    if (!report(progress)) return absl::OkStatus();
  }
  return absl::OkStatus();
}

}  // namespace

int main(int argc, char** argv) {
  facetwise::ServerOptions options;
  long drain_ms = 10000, pause_ms = 20;
  CLI::App app("facetwise server for tests");
  app.add_option("--listen", options.listen)->required();
  app.add_option("--threads", options.threads);
  app.add_option("--max-message-bytes", options.max_message_bytes);
  rlim_t files = 0;
  app.add_option("--files", files, "limit of open files");
  app.add_option("--max-connections", options.max_connections);
  app.add_option("--max-calls", options.max_calls);
  app.add_option("--max-open-calls", options.max_open_calls);
  app.add_option("--max-bytes-in-flight", options.max_bytes_in_flight);
  app.add_option("--drain-ms", drain_ms);
  app.add_option("--pause-ms", pause_ms);
  long read_ms = 20000, idle_ms = 300000, write_ms = 60000, patience_ms = 2000;
  app.add_option("--read-ms", read_ms);
  app.add_option("--idle-ms", idle_ms);
  app.add_option("--write-ms", write_ms);
  app.add_option("--patience-ms", patience_ms);
  long table_idle_ms = 3600000;
  app.add_option("--max-table-bytes", options.max_table_bytes);
  app.add_option("--max-tables-bytes", options.max_tables_bytes);
  app.add_option("--table-idle-ms", table_idle_ms);
  app.add_flag("--insecure", options.insecure);
  app.add_option("--tls-certificate", options.tls_certificate);
  app.add_option("--tls-key", options.tls_key);
  app.add_option("--tls-client-ca", options.tls_client_ca);
  app.add_option("--token-file", options.token_file);
  app.add_option("--unix-mode", options.unix_mode);
  app.add_option("--unix-user", options.unix_users);
  app.add_option("--metrics", options.metrics);
  app.add_option("--max-shared-bytes", options.max_shared_bytes);
  bool logs = false;
  app.add_flag("--log", logs, "each call, as JSON");
  app.add_flag("--allow-benchmark", options.allow_benchmark);
  CLI11_PARSE(app, argc, argv);
  if (const rlimit limit{files, files}; files > 0) setrlimit(RLIMIT_NOFILE, &limit);
  if (logs) options.log = facetwise::LogFormat::json;
  options.log_level = facetwise::LogLevel::debug;
  options.drain_pause = std::chrono::milliseconds(pause_ms);
  options.drain_timeout = std::chrono::milliseconds(drain_ms);
  options.read_timeout = std::chrono::milliseconds(read_ms);
  options.write_timeout = std::chrono::milliseconds(write_ms);
  options.patience = std::chrono::milliseconds(patience_ms);
  options.stream_idle_timeout = std::chrono::milliseconds(idle_ms);
  options.table_idle_timeout = std::chrono::milliseconds(table_idle_ms);
  options.benchmark = report_steps;
  const absl::Status status = facetwise::serve(options, [](const facetwise::Server& server) {
    for (const std::string& address : server.addresses()) std::printf("%s\n", address.c_str());
    if (!server.metrics().empty()) std::printf("%s\n", server.metrics().c_str());
    std::printf("ready\n");
    std::fflush(stdout);
  });
  if (status.ok()) return 0;
  std::fprintf(stderr, "%s\n", std::string(status.message()).c_str());
  return 1;
}
