// The remote engine: the library's calls, answered by one or more facetwise servers.
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "absl/status/statusor.h"
#include "facetwise/engine.h"
#include "facetwise/tune_malloc.h"

namespace facetwise {

struct ConnectOptions {
  // Lanes of a batch are sent in pieces of about this many bytes (request or response, the larger), several
  // at a time. Below the server's limit always.
  std::size_t piece_bytes = std::size_t{1} << 20;
  // Pieces in flight at once, over all servers.
  int window = 4;
  // How long connect(), or a call that has lost its server, waits for it (to come back).
  std::chrono::milliseconds connect_timeout{5000};
  // How long a piece waits for its answer.
  std::chrono::milliseconds call_timeout{60000};
  // TLS, to every HOST:PORT: PEM files of who may have signed the server's certificate (Debian's authorities are
  // /etc/ssl/certs/ca-certificates.crt), and of this client's own certificate, for servers that ask for one. `tls_name` is
  // the name in the server's certificate, where that is not the host's.
  std::string tls_ca{}, tls_certificate{}, tls_key{}, tls_name{};
  // A file whose first line is the token that the server asks for (server.h). Refused where it would cross a network
  // without TLS.
  std::string token_file{};
};

// Connects to servers; each address is "unix:PATH" or "HOST:PORT". Pieces of a batch go to them in turn;
// since every server gives the same bits, it does not matter which answers. Unavailable if one does not
// answer in time, or its certificate is not trusted; Unauthenticated if it refuses the token.
//
// The engine's calls return what the local engine's do. A malformed call gets the same error, from checks
// made here, before anything is sent or written. A call also fails when a server does: the error begins with
// "server ADDRESS:", and outputs of pieces that were answered before it are written. Several threads may use
// one engine. A program that moves much data should call tune_malloc() at its start.
absl::StatusOr<std::unique_ptr<Engine>> connect(std::span<const std::string> addresses,
                                                const ConnectOptions& options = {});

}  // namespace facetwise
