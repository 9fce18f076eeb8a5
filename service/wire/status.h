// SPDX-License-Identifier: Apache-2.0
// The only place where a status is translated.
#pragma once

#include <chrono>
#include <optional>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "grpcpp/support/status.h"

namespace facetwise::wire {

// With details (proto/facetwise/v1/error_details.proto): the field where the message begins with one, and that the call may
// be made again where that is so.
grpc::Status to_grpc(const absl::Status& status);
// With "server ADDRESS: " before the message.
absl::Status from_grpc(const grpc::Status& status, absl::string_view address);
// After how long the server says that the same call may be made again.
std::optional<std::chrono::milliseconds> retry_delay(const grpc::Status& status);

}  // namespace facetwise::wire
