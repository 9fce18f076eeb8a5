// SPDX-License-Identifier: Apache-2.0
#include "src/tls.h"

#include <openssl/err.h>
#include <openssl/ssl.h>

#include "absl/strings/str_cat.h"
#include "grpcpp/security/tls_certificate_provider.h"
#include "grpcpp/security/tls_credentials_options.h"
#include "wire/text_file.h"

namespace facetwise {
namespace {

constexpr unsigned kRefreshSeconds = 1;

absl::Status unusable(const char* option, const std::string& path) {
  const unsigned long code = ERR_get_error();
  const char* reason = code == 0 ? nullptr : ERR_reason_error_string(code);
  return absl::InvalidArgumentError(
      absl::StrCat(option, ": ", path, ": ", reason == nullptr ? "no PEM file of that kind" : reason));
}

}  // namespace

absl::Status check_tls(const ServerOptions& options) {
  if (options.tls_certificate.empty() != options.tls_key.empty())
    return absl::InvalidArgumentError("tls_certificate, tls_key: only one of them is given");
  if (options.tls_certificate.empty())
    return options.tls_client_ca.empty()
               ? absl::OkStatus()
               : absl::InvalidArgumentError("tls_client_ca: needs tls_certificate and tls_key");
  for (const std::string* file : {&options.tls_certificate, &options.tls_key, &options.tls_client_ca})
    if (!file->empty())
      if (const auto text = wire::read_text_file(*file); !text.ok()) return text.status();
  ERR_clear_error();
  const std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> context(SSL_CTX_new(TLS_server_method()), SSL_CTX_free);
  if (SSL_CTX_use_certificate_chain_file(context.get(), options.tls_certificate.c_str()) != 1)
    return unusable("tls_certificate", options.tls_certificate);
  // Fails for the key of another certificate too.
  if (SSL_CTX_use_PrivateKey_file(context.get(), options.tls_key.c_str(), SSL_FILETYPE_PEM) != 1)
    return unusable("tls_key", options.tls_key);
  if (!options.tls_client_ca.empty() &&
      SSL_CTX_load_verify_locations(context.get(), options.tls_client_ca.c_str(), nullptr) != 1)
    return unusable("tls_client_ca", options.tls_client_ca);
  return absl::OkStatus();
}

std::shared_ptr<grpc::ServerCredentials> credentials(const ServerOptions& options) {
  if (options.tls_certificate.empty()) return grpc::InsecureServerCredentials();
  const auto files = std::make_shared<grpc::experimental::FileWatcherCertificateProvider>(
      options.tls_key, options.tls_certificate, options.tls_client_ca, kRefreshSeconds);
  grpc::experimental::TlsServerCredentialsOptions tls(files);
  tls.watch_identity_key_cert_pairs();
  if (!options.tls_client_ca.empty()) {
    tls.watch_root_certs();
    tls.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  return grpc::experimental::TlsServerCredentials(tls);
}

}  // namespace facetwise
