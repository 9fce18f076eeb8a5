// SPDX-License-Identifier: Apache-2.0
#include "src/tokens.h"

#include <openssl/crypto.h>

#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "wire/text_file.h"

namespace facetwise {
namespace {

// Takes a time that does not depend on how much of a token is right.
bool equal(absl::string_view a, const std::string& b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), b.size()) == 0;
}

}  // namespace

absl::Status Tokens::read() {
  if (path_.empty()) return absl::OkStatus();
  struct stat now {};
  stat(path_.c_str(), &now);
  auto tokens = wire::read_tokens(path_);
  if (!tokens.ok())
    return absl::Status(tokens.status().code(), absl::StrCat("token_file: ", tokens.status().message()));
  tokens_ = *std::move(tokens);
  seen_ = now;
  return absl::OkStatus();
}

void Tokens::read_if_changed() {
  const auto now = std::chrono::steady_clock::now();
  if (now - looked_ < std::chrono::seconds(1)) return;
  looked_ = now;
  struct stat there {};
  if (stat(path_.c_str(), &there) != 0) return;
  if (there.st_mtim.tv_sec == seen_.st_mtim.tv_sec && there.st_mtim.tv_nsec == seen_.st_mtim.tv_nsec &&
      there.st_ino == seen_.st_ino && there.st_size == seen_.st_size)
    return;
  if (const auto status = read(); !status.ok()) {
    seen_ = there;
    log_.write(LogLevel::warning, "tokens stay as they were", {{"why", std::string(status.message())}});
  } else {
    log_.write(LogLevel::info, "tokens read again", {{"tokens", tokens_.size()}});
  }
}

absl::Status Tokens::check(const grpc::CallbackServerContext& context) {
  if (path_.empty()) return absl::OkStatus();
  constexpr absl::string_view kScheme = "Bearer ";
  const auto& metadata = context.client_metadata();
  const auto [first, last] = metadata.equal_range("authorization");
  if (first == last) return absl::UnauthenticatedError("token: none given; this server asks for one");
  const absl::string_view value(first->second.data(), first->second.size());
  bool right = false;
  const std::lock_guard lock(mutex_);
  read_if_changed();
  if (std::next(first) == last && value.substr(0, kScheme.size()) == kScheme)
    for (const std::string& token : tokens_) right |= equal(value.substr(kScheme.size()), token);
  return right ? absl::OkStatus() : absl::UnauthenticatedError("token: not one of this server's");
}

}  // namespace facetwise
