// SPDX-License-Identifier: Apache-2.0
// transport: what it costs to ask a server on this machine.
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "app/arguments.h"
#include "app/echo_server.h"
#include "app/errors.h"
#include "app/progress.h"
#include "app/transport.h"
#include "app/verbs.h"
#include "bench/machine.h"
#include "facetwise/server.h"

namespace facetwise::app {
namespace {

using Json = nlohmann::ordered_json;

// A process that runs `serve`, for as long as the object lives; begun before this one has threads. What it writes to `ready` are
// the addresses that it chose.
class Child {
 public:
  template <class Serve>
  explicit Child(const Serve& serve) {
    int ends[2];
    if (pipe(ends) != 0) return;
    const pid_t parent = getpid();
    process_ = fork();
    if (process_ == 0) {
      prctl(PR_SET_PDEATHSIG, SIGKILL);
      if (getppid() != parent) _exit(1);
      const absl::Status status = serve(ends[1]);
      if (!status.ok()) fmt::print(stderr, "facetwise transport: {}\n", std::string(status.message()));
      std::fflush(stderr);
      _exit(1);
    }
    close(ends[1]);
    for (char byte; read(ends[0], &byte, 1) == 1 && byte != '\n';) ready_ += byte;
    close(ends[0]);
  }
  ~Child() {
    if (process_ <= 0) return;
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  const std::string& ready() const { return ready_; }

 private:
  pid_t process_ = -1;
  std::string ready_;
};

struct TransportVerb {
  TransportOptions options;
  ServerOptions tls;
  std::string ca;
  bool json = false;

  int run() {
    std::string folder = std::filesystem::temp_directory_path() / "facetwise-XXXXXX";
    if (mkdtemp(folder.data()) == nullptr)
      return fail("transport", absl::UnavailableError(folder + ": cannot be made"));
    const auto result = measure(folder);
    std::filesystem::remove_all(folder);
    if (!result.ok()) return fail("transport", result.status());
    if (json)
      print_json(*result);
    else
      print(*result);
    return kDone;
  }

  absl::StatusOr<TransportResult> measure(const std::string& folder) {
    const std::string echo_socket = "unix:" + folder + "/echo", socket = "unix:" + folder + "/facetwise";
    const bool with_tls = !ca.empty();
    const auto server = [&](const std::string& listen, const ServerOptions& security, std::size_t shared) {
      return [=](int ready) {
        ServerOptions options = security;
        options.listen = {listen};
        options.max_shared_bytes = shared;
        return serve(options, [&](const Server& started) {
          const std::string line = started.addresses()[0] + "\n";
          if (write(ready, line.data(), line.size()) < 0) std::abort();
        });
      };
    };
    // gRPC's listener does not tell its port where it chose one, so the echo server has those that were free a moment ago.
    const auto echo = [&](const std::string& listen, const ServerOptions& security) {
      return [=](int ready) {
        if (write(ready, "\n", 1) < 0) std::abort();
        return serve_echo({listen}, security);
      };
    };
    const auto free_port = [&]() -> std::string {
      const Child child(server("127.0.0.1:0", {}, 0));
      return child.ready();
    };
    const std::string echo_tcp = free_port(), echo_tls = with_tls ? free_port() : "";
    const Child echo_unix_child(echo(echo_socket, {})), echo_tcp_child(echo(echo_tcp, {}));
    const Child unix_child(server(socket, {}, std::size_t{1} << 30)), tcp_child(server("127.0.0.1:0", {}, 0));
    options.pairs = {{"Unix socket", echo_socket, socket, {}}, {"TCP", echo_tcp, tcp_child.ready(), {}}};
    options.shared = socket;
    std::optional<Child> echo_tls_child, tls_child;
    if (with_tls) {
      echo_tls_child.emplace(echo(echo_tls, tls));
      tls_child.emplace(server("127.0.0.1:0", tls, 0));
      ConnectOptions connection;
      connection.tls_ca = ca;
      options.pairs.push_back({"TLS", echo_tls, tls_child->ready(), connection});
    }
    Progress progress("transport");
    return measure_transport(options, [&](double done) { progress(done); });
  }

  static void print(const TransportResult& result) {
    fmt::print("{}, {} cores; servers and client on the same ones\n\n", bench::cpu_model(), bench::usable_cores());
    fmt::print("Millions of lanes a second, four messages at a time, every input a column\n");
    fmt::print("{:<14} {:<8} {:>9} {:>9} {:>11} {:>7}\n", "", "", "lanes", "echo", "facetwise", "ratio");
    for (const TransportRate& rate : result.rates)
      fmt::print("{:<14} {:<8} {:>9} {:>9.1f} {:>11.1f} {:>7.2f}\n", rate.transport, rate.stream ? "stream" : "call",
                 rate.lanes, rate.echo, rate.facetwise, rate.ratio);
    fmt::print("\nMicroseconds for 64 lanes, one call after another\n");
    fmt::print("{:<14} {:>11} {:>11} {:>7} {:>11} {:>11} {:>7}\n", "", "echo p50", "facetwise", "ratio", "echo p99",
               "facetwise", "ratio");
    for (const TransportDelay& delay : result.delays)
      fmt::print("{:<14} {:>11.1f} {:>11.1f} {:>7.2f} {:>11.1f} {:>11.1f} {:>7.2f}\n", delay.transport, delay.echo_p50,
                 delay.facetwise_p50, delay.facetwise_p50 / delay.echo_p50, delay.echo_p99, delay.facetwise_p99,
                 delay.facetwise_p99 / delay.echo_p99);
    fmt::print("\nNanoseconds a sample, through the library\n");
    for (const TransportCost& cost : result.costs)
      fmt::print("{:>9} lanes  {:<48} {:>8.2f}\n", cost.lanes, cost.way, cost.nanoseconds);
  }

  static void print_json(const TransportResult& result) {
    Json out = {{"cpu", bench::cpu_model()}, {"cores", bench::usable_cores()}};
    for (const TransportRate& rate : result.rates)
      out["rates"].push_back({{"transport", rate.transport},
                              {"stream", rate.stream},
                              {"lanes", rate.lanes},
                              {"echo_mlanes", rate.echo},
                              {"facetwise_mlanes", rate.facetwise},
                              {"ratio", rate.ratio}});
    for (const TransportDelay& delay : result.delays)
      out["delays"].push_back({{"transport", delay.transport},
                               {"echo_p50", delay.echo_p50},
                               {"echo_p99", delay.echo_p99},
                               {"facetwise_p50", delay.facetwise_p50},
                               {"facetwise_p99", delay.facetwise_p99}});
    for (const TransportCost& cost : result.costs)
      out["costs"].push_back({{"way", cost.way}, {"lanes", cost.lanes}, {"nanoseconds", cost.nanoseconds}});
    fmt::print("{}\n", out.dump(2));
  }
};

}  // namespace

Verb add_transport(CLI::App& app) {
  auto arguments = std::make_shared<TransportVerb>();
  CLI::App& command = *app.add_subcommand("transport", "Measure what it costs to ask a server on this machine");
  command.footer(
      R"(It starts servers of its own, facetwise's and ones of the same gRPC that do nothing but send answers of the same size, and
measures them in turn; then batches through the library: here, on the servers, and in shared memory.

Examples:
  facetwise transport
  facetwise transport --tls-certificate server.pem --tls-key server.key --tls-ca ca.pem --json)");
  const auto add_file = [&](const char* flag, std::string& file, const char* help) {
    return command.add_option(flag, file, help)->option_text("FILE");
  };
  auto* certificate =
      add_file("--tls-certificate", arguments->tls.tls_certificate, "Also over TLS: a certificate for 127.0.0.1");
  auto* key = add_file("--tls-key", arguments->tls.tls_key, "The certificate's key");
  auto* ca = add_file("--tls-ca", arguments->ca, "Who signed the certificate");
  certificate->needs(key)->needs(ca);
  key->needs(certificate);
  ca->needs(certificate);
  command
      .add_option("--seconds", arguments->options.seconds, "Of each measurement, of which there are five; default 0.4")
      ->check(CLI::Range(0.001, 60.0))
      ->option_text("S");
  command.add_flag("--json", arguments->json, "Print JSON");
  return {&command, [arguments] { return arguments->run(); }};
}

}  // namespace facetwise::app
