// SPDX-License-Identifier: Apache-2.0
// The server: answers the library's calls over gRPC (proto/facetwise/v1/sampler.proto). docs/remote.md says
// what its users see.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "facetwise/target.h"
#include "facetwise/tune_malloc.h"
#include "facetwise/v1/sampler.pb.h"

namespace facetwise {

// Runs the benchmarks that a Benchmark call asks for. Calls `report` after each; when that returns false
// (the client has gone, or the server drains) it stops early and returns OK. An error becomes the call's.
// Called on one thread at a time. The request's min_seconds is in (0, 10] or 0, its filter at most 1,000
// bytes; whether the filter is a regular expression is for the runner to check.
using BenchmarkReport = std::function<bool(const v1::BenchmarkProgress&)>;
using BenchmarkRunner = std::function<absl::Status(const v1::BenchmarkRequest&, const BenchmarkReport&)>;

// What a server writes to standard error of its life, of calls that fail and (debug) of each call: a line an event, as
// name=value or as a JSON object.
enum class LogFormat { none, text, json };
enum class LogLevel { debug, info, warning };

struct ServerOptions {
  // Where to listen: "unix:PATH" or "HOST:PORT", one or more. Port 0 takes a free one: see addresses(). Hosts other than
  // this machine's loopback (127.*, localhost, [::1]) are refused without TLS, unless `insecure`.
  std::vector<std::string> listen;
  bool insecure = false;
  // TLS 1.2 or later for every HOST:PORT: PEM files of a certificate with those that signed it, and of its key. With
  // `tls_client_ca`, clients must have a certificate that one of its authorities signed. The files are read again within
  // a second of a change; replace them by renaming.
  std::string tls_certificate, tls_key, tls_client_ca;
  // Each call must carry one of this file's tokens, as the metadata "authorization: Bearer TOKEN", else it gets
  // UNAUTHENTICATED: a token a line, 16 visible characters at least, # for comments. Read again as above. Health checks
  // and reflection need none.
  std::string token_file;
  // Permissions of Unix sockets. Who may write to the socket may call.
  unsigned unix_mode = 0600;
  // Ids of the users whose processes may connect to Unix sockets, as the system tells them; empty: all that may write there.
  std::vector<unsigned> unix_users;
  // IP:PORT that gives what is counted at http://IP:PORT/metrics, for Prometheus, without TLS or token: of this machine's
  // loopback, unless `insecure`. Empty: nowhere.
  std::string metrics;
  LogFormat log = LogFormat::none;
  LogLevel log_level = LogLevel::info;
  // Threads that compute; 0: as many as the machine has.
  int threads = 0;
  // Largest request that is read and largest response that is made. A call's lanes are at most a quarter of
  // it, so that a small request cannot ask for unbounded work.
  std::size_t max_message_bytes = std::size_t{16} << 20;
  // Calls (and messages of streams) that are worked on at once, until their answers have left; one more gets
  // RESOURCE_EXHAUSTED. Calls that are open, those that wait for their client among them.
  int max_calls = 128;
  int max_open_calls = 1024;
  // Bytes of messages at once: half are for requests on their way, each of which counts as max_message_bytes and waits
  // until there is room; the rest are for requests (as received, and as decoded) and answers, and a call that would go
  // above gets RESOURCE_EXHAUSTED. Five times max_message_bytes at least.
  std::size_t max_bytes_in_flight = std::size_t{1} << 32;
  // Connections at once; further ones wait until one is closed. Never more than the process may have open files, less some.
  int max_connections = 4096;
  // Tables of slopes that clients upload: largest of one, of all together, and how long one stays that nobody uses.
  std::size_t max_table_bytes = std::size_t{64} << 20, max_tables_bytes = std::size_t{256} << 20;
  std::chrono::milliseconds table_idle_timeout{3600000};
  // Bytes of memory that clients on this machine may share with the server, all together, so that columns there need not be
  // sent; 0: none. They hand it over at PATH.memory beside a Unix socket PATH, and must be of the server's own user, or of
  // `unix_users`.
  std::size_t max_shared_bytes = 0;
  // How long a call may take to send its message, a stream may leave between messages, and a client may take to receive
  // an answer, before the call is cancelled.
  std::chrono::milliseconds read_timeout{20000}, stream_idle_timeout{300000}, write_timeout{60000};
  // The same where another call has been refused, or waits, for want of room: those that wait longest for their client go.
  std::chrono::milliseconds patience{2000};
  // How long drain() takes calls after it has told that it will not, and how long, with that, it waits for calls in flight
  // before it ends them.
  std::chrono::milliseconds drain_pause{500}, drain_timeout{10000};
  // Which kernels run. Its thread setting is not used.
  Execution execution;
  // Benchmark calls are PERMISSION_DENIED unless allowed and a runner is given.
  bool allow_benchmark = false;
  BenchmarkRunner benchmark;
};

class Server {
 public:
  // Listens and answers from now on. InvalidArgument for options that mean nothing; Unavailable, naming the
  // address, where it cannot listen (another server has the Unix socket or the port).
  static absl::StatusOr<std::unique_ptr<Server>> start(const ServerOptions& options);
  virtual ~Server() = default;  // drains

  // The addresses that it listens on, as clients name them: port 0 replaced by the one taken.
  virtual std::span<const std::string> addresses() const = 0;
  // The same of `metrics`; empty: it gives none.
  virtual const std::string& metrics() const = 0;
  // Returns when the server has drained.
  virtual void wait() = 0;
  // Health says NOT_SERVING; after drain_pause no new calls are taken, those in flight finish (until drain_timeout, then
  // they are cancelled). Returns when all is done. Any thread may call it, more than once.
  virtual void drain() = 0;
};

// A server process: starts, calls `ready`, serves until SIGTERM or SIGINT, drains. OK then; a second signal
// ends the process at once. Also tunes malloc for large messages (tune_malloc).
absl::Status serve(const ServerOptions& options, const std::function<void(const Server&)>& ready = {});

}  // namespace facetwise
