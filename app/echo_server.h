// SPDX-License-Identifier: Apache-2.0
// A server that does nothing: what transports cost by themselves.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "facetwise/server.h"

namespace facetwise::app {

// Answers each message of any call "/echo/N" with N bytes that were there before, at these addresses, until the process ends. With
// gRPC's callbacks, as the server has them, and TLS by the options' files, if there are any.
absl::Status serve_echo(const std::vector<std::string>& addresses, const ServerOptions& options);

}  // namespace facetwise::app
