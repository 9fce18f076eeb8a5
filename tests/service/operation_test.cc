// SPDX-License-Identifier: Apache-2.0
// What those see who look after a server: counts and load for Prometheus, logs, and who may connect to a Unix socket.
#include <arpa/inet.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "calls.h"
#include "facetwise/client.h"
#include "gtest/gtest.h"
#include "server_process.h"

namespace facetwise {
namespace {

using grpc::StatusCode;
using testing::good_request;
using testing::open_channel;
using testing::sample_one;
using testing::ServerProcess;
using Json = nlohmann::json;

// The body of http://IP:PORT/metrics.
std::string fetch(const std::string& address) {
  const auto colon = address.rfind(':');
  sockaddr_in where = {};
  where.sin_family = AF_INET;
  where.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(colon + 1))));
  inet_pton(AF_INET, address.substr(0, colon).c_str(), &where.sin_addr);
  const int file = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  std::string text;
  if (connect(file, reinterpret_cast<const sockaddr*>(&where), sizeof where) == 0) {
    const std::string request = "GET /metrics HTTP/1.0\r\n\r\n";
    if (send(file, request.data(), request.size(), MSG_NOSIGNAL) > 0)
      for (char bytes[4096]; const ssize_t count = read(file, bytes, sizeof bytes);) {
        if (count < 0) break;
        text.append(bytes, count);
      }
  }
  close(file);
  const auto body = text.find("\r\n\r\n");
  return text.starts_with("HTTP/1.1 200") && body != std::string::npos ? text.substr(body + 4) : "";
}

// By name and labels, as in: facetwise_calls_total{code="OK",method="Run"}
std::map<std::string, double> metrics_of(const std::string& address) {
  std::map<std::string, double> metrics;
  std::istringstream lines(fetch(address));
  for (std::string line; std::getline(lines, line);)
    if (const auto space = line.rfind(' '); !line.starts_with('#') && space != std::string::npos)
      metrics[line.substr(0, space)] = std::stod(line.substr(space + 1));
  return metrics;
}

class Operation : public ::testing::Test {
 protected:
  std::string unix_address() const { return "unix:" + folder_.path("s"); }
  grpc::Status run(const v1::BatchRequest& request, const std::map<std::string, std::string>& metadata = {},
                   std::string* request_id = nullptr) {
    const auto stub = v1::Sampler::NewStub(open_channel(unix_address()));
    grpc::ClientContext context;
    for (const auto& [name, value] : metadata) context.AddMetadata(name, value);
    v1::BatchResponse response;
    const grpc::Status status = stub->Run(&context, request, &response);
    const auto& trailer = context.GetServerTrailingMetadata();
    if (const auto id = trailer.find("x-request-id"); request_id != nullptr && id != trailer.end())
      *request_id = std::string(id->second.data(), id->second.size());
    return status;
  }

  testing::TemporaryFolder folder_;
};

v1::BatchRequest bad_request() {
  v1::BatchRequest request = good_request(10);
  request.set_lanes(11);
  return request;
}

TEST_F(Operation, MetricsCountCallsAndLanes) {
  const ServerProcess server({"--listen", unix_address(), "--metrics", "127.0.0.1:0", "--max-calls", "7"});
  ASSERT_EQ(server.addresses().size(), 2u);
  const std::string& address = server.addresses()[1];
  for (int n = 0; n < 3; ++n) ASSERT_TRUE(run(good_request(1000)).ok());
  v1::BatchRequest mirrors = good_request(5);
  mirrors.set_alpha_x(testing::floats(1, 0));
  mirrors.set_alpha_y(testing::floats(1, 0));
  ASSERT_TRUE(run(mirrors).ok());
  ASSERT_EQ(run(bad_request()).error_code(), StatusCode::INVALID_ARGUMENT);

  const auto metrics = metrics_of(address);
  const auto value = [&](const std::string& name) {
    const auto found = metrics.find(name);
    return found == metrics.end() ? -1 : found->second;
  };
  EXPECT_EQ(value(R"(facetwise_calls_total{code="OK",method="Run"})"), 4);
  EXPECT_EQ(value(R"(facetwise_calls_total{code="INVALID_ARGUMENT",method="Run"})"), 1);
  const auto lanes = [&](const std::string& status) {
    return value(R"(facetwise_lanes_total{distribution="ggx",masking="smith",operation="sample_reflection",sampler=")"
                 R"(exact",status=")" +
                 status + "\"}");
  };
  EXPECT_EQ(lanes("accepted"), 3000);
  EXPECT_EQ(lanes("smooth"), 5);
  EXPECT_EQ(lanes("occluded"), -1);  // none yet
  EXPECT_EQ(value(R"(facetwise_answer_seconds_count{method="Run"})"), 4);
  EXPECT_GT(value(R"(facetwise_answer_seconds_sum{method="Run"})"), 0);
  EXPECT_GT(value(R"(facetwise_message_bytes_total{method="Run",way="received"})"), 3 * 8 * 4000);
  EXPECT_GT(value(R"(facetwise_message_bytes_total{method="Run",way="sent"})"), 3 * 9 * 4000);
  EXPECT_EQ(value("facetwise_calls_working_limit"), 7);
  EXPECT_EQ(value("facetwise_calls_open"), 0);
  EXPECT_EQ(value("facetwise_held_bytes"), 0);
  EXPECT_GT(value("facetwise_held_bytes_limit"), 1e9);
}

TEST_F(Operation, TheDashboardAsksForWhatIsThere) {
  const ServerProcess server({"--listen", unix_address(), "--metrics", "127.0.0.1:0"});
  ASSERT_EQ(server.addresses().size(), 2u);
  ASSERT_TRUE(run(good_request(1)).ok());
  const std::string there = fetch(server.addresses()[1]);
  std::ifstream file(FACETWISE_DASHBOARD);
  const Json dashboard = Json::parse(file);
  std::set<std::string> names;
  for (const Json& panel : dashboard.at("panels"))
    for (const Json& target : panel.at("targets")) {
      const std::string query = target.at("expr");
      static const std::regex kName("facetwise_[a-z_]+");
      for (std::sregex_iterator name(query.begin(), query.end(), kName); name != std::sregex_iterator(); ++name)
        names.insert(name->str());
    }
  EXPECT_GE(names.size(), 10u);
  for (const std::string& name : names)
    EXPECT_TRUE(there.find("\n" + name + "{") != std::string::npos ||
                there.find("\n" + name + " ") != std::string::npos)
        << name;
}

TEST_F(Operation, MetricsAreForThisMachineUnlessSaidAloud) {
  const auto error = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--listen", unix_address()});
    ServerProcess server(arguments);
    if (server.ready()) server.signal(SIGTERM);
    return std::pair(server.wait(), server.errors());
  };
  EXPECT_NE(error({"--metrics", "0.0.0.0:0"}).second.find("is open to the network"), std::string::npos);
  EXPECT_NE(error({"--metrics", "unix:/tmp/x"}).second.find("not IP:PORT"), std::string::npos);
  EXPECT_EQ(error({"--metrics", "0.0.0.0:0", "--insecure"}).first, 0);
  const ServerProcess other({"--listen", "127.0.0.1:0"});
  const auto [code, text] = error({"--metrics", other.addresses().at(0)});
  EXPECT_EQ(code, 1);
  EXPECT_NE(text.find("metrics: " + other.addresses()[0] + ": cannot listen there"), std::string::npos) << text;
}

TEST_F(Operation, LogsTellOfEachCallWithItsId) {
  ServerProcess server({"--listen", unix_address(), "--log"});
  ASSERT_TRUE(server.ready());
  const std::string trace = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";
  ASSERT_TRUE(run(good_request(100), {{"x-request-id", "frame-7"}, {"traceparent", trace}}).ok());
  std::string failed_id, long_id;
  ASSERT_FALSE(run(bad_request(), {}, &failed_id).ok());
  ASSERT_FALSE(run(bad_request(), {{"x-request-id", std::string(65, 'x')}}, &long_id).ok());
  // The library's own client.
  ConnectOptions options;
  options.traceparent = [] { return "00-11111111111111111111111111111111-2222222222222222-01"; };
  const std::string address = unix_address();
  const auto engine = connect(std::span(&address, 1), options);
  ASSERT_TRUE(engine.ok());
  ASSERT_TRUE(sample_one(**engine).ok());
  server.signal(SIGTERM);
  ASSERT_EQ(server.wait(), 0);

  std::vector<Json> calls;
  std::vector<std::string> events;
  std::istringstream lines(server.errors());
  for (std::string line; std::getline(lines, line);) {
    const Json event = Json::parse(line, nullptr, false);
    ASSERT_TRUE(event.is_object()) << line;
    EXPECT_EQ(event.at("time").get<std::string>().size(), 24u);
    if (event.at("event") == "call")
      calls.push_back(event);
    else
      events.push_back(event.at("event"));
  }
  EXPECT_EQ(events, (std::vector<std::string>{"serves", "drains", "ended"}));
  ASSERT_EQ(calls.size(), 5u);  // the fourth: the engine's Info
  EXPECT_EQ(calls[0].at("request_id"), "frame-7");
  EXPECT_EQ(calls[0].at("traceparent"), trace);
  EXPECT_EQ(calls[0].at("lanes"), 100);
  EXPECT_EQ(calls[0].at("sampler"), "exact");
  EXPECT_EQ(calls[0].at("level"), "debug");
  EXPECT_GT(calls[0].at("ms"), 0);
  EXPECT_EQ(calls[1].at("code"), "INVALID_ARGUMENT");
  EXPECT_EQ(calls[1].at("level"), "info");
  EXPECT_EQ(calls[1].at("request_id"), failed_id);
  EXPECT_NE(calls[1].at("message").get<std::string>().find("11 lanes"), std::string::npos);
  EXPECT_EQ(calls[2].at("request_id"), long_id);
  EXPECT_NE(long_id, failed_id);
  EXPECT_LT(long_id.size(), 64u);
  EXPECT_EQ(calls[3].at("method"), "Info");
  EXPECT_EQ(calls[4].at("traceparent"), options.traceparent());
}

TEST_F(Operation, ClientsErrorsNameTheRequest) {
  ServerProcess server({"--listen", unix_address(), "--log", "--max-open-calls", "1", "--patience-ms", "60000",
                        "--metrics", "127.0.0.1:0"});
  ASSERT_EQ(server.addresses().size(), 2u);
  ConnectOptions options;
  options.connect_timeout = std::chrono::milliseconds(500);
  const std::string address = unix_address();
  const auto engine = connect(std::span(&address, 1), options);
  ASSERT_TRUE(engine.ok()) << engine.status();
  {
    testing::SilentCalls only(open_channel(address));
    only.begin("/facetwise.v1.Sampler/Run");
    // It has begun here; now also there.
    for (int n = 0; n < 500 && metrics_of(server.addresses()[1])["facetwise_calls_open"] != 1; ++n) usleep(10000);
    const absl::Status status = sample_one(**engine).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
    const std::string text(status.message());
    const auto at = text.find(" (request ");
    ASSERT_NE(at, std::string::npos) << text;
    server.signal(SIGKILL);
    server.wait();
    const std::string id = text.substr(at + 10, text.size() - at - 11);
    EXPECT_NE(server.errors().find("\"request_id\":\"" + id + "\""), std::string::npos) << id << server.errors();
  }
}

// Whoever reads the log, or does not, no call waits for it.
TEST_F(Operation, LogsHoldUpNoCall) {
  for (const char* errors : {"", "/dev/full"}) {
    ServerProcess server({"--listen", unix_address(), "--log"}, errors);
    ASSERT_TRUE(server.ready());
    const auto stub = v1::Sampler::NewStub(open_channel(unix_address()));
    for (int n = 0; n < 1000; ++n) {  // some 300 bytes each: more than a pipe holds
      grpc::ClientContext context;
      v1::BatchResponse response;
      ASSERT_TRUE(stub->Run(&context, good_request(1), &response).ok()) << n;
    }
    server.signal(SIGTERM);
    EXPECT_EQ(server.wait(), 0);
  }
}

TEST_F(Operation, OnlyUsersThatAreNamedConnect) {
  const std::string me = std::to_string(geteuid()), other = std::to_string(geteuid() + 1);
  {
    const ServerProcess server({"--listen", unix_address(), "--unix-user", other, "--unix-user", me});
    EXPECT_TRUE(run(good_request(1)).ok());
  }
  ServerProcess server({"--listen", unix_address(), "--unix-user", other, "--log"});
  ASSERT_TRUE(server.ready());
  EXPECT_EQ(run(good_request(1)).error_code(), StatusCode::UNAVAILABLE);
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(), 0);
  EXPECT_NE(server.errors().find("\"event\":\"connection refused\",\"user\":" + me), std::string::npos)
      << server.errors();
}

TEST_F(Operation, InfoTellsModelsLimitsAndLoad) {
  const ServerProcess server({"--listen", unix_address(), "--max-calls", "9", "--max-open-calls", "99"});
  ASSERT_TRUE(run(good_request(123)).ok());
  const auto stub = v1::Sampler::NewStub(open_channel(unix_address()));
  grpc::ClientContext context;
  v1::InfoResponse info;
  ASSERT_TRUE(stub->Info(&context, {}, &info).ok());
  EXPECT_EQ(info.limits().calls(), 9u);
  EXPECT_EQ(info.limits().open_calls(), 99u);
  EXPECT_EQ(info.limits().lanes(), info.max_message_bytes() / 4);
  EXPECT_EQ(info.load().lanes(), 123u);
  EXPECT_EQ(info.load().open_calls(), 1u);  // this one
  EXPECT_GE(info.load().connections(), 1u);
  EXPECT_GT(info.load().uptime_seconds(), 0);
  std::map<std::pair<int, int>, std::vector<int>> samplers;
  for (const v1::ModelInfo& model : info.models())
    samplers[{model.distribution(), model.masking()}].assign(model.samplers().begin(), model.samplers().end());
  EXPECT_EQ(samplers.size(), 9u);  // five distributions, two maskings, but for Phong with Smith
  EXPECT_FALSE((samplers.contains({v1::PHONG, v1::SMITH})));
  const auto& ggx = samplers[{v1::GGX, v1::SMITH}];
  for (const int sampler : {v1::NDF, v1::HEITZ, v1::CAP, v1::BOUNDED, v1::EXACT})
    EXPECT_EQ(std::count(ggx.begin(), ggx.end(), sampler), 1) << sampler;
  for (const auto& [model, its] : samplers) EXPECT_FALSE(its.empty()) << model.first << ' ' << model.second;
}

}  // namespace
}  // namespace facetwise
