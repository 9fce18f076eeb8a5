#include "wire/status.h"

#include <string>

#include "absl/strings/str_cat.h"

namespace facetwise::wire {

// The codes of both are the canonical ones, with the same numbers.
static_assert(static_cast<int>(absl::StatusCode::kInvalidArgument) == grpc::StatusCode::INVALID_ARGUMENT);
static_assert(static_cast<int>(absl::StatusCode::kUnauthenticated) == grpc::StatusCode::UNAUTHENTICATED);

grpc::Status to_grpc(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  return {static_cast<grpc::StatusCode>(status.code()), std::string(status.message())};
}

absl::Status from_grpc(const grpc::Status& status, absl::string_view address) {
  if (status.ok()) return absl::OkStatus();
  return {static_cast<absl::StatusCode>(status.error_code()),
          absl::StrCat("server ", address, ": ", status.error_message())};
}

}  // namespace facetwise::wire
