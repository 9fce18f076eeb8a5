// SPDX-License-Identifier: Apache-2.0
// The server's certificates.
#pragma once

#include <memory>

#include "absl/status/statusor.h"
#include "facetwise/server.h"
#include "grpcpp/security/server_credentials.h"

namespace facetwise {

// OK, or which file of the options cannot be used, and why. Without TLS: OK.
absl::Status check_tls(const ServerOptions& options);
// Of a HOST:PORT: TLS if the options have a certificate. The files are read again within a second of a change.
std::shared_ptr<grpc::ServerCredentials> credentials(const ServerOptions& options);

}  // namespace facetwise
