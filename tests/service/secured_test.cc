// SPDX-License-Identifier: Apache-2.0
// TLS, clients' certificates and tokens: who is answered, and who is not. Certificates are made here, by openssl.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "calls.h"
#include "facetwise/channel.h"
#include "facetwise/client.h"
#include "gtest/gtest.h"
#include "server_process.h"

namespace facetwise {
namespace {

using testing::ServerProcess;

void write(const std::string& path, const std::string& text) { std::ofstream(path) << text; }

// An authority and what it signs, in a folder.
class Authority {
 public:
  Authority(const testing::TemporaryFolder& folder, std::string name) : folder_(folder), name_(std::move(name)) {
    openssl("req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=" + name_ +
            " -keyout " + file("key") + " -out " + file("pem"));
  }
  std::string pem() const { return file("pem"); }

  struct Signed {
    std::string certificate, key;
  };
  // For `host`; expired if `days` is 0.
  Signed sign(const std::string& name, const std::string& host, int days = 2) const {
    const std::string base = folder_.path(name);
    openssl("req -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -subj /CN=" + name + " -keyout " + base +
            ".key -out " + base + ".csr");
    write(base + ".ext", "subjectAltName=" + host + "\n");
    openssl("x509 -req -in " + base + ".csr -CA " + file("pem") + " -CAkey " + file("key") + " -CAcreateserial -days " +
            std::to_string(days) + " -extfile " + base + ".ext -out " + base + ".pem");
    if (days == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1100));
    return {base + ".pem", base + ".key"};
  }

 private:
  std::string file(const std::string& extension) const { return folder_.path(name_ + "." + extension); }
  static void openssl(const std::string& arguments) {
    const std::string command = "openssl " + arguments + " >/dev/null 2>&1";
    if (std::system(command.c_str()) != 0) throw std::runtime_error("failed: " + command);
  }

  const testing::TemporaryFolder& folder_;
  const std::string name_;
};

constexpr const char* kLoopback = "IP:127.0.0.1";
constexpr std::chrono::milliseconds kPatience{1500};

// One lane through an engine that is connected so: OK, or why not.
absl::Status call(const std::string& address, ConnectOptions options) {
  options.connect_timeout = kPatience;
  const auto engine = connect(std::span(&address, 1), options);
  if (!engine.ok()) return engine.status();
  const auto weight = testing::sample_one(**engine);
  EXPECT_TRUE(!weight.ok() || (*weight > 0.5f && *weight <= 1));
  return weight.status();
}
// Until it is so, for a while: files are read again within a second.
template <class Condition>
bool becomes(const Condition& condition) {
  for (int n = 0; n < 60; ++n) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return false;
}

class Secured : public ::testing::Test {
 protected:
  std::vector<std::string> with(const Authority::Signed& own, std::vector<std::string> more = {}) const {
    std::vector<std::string> all = {"--listen",      "127.0.0.1:0", "--tls-certificate",
                                    own.certificate, "--tls-key",   own.key};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  std::string refusal(const std::vector<std::string>& arguments) {
    ServerProcess server(arguments);
    EXPECT_FALSE(server.ready());
    server.wait();
    return server.errors();
  }

  testing::TemporaryFolder folder_;
  const Authority ours_{folder_, "ours"}, foreign_{folder_, "foreign"};
};

TEST_F(Secured, ClientsTrustTheAuthorityTheyAreGiven) {
  ServerProcess server(with(ours_.sign("server", kLoopback)));
  ASSERT_TRUE(server.ready()) << server.errors();
  const std::string address = server.addresses()[0];
  EXPECT_TRUE(call(address, {.tls_ca = ours_.pem()}).ok()) << call(address, {.tls_ca = ours_.pem()});

  const auto distrusted = call(address, {.tls_ca = foreign_.pem()});
  EXPECT_EQ(distrusted.code(), absl::StatusCode::kUnavailable) << distrusted;
  EXPECT_NE(distrusted.message().find("andshake"), std::string::npos) << distrusted;
  EXPECT_EQ(call(address, {}).code(), absl::StatusCode::kUnavailable);  // without TLS

  // Another name than the certificate's.
  EXPECT_EQ(call(address, {.tls_ca = ours_.pem(), .tls_name = "elsewhere.example"}).code(),
            absl::StatusCode::kUnavailable);
}

TEST_F(Secured, ANameMayStandForTheHost) {
  ServerProcess server(with(ours_.sign("server", "DNS:renderer.example")));
  ASSERT_TRUE(server.ready()) << server.errors();
  EXPECT_EQ(call(server.addresses()[0], {.tls_ca = ours_.pem()}).code(), absl::StatusCode::kUnavailable);
  EXPECT_TRUE(call(server.addresses()[0], {.tls_ca = ours_.pem(), .tls_name = "renderer.example"}).ok());
}

TEST_F(Secured, ExpiredCertificatesAreRefused) {
  ServerProcess server(with(ours_.sign("server", kLoopback, 0)));
  ASSERT_TRUE(server.ready()) << server.errors();
  const auto status = call(server.addresses()[0], {.tls_ca = ours_.pem()});
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable) << status;
}

TEST_F(Secured, ClientsShowTheirCertificates) {
  ServerProcess server(with(ours_.sign("server", kLoopback), {"--tls-client-ca", ours_.pem()}));
  ASSERT_TRUE(server.ready()) << server.errors();
  const std::string address = server.addresses()[0];
  const auto as = [&](const Authority::Signed& own) {
    return call(address, {.tls_ca = ours_.pem(), .tls_certificate = own.certificate, .tls_key = own.key});
  };
  EXPECT_TRUE(as(ours_.sign("client", "DNS:client")).ok());
  EXPECT_EQ(call(address, {.tls_ca = ours_.pem()}).code(), absl::StatusCode::kUnavailable);  // none
  EXPECT_EQ(as(foreign_.sign("stranger", "DNS:client")).code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(as(ours_.sign("late", "DNS:client", 0)).code(), absl::StatusCode::kUnavailable);
}

TEST_F(Secured, CertificatesAreReadAgain) {
  const auto first = ours_.sign("server", kLoopback);
  ServerProcess server(with(first));
  ASSERT_TRUE(server.ready()) << server.errors();
  const std::string address = server.addresses()[0];
  ASSERT_TRUE(call(address, {.tls_ca = ours_.pem()}).ok());
  const auto next = foreign_.sign("next", kLoopback);
  std::filesystem::rename(next.key, first.key);
  std::filesystem::rename(next.certificate, first.certificate);
  EXPECT_TRUE(becomes([&] { return call(address, {.tls_ca = foreign_.pem()}).ok(); }));
  EXPECT_FALSE(call(address, {.tls_ca = ours_.pem()}).ok());
}

TEST_F(Secured, CallsCarryATokenOfTheFile) {
  const std::string tokens = folder_.path("tokens"), right = folder_.path("right"), wrong = folder_.path("wrong");
  write(tokens, "# of the renderers\nfirst-token-0123456789\n\n  second-token-012345678 \n");
  write(right, "second-token-012345678\n");
  write(wrong, "second-token-012345679\n");
  const std::string unix_address = "unix:" + folder_.path("s");
  ServerProcess server(with(ours_.sign("server", kLoopback),
                            {"--listen", unix_address, "--token-file", tokens, "--allow-benchmark", "--log"}));
  ASSERT_TRUE(server.ready()) << server.errors();
  for (const std::string& address : server.addresses()) {
    EXPECT_TRUE(call(address, {.tls_ca = ours_.pem(), .token_file = right}).ok()) << address;
    EXPECT_EQ(call(address, {.tls_ca = ours_.pem(), .token_file = wrong}).code(), absl::StatusCode::kUnauthenticated);
    EXPECT_EQ(call(address, {.tls_ca = ours_.pem()}).code(), absl::StatusCode::kUnauthenticated);
  }

  // Every method asks for it, and answers with nothing else.
  const auto channel = open_channel(unix_address, {});
  ASSERT_TRUE(channel.ok());
  const auto stub = v1::Sampler::NewStub(channel->channel);
  for (const char* value : {"", "Bearer", "Bearer ", "second-token-012345678", "Bearer second-token-012345678x",
                            "bearer second-token-012345678", "Basic second-token-012345678"}) {
    const auto carries = [&](grpc::ClientContext& context) {
      if (*value != 0) context.AddMetadata("authorization", value);
    };
    {
      grpc::ClientContext context;
      carries(context);
      v1::BatchResponse response;
      EXPECT_EQ(stub->Run(&context, testing::good_request(1), &response).error_code(),
                grpc::StatusCode::UNAUTHENTICATED)
          << value;
      EXPECT_EQ(response.ByteSizeLong(), 0u);
    }
    {
      grpc::ClientContext context;
      carries(context);
      v1::CompactResponse response;
      EXPECT_EQ(stub->Compact(&context, {}, &response).error_code(), grpc::StatusCode::UNAUTHENTICATED) << value;
    }
    {
      grpc::ClientContext context;
      carries(context);
      const auto stream = stub->RunStream(&context);
      v1::BatchResponse response;
      stream->Write(testing::good_request(1));
      EXPECT_FALSE(stream->Read(&response));
      EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::UNAUTHENTICATED) << value;
    }
    {
      grpc::ClientContext context;
      carries(context);
      const auto reader = stub->Benchmark(&context, {});
      v1::BenchmarkProgress progress;
      EXPECT_FALSE(reader->Read(&progress));
      EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::UNAUTHENTICATED) << value;
    }
    {
      grpc::ClientContext upload, list, remove;
      for (auto* context : {&upload, &list, &remove}) carries(*context);
      v1::SlopeTableInfo info;
      v1::ListTablesResponse tables;
      v1::DeleteTableResponse deleted;
      EXPECT_EQ(stub->UploadTable(&upload, &info)->Finish().error_code(), grpc::StatusCode::UNAUTHENTICATED) << value;
      EXPECT_EQ(stub->ListTables(&list, {}, &tables).error_code(), grpc::StatusCode::UNAUTHENTICATED) << value;
      EXPECT_EQ(stub->DeleteTable(&remove, {}, &deleted).error_code(), grpc::StatusCode::UNAUTHENTICATED) << value;
    }
  }

  // The file is read again; one that cannot be used changes nothing.
  const std::string later = folder_.path("later");
  write(later, "second-token-012345679\n");
  std::filesystem::rename(later, tokens);
  EXPECT_TRUE(becomes([&] { return call(unix_address, {.token_file = wrong}).ok(); }));
  EXPECT_EQ(call(unix_address, {.token_file = right}).code(), absl::StatusCode::kUnauthenticated);
  write(later, "short\n");
  std::filesystem::rename(later, tokens);
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  EXPECT_TRUE(call(unix_address, {.token_file = wrong}).ok());
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(), 0);
  EXPECT_NE(server.errors().find("tokens stay as they were"), std::string::npos) << server.errors();
}

TEST_F(Secured, FilesThatCannotBeUsedAreNamed) {
  const auto own = ours_.sign("server", kLoopback), other = ours_.sign("other", kLoopback);
  const auto names = [](const std::string& error, const std::string& name) {
    EXPECT_NE(error.find(name), std::string::npos) << error;
  };
  names(refusal(with({folder_.path("none.pem"), own.key})), "none.pem");
  names(refusal(with({own.key, own.key})), "tls_certificate: " + own.key);
  names(refusal(with({own.certificate, other.key})), "tls_key: " + other.key);
  names(refusal(with(own, {"--tls-client-ca", own.key})), "tls_client_ca: " + own.key);
  names(refusal({"--listen", "127.0.0.1:0", "--tls-key", own.key}), "tls_certificate, tls_key");
  names(refusal({"--listen", "127.0.0.1:0", "--tls-client-ca", own.key}), "tls_client_ca");
  names(refusal(with(own, {"--token-file", folder_.path("none")})), "token_file: " + folder_.path("none"));
  write(folder_.path("short"), "0123456789abcdef\nshort\n");
  names(refusal(with(own, {"--token-file", folder_.path("short")})), "line 2");
  write(folder_.path("empty"), "# nothing\n");
  names(refusal(with(own, {"--token-file", folder_.path("empty")})), "no token");

  // Clients.
  const std::string address = "unix:" + folder_.path("nobody");
  EXPECT_EQ(call(address, {.token_file = folder_.path("none")}).code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(call("127.0.0.1:1", {.tls_ca = folder_.path("none")}).code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(call("127.0.0.1:1", {.tls_ca = ours_.pem(), .tls_key = own.key}).code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(call("127.0.0.1:1", {.tls_name = "x"}).code(), absl::StatusCode::kInvalidArgument);
  // A token does not cross a network in the clear.
  write(folder_.path("token"), "0123456789abcdef\n");
  const auto clear = call("192.0.2.1:7777", {.token_file = folder_.path("token")});
  EXPECT_EQ(clear.code(), absl::StatusCode::kInvalidArgument) << clear;
  names(std::string(clear.message()), "tls_ca");
}

// With a certificate no --insecure is needed, without one it is.
TEST_F(Secured, OtherMachinesNeedACertificate) {
  EXPECT_NE(refusal({"--listen", "0.0.0.0:0"}).find("--tls-certificate"), std::string::npos);
  std::vector<std::string> everywhere = with(ours_.sign("server", kLoopback));
  everywhere[1] = "0.0.0.0:0";
  ServerProcess server(everywhere);
  ASSERT_TRUE(server.ready()) << server.errors();
  const std::string port = server.addresses()[0].substr(server.addresses()[0].rfind(':'));
  EXPECT_TRUE(call("127.0.0.1" + port, {.tls_ca = ours_.pem()}).ok());
}

}  // namespace
}  // namespace facetwise
