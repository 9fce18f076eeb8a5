// The only place where a status is translated.
#pragma once

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "grpcpp/support/status.h"

namespace facetwise::wire {

grpc::Status to_grpc(const absl::Status& status);
// With "server ADDRESS: " before the message.
absl::Status from_grpc(const grpc::Status& status, absl::string_view address);

}  // namespace facetwise::wire
