// SPDX-License-Identifier: Apache-2.0
#include "facetwise/server.h"

#include <unistd.h>

#include <algorithm>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "absl/strings/str_cat.h"
#include "grpcpp/ext/proto_server_reflection_plugin.h"
#include "grpcpp/grpcpp.h"
#include "grpcpp/health_check_service_interface.h"
#include "grpcpp/resource_quota.h"
#include "src/acceptor.h"
#include "src/listen.h"
#include "src/sampler_service.h"
#include "src/tls.h"
#include "wire/keep_grpc.h"
#include "wire/region.h"

namespace facetwise {
namespace {

constexpr std::chrono::milliseconds kPause{100};
// A connection without calls; clients make another when they need it.
constexpr std::chrono::milliseconds kIdleConnection = std::chrono::minutes(10);
constexpr int kReflectionThreads = 16;
// Calls that are not ours (a health watch, a reflection stream) have this long when ours are done.
constexpr std::chrono::milliseconds kLinger{300};

absl::Status check_options(const ServerOptions& options) {
  const auto invalid = [](absl::string_view what) { return absl::InvalidArgumentError(what); };
  if (options.listen.empty()) return invalid("listen: no address given: unix:PATH or HOST:PORT");
  for (const std::string& address : options.listen)
    for (const std::string& each :
         {address, unix_path(address).empty() || options.max_shared_bytes == 0 ? address : wire::region_path(address)})
      if (auto status = check_address(each, options.insecure || !options.tls_certificate.empty()); !status.ok())
        return status;
  if (!options.metrics.empty()) {
    if (!unix_path(options.metrics).empty() || !check_address(options.metrics, true).ok())
      return invalid(absl::StrCat("metrics: \"", options.metrics, "\" is not IP:PORT"));
    if (!options.insecure && !check_address(options.metrics, false).ok())
      return invalid(absl::StrCat("metrics: ", options.metrics,
                                  " is open to the network, and has no TLS: say that it may be (--insecure), or give "
                                  "127.0.0.1"));
  }
  if (auto status = check_tls(options); !status.ok()) return status;
  if (options.unix_mode > 0777) return invalid("unix_mode: not permissions");
  if (options.threads < 0) return invalid("threads: below 0");
  if (options.max_message_bytes < 4096 || options.max_message_bytes > std::size_t{1} << 30)
    return invalid("max_message_bytes: not from 4 KiB to 1 GiB");
  if (options.max_calls < 1) return invalid("max_calls: below 1");
  if (options.max_connections < 1) return invalid("max_connections: below 1");
  if (options.max_open_calls < 1) return invalid("max_open_calls: below 1");
  if (options.max_bytes_in_flight / (Admission::kMessagesHeld + 1) < options.max_message_bytes)
    return invalid(
        "max_bytes_in_flight: below five times max_message_bytes, what one call may need: it could never be answered");
  if (!resolve(options.execution.target))
    return absl::FailedPreconditionError(
        absl::StrCat("target: this CPU or build has no ", std::string(name(options.execution.target))));
  return absl::OkStatus();
}

class GrpcServer final : public Server {
 public:
  explicit GrpcServer(const ServerOptions& options)
      : options_(options),
        log_(options.log, options.log_level),
        connections_(options.max_connections),
        regions_(options.max_shared_bytes, options.unix_users, log_),
        service_(options, connections_, regions_, log_) {}
  ~GrpcServer() override { drain(); }

  absl::Status listen();

  std::span<const std::string> addresses() const override { return addresses_; }
  const std::string& metrics() const override { return metrics_; }
  void wait() override {
    server_->Wait();
    const std::lock_guard lock(drain_mutex_);
  }
  void drain() override;

 private:
  const ServerOptions options_;
  Log log_;
  Connections connections_;
  SharedRegions regions_;
  SamplerService service_;
  std::vector<SocketLock> sockets_;
  std::vector<std::string> addresses_;
  std::string metrics_;
  std::mutex drain_mutex_;
  bool drained_ = false;
  std::unique_ptr<grpc::Server> server_;
  std::optional<Acceptor> acceptor_;  // goes first
};

absl::Status GrpcServer::listen() {
  if (auto status = service_.read_tokens(); !status.ok()) return status;
  wire::keep_grpc();
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  grpc::ServerBuilder builder;
  builder.RegisterService(&service_);
  builder.SetMaxReceiveMessageSize(static_cast<int>(options_.max_message_bytes));
  // A compressed message may be a thousand times as large as what was sent.
  for (const auto algorithm : {GRPC_COMPRESS_DEFLATE, GRPC_COMPRESS_GZIP})
    builder.SetCompressionAlgorithmSupportStatus(algorithm, false);
  // Connections that were cut off are found; clients may ping as often as ours do.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 30000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_IDLE_MS, static_cast<int>(kIdleConnection.count()));
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 5000);
  builder.SetMaxSendMessageSize(-1);  // answer_batch() keeps responses below the limit
  // One client leaves places for others; what it asks for beyond waits in its own gRPC.
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, std::max(options_.max_open_calls / 4, 16));
  // What comes before it was asked for; estimating the bandwidth would raise it.
  builder.AddChannelArgument(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, static_cast<int>(Admission::kReadAhead));
  builder.AddChannelArgument(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  // Only reflection, which is gRPC's own, has a thread per call.
  grpc::ResourceQuota quota;
  quota.SetMaxThreads(kReflectionThreads);
  builder.SetResourceQuota(quota);

  using External = grpc::ServerBuilder::experimental_type::ExternalConnectionType;
  auto to_unix =
      builder.experimental().AddExternalConnectionAcceptor(External::FROM_FD, grpc::InsecureServerCredentials());
  auto to_tcp = builder.experimental().AddExternalConnectionAcceptor(External::FROM_FD, credentials(options_));
  std::vector<Acceptor::Place> places;
  std::vector<Socket> for_memory;
  for (const std::string& address : options_.listen) {
    const std::string path = unix_path(address);
    if (!path.empty()) {
      auto lock = SocketLock::take(path);
      if (!lock.ok()) return lock.status();
      sockets_.push_back(*std::move(lock));
    }
    auto listening = listen_on(address, options_.unix_mode);
    if (!listening.ok()) return listening.status();
    if (!path.empty() && options_.max_shared_bytes > 0) {
      auto lock = SocketLock::take(wire::region_path(path));
      if (!lock.ok()) return lock.status();
      sockets_.push_back(*std::move(lock));
      auto memory = listen_on(wire::region_path(address), options_.unix_mode);
      if (!memory.ok()) return memory.status();
      for_memory.push_back(std::move(memory->sockets[0]));
    }
    addresses_.push_back(listening->address);
    for (Socket& socket : listening->sockets)
      places.push_back({std::move(socket), path.empty() ? to_tcp.get() : to_unix.get()});
  }
  server_ = builder.BuildAndStart();
  if (!server_) return absl::UnavailableError("listen: the server could not start");
  if (!options_.metrics.empty()) {
    auto listening = service_.metrics().listen(options_.metrics);
    if (!listening.ok()) return listening.status();
    metrics_ = *std::move(listening);
  }
  if (!for_memory.empty()) regions_.listen(std::move(for_memory));
  acceptor_.emplace(std::move(places), std::move(to_unix), std::move(to_tcp), options_.unix_users, connections_, log_);
  server_->GetHealthCheckService()->SetServingStatus("facetwise.v1.Sampler", true);
  const v1::InfoResponse& info = service_.identity();
  log_.write(LogLevel::info, "serves",
             {{"version", info.version()},
              {"process", getpid()},
              {"target", info.target()},
              {"threads", info.threads()},
              {"addresses", addresses_},
              {"metrics", metrics_}});
  return absl::OkStatus();
}

void GrpcServer::drain() {
  const std::lock_guard lock(drain_mutex_);
  if (drained_ || !server_) return;
  drained_ = true;
  const auto until = std::chrono::steady_clock::now() + options_.drain_timeout;
  log_.write(LogLevel::info, "drains", {{"calls", service_.admission().load().open}});
  service_.begin_drain();
  server_->GetHealthCheckService()->SetServingStatus(false);
  // Those who watch the health go elsewhere meanwhile, instead of being refused.
  std::this_thread::sleep_for(options_.drain_pause);
  service_.admission().close();
  // gRPC's own shutdown would drop calls whose requests are on their way, so until ours are done it goes on
  // and new calls are refused one by one. The pause is for those that have just arrived.
  service_.admission().wait_until_idle(until);
  std::this_thread::sleep_for(kPause);
  service_.admission().wait_until_idle(until);
  const int left = service_.admission().load().open;
  if (left > 0) log_.write(LogLevel::warning, "ends calls", {{"calls", left}});
  acceptor_.reset();
  server_->Shutdown(std::chrono::system_clock::now() + (left == 0 ? kLinger : std::chrono::milliseconds(0)));
  sockets_.clear();
  log_.write(LogLevel::info, "ended", {{"lanes", service_.metrics().lanes()}});
}

}  // namespace

absl::StatusOr<std::unique_ptr<Server>> Server::start(const ServerOptions& options) {
  if (auto status = check_options(options); !status.ok()) return status;
  auto server = std::make_unique<GrpcServer>(options);
  if (auto status = server->listen(); !status.ok()) return status;
  return server;
}

}  // namespace facetwise
