// SPDX-License-Identifier: Apache-2.0
// The remote engine: the library's calls, answered by one or more facetwise servers.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "absl/status/statusor.h"
#include "facetwise/engine.h"
#include "facetwise/tune_malloc.h"

namespace facetwise {

class SharedMemory;

struct ConnectOptions {
  // Lanes of a batch are sent in pieces of about this many bytes (request or response, the larger), several
  // at a time. Below the server's limit always.
  std::size_t piece_bytes = std::size_t{1} << 20;
  // Pieces in flight at once, over all servers.
  int window = 4;
  // How long connect() waits for a server, and a call for one to come back, when none answers.
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
  // Columns that lie in this memory (shared_memory.h) are not sent: servers, which must all be unix:PATH and have been started to
  // share memory, read and write them there.
  std::shared_ptr<SharedMemory> shared_memory{};
  // Directions and weights come in half their bytes, for networks: directions at most 8e-5 rad off, with z's sign kept, weights
  // rounded to 2^-11 of themselves, those above 65504 to 65504 (sampler.proto). Results are not the local engine's bits then, but
  // the same from every server.
  bool compact_answers = false;
  // Called once a batch, on the thread that asks for it: the W3C trace context ("00-...") that its calls belong to, which
  // servers write to their logs. Empty: none.
  std::function<std::string()> traceparent{};
  // Called by connect() for each server that does not answer while another does, with what may be printed: which, and why.
  std::function<void(const std::string& message)> absent{};
};

// Connects to servers; each address is "unix:PATH" or "HOST:PORT". Pieces of a batch go to those that are there, in turn;
// since every server gives the same bits, it does not matter which answers. A piece whose server is lost, busy or silent is
// sent again, to another or later; a server that was absent, or comes back, is used when it is there. Unavailable if none
// answers in time, or a certificate is not trusted; Unauthenticated if one refuses the token.
//
// The engine's calls return what the local engine's do. A malformed call gets the same error, from checks
// made here, before anything is sent or written. A call also fails when no server answers for connect_timeout, or one says
// that it never will: the error begins with "server ADDRESS:" and names the request as the server's log does, and outputs
// of pieces that were answered before it are written. Several threads may use one engine. A program that moves much data should call tune_malloc() at its start.
absl::StatusOr<std::unique_ptr<Engine>> connect(std::span<const std::string> addresses,
                                                const ConnectOptions& options = {});

}  // namespace facetwise
