// SPDX-License-Identifier: Apache-2.0
#include "app/echo_server.h"

#include <cstdlib>

#include "grpcpp/generic/async_generic_service.h"
#include "grpcpp/grpcpp.h"
#include "grpcpp/security/server_credentials.h"
#include "wire/text_file.h"

namespace facetwise::app {
namespace {

class Echo final : public grpc::ServerGenericBidiReactor {
 public:
  explicit Echo(std::size_t bytes) {
    const grpc::Slice slice(std::string(bytes, '\0'));
    answer_ = grpc::ByteBuffer(&slice, 1);
    StartRead(&request_);
  }
  void OnReadDone(bool good) override {
    if (good)
      StartWrite(&answer_);
    else
      Finish(grpc::Status::OK);
  }
  void OnWriteDone(bool good) override {
    if (good)
      StartRead(&request_);
    else
      Finish(grpc::Status::CANCELLED);
  }
  void OnDone() override { delete this; }

 private:
  grpc::ByteBuffer request_, answer_;
};

class Service final : public grpc::CallbackGenericService {
  grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext* context) override {
    const std::string& method = context->method();
    return new Echo(std::strtoull(method.substr(method.rfind('/') + 1).c_str(), nullptr, 10));
  }
};

}  // namespace

absl::Status serve_echo(const std::vector<std::string>& addresses, const ServerOptions& options) {
  auto credentials = grpc::InsecureServerCredentials();
  if (!options.tls_certificate.empty()) {
    const auto key = wire::read_text_file(options.tls_key), certificate = wire::read_text_file(options.tls_certificate);
    if (!key.ok()) return key.status();
    if (!certificate.ok()) return certificate.status();
    grpc::SslServerCredentialsOptions tls;
    tls.pem_key_cert_pairs.push_back({*key, *certificate});
    credentials = grpc::SslServerCredentials(tls);
  }
  Service service;
  grpc::ServerBuilder builder;
  builder.RegisterCallbackGenericService(&service);
  builder.SetMaxReceiveMessageSize(-1);
  builder.SetMaxSendMessageSize(-1);
  for (const std::string& address : addresses)
    builder.AddListeningPort(address, address.starts_with("unix:") ? grpc::InsecureServerCredentials() : credentials);
  const auto server = builder.BuildAndStart();
  if (server == nullptr) return absl::UnavailableError("the echo server could not start");
  server->Wait();
  return absl::OkStatus();
}

}  // namespace facetwise::app
