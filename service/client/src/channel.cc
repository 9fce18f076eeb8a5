// SPDX-License-Identifier: Apache-2.0
#include "facetwise/channel.h"

#include "absl/strings/str_cat.h"
#include "facetwise/v1/sampler.grpc.pb.h"
#include "wire/keep_grpc.h"
#include "wire/text_file.h"

namespace facetwise {
namespace {

using wire::read_token;

bool is_unix(const std::string& address) { return address.starts_with("unix:"); }

bool is_loopback(const std::string& address) {
  return address.starts_with("127.") || address.starts_with("localhost:") || address.starts_with("[::1]:");
}

absl::Status check_address(const std::string& address) {
  const auto colon = address.rfind(':');
  if (is_unix(address) ? address.size() > 5 : colon != std::string::npos && colon > 0 && colon + 1 < address.size())
    return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("address: \"", address, "\" is neither unix:PATH nor HOST:PORT"));
}

grpc::ChannelArguments channel_arguments(const std::string& address, const ConnectOptions& options) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetMaxSendMessageSize(-1);
  // Without keepalive a server that was stopped or cut off costs each call its whole deadline.
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 20000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10000);
  // A server that starts again is found within a second.
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1000);
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  // Engines do not share connections, whatever process-wide state they would come from.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  // Estimating the bandwidth helps over distance and over Unix sockets; on loopback TCP its pings only cost.
  if (is_loopback(address)) arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  if (!options.tls_name.empty()) arguments.SetSslTargetNameOverride(options.tls_name);
  return arguments;
}

absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> credentials_for(const std::string& address,
                                                                          const ConnectOptions& options) {
  if (options.tls_certificate.empty() != options.tls_key.empty())
    return absl::InvalidArgumentError("tls_certificate, tls_key: only one of them is given");
  if (options.tls_ca.empty()) {
    if (!options.tls_certificate.empty()) return absl::InvalidArgumentError("tls_ca: needed with tls_certificate");
    if (!options.tls_name.empty()) return absl::InvalidArgumentError("tls_ca: needed with tls_name");
  }
  if (is_unix(address) || options.tls_ca.empty()) return grpc::InsecureChannelCredentials();
  grpc::SslCredentialsOptions tls;
  for (const auto& [file, text] :
       {std::pair{&options.tls_ca, &tls.pem_root_certs}, std::pair{&options.tls_certificate, &tls.pem_cert_chain},
        std::pair{&options.tls_key, &tls.pem_private_key}}) {
    if (file->empty()) continue;
    auto read = wire::read_text_file(*file);
    if (!read.ok()) return read.status();
    *text = *std::move(read);
  }
  return grpc::SslCredentials(tls);
}

}  // namespace

absl::StatusOr<Channel> open_channel(const std::string& address, const ConnectOptions& options) {
  if (auto status = check_address(address); !status.ok()) return status;
  auto credentials = credentials_for(address, options);
  if (!credentials.ok()) return credentials.status();
  Channel opened{.address = address, .channel = {}, .authorization = {}};
  if (!options.token_file.empty()) {
    if (options.tls_ca.empty() && !is_unix(address) && !is_loopback(address))
      return absl::InvalidArgumentError(absl::StrCat(
          "token_file: ", address, " is reached without TLS, where others may read the token: give tls_ca"));
    auto token = read_token(options.token_file);
    if (!token.ok()) return token.status();
    opened.authorization = absl::StrCat("Bearer ", *token);
  }
  wire::keep_grpc();
  opened.channel = grpc::CreateCustomChannel(address, *credentials, channel_arguments(address, options));
  opened.channel->GetState(true);  // begins to connect
  return opened;
}

grpc::Status ask_info(const Channel& channel, std::chrono::system_clock::time_point until, bool waits,
                      v1::InfoResponse& info) {
  grpc::ClientContext context;
  channel.authorise(context);
  context.set_deadline(until);
  context.set_wait_for_ready(waits);
  return v1::Sampler::NewStub(channel.channel)->Info(&context, {}, &info);
}

}  // namespace facetwise
