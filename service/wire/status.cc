// SPDX-License-Identifier: Apache-2.0
#include "wire/status.h"

#include <string>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "facetwise/v1/error_details.pb.h"

namespace facetwise::wire {
namespace {

// The codes of both are the canonical ones, with the same numbers.
static_assert(static_cast<int>(absl::StatusCode::kInvalidArgument) == grpc::StatusCode::INVALID_ARGUMENT);
static_assert(static_cast<int>(absl::StatusCode::kUnauthenticated) == grpc::StatusCode::UNAUTHENTICATED);

constexpr const char* kBadRequest = "type.googleapis.com/google.rpc.BadRequest";
constexpr const char* kRetryInfo = "type.googleapis.com/google.rpc.RetryInfo";
// A busy server has answered some calls by then; one that shuts down has perhaps been started again.
constexpr std::chrono::milliseconds kBusy{50}, kGone{1000};

// What a message begins with: "alpha_x" of "alpha_x: 10 values for 12 lanes". Empty: no field.
absl::string_view field_of(absl::string_view message) {
  const auto colon = message.find(": ");
  if (colon == absl::string_view::npos) return {};
  for (const char letter : message.substr(0, colon))
    if (!absl::ascii_isalnum(letter) && letter != '_' && letter != '.' && letter != '[' && letter != ']') return {};
  return message.substr(0, colon);
}

template <class Detail>
std::string details(const absl::Status& status, const char* type, const Detail& detail) {
  v1::ErrorStatus all;
  all.set_code(static_cast<int>(status.code()));
  all.set_message(std::string(status.message()));
  auto& any = *all.add_details();
  any.set_type_url(type);
  any.set_value(detail.SerializeAsString());
  return all.SerializeAsString();
}

std::string details(const absl::Status& status) {
  switch (status.code()) {
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kNotFound: {
      const absl::string_view field = field_of(status.message());
      if (field.empty()) return "";
      v1::BadRequest request;
      auto& violation = *request.add_field_violations();
      violation.set_field(std::string(field));
      violation.set_description(std::string(status.message().substr(field.size() + 2)));
      return details(status, kBadRequest, request);
    }
    case absl::StatusCode::kResourceExhausted:
    case absl::StatusCode::kUnavailable: {
      v1::RetryInfo retry;
      const auto delay = status.code() == absl::StatusCode::kUnavailable ? kGone : kBusy;
      retry.mutable_retry_delay()->set_seconds(delay.count() / 1000);
      retry.mutable_retry_delay()->set_nanos(static_cast<int>(delay.count() % 1000) * 1'000'000);
      return details(status, kRetryInfo, retry);
    }
    default: return "";
  }
}

}  // namespace

grpc::Status to_grpc(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  return {static_cast<grpc::StatusCode>(status.code()), std::string(status.message()), details(status)};
}

absl::Status from_grpc(const grpc::Status& status, absl::string_view address) {
  if (status.ok()) return absl::OkStatus();
  return {static_cast<absl::StatusCode>(status.error_code()),
          absl::StrCat("server ", address, ": ", status.error_message())};
}

std::optional<std::chrono::milliseconds> retry_delay(const grpc::Status& status) {
  v1::ErrorStatus all;
  if (!all.ParseFromString(status.error_details())) return std::nullopt;
  for (const auto& any : all.details()) {
    v1::RetryInfo retry;
    if (any.type_url() != kRetryInfo || !retry.ParseFromString(any.value())) continue;
    return std::chrono::milliseconds(retry.retry_delay().seconds() * 1000 + retry.retry_delay().nanos() / 1'000'000);
  }
  return std::nullopt;
}

}  // namespace facetwise::wire
