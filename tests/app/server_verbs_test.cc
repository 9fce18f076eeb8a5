// SPDX-License-Identifier: Apache-2.0
// serve, info, verify and help, as processes.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "facetwise/engine.h"
#include "tests/app/command.h"

namespace facetwise::test {
namespace {

TEST(Help, EveryVerbExplainsItselfWithAnExample) {
  const auto all = facetwise({"--help"});
  ASSERT_EQ(all.code, 0);
  for (const std::string verb :
       {"sample", "pdf", "evaluate", "serve", "verify", "prove", "bench", "summary", "info", "load", "transport"}) {
    EXPECT_NE(all.out.find("\n  " + verb + " "), std::string::npos) << verb;
    const auto help = facetwise({verb, "--help"});
    EXPECT_EQ(help.code, 0);
    EXPECT_NE(help.out.find("\nExample"), std::string::npos) << verb;
    EXPECT_NE(help.out.find("\n  facetwise " + verb), std::string::npos) << verb;
  }
}

TEST(Version, IsTheLibrarys) {
  const auto result = facetwise({"--version"});
  EXPECT_EQ(result.code, 0);
  EXPECT_EQ(result.out, std::string(version()) + "\n");
}

TEST(Info, TellsTheTargetThatRuns) {
  const auto result = facetwise({"info", "--json"});
  ASSERT_EQ(result.code, 0) << result.err;
  const auto info = nlohmann::json::parse(result.out);
  EXPECT_EQ(info["version"], version());
  EXPECT_EQ(info["target"], name(available_targets().front()));
  EXPECT_EQ(info["available_targets"].size(), available_targets().size());
  EXPECT_EQ(info["vector_lanes"], vector_lanes(available_targets().front()));
  EXPECT_GE(info["cores"], 1);
  EXPECT_GT(info["memory_bytes"], 1 << 20);
  const auto text = facetwise({"info"});
  EXPECT_NE(text.out.find(info["cpu"].get<std::string>()), std::string::npos);
}

TEST(Serve, AnswersInfoWithItsOptionsAndDrainsOnSigterm) {
  const Directory directory;
  Server server(directory, "s.sock", {"--threads", "1", "--max-message-mib", "3", "--target", "scalar"});
  const auto result = facetwise({"info", "--json", "--remote", server.address()});
  ASSERT_EQ(result.code, 0) << result.err;
  const auto info = nlohmann::json::parse(result.out);
  EXPECT_EQ(info["version"], version());
  EXPECT_EQ(info["target"], "scalar");
  EXPECT_EQ(info["threads"], 1);
  EXPECT_EQ(info["max_message_bytes"], 3 << 20);
  EXPECT_EQ(info["benchmark_allowed"], false);
  EXPECT_EQ(server.stop(), 0);
  const auto gone = facetwise({"info", "--remote", server.address()});
  EXPECT_EQ(gone.code, 1);
  EXPECT_NE(gone.err.find("server " + server.address()), std::string::npos) << gone.err;
}

TEST(Serve, ListensOnSeveralAddressesAndPrintsThem) {
  const Directory directory;
  Server server(directory, "s.sock", {"--listen", "127.0.0.1:0"});
  const std::string out = read_file(directory.path("s.sock.out"));
  const auto begin = out.find("127.0.0.1:");
  ASSERT_NE(begin, std::string::npos) << out;
  const std::string address = out.substr(begin, out.find(' ', begin) - begin);
  const auto result = facetwise({"info", "--remote", address});
  EXPECT_EQ(result.code, 0) << result.err;
}

TEST(Serve, SaysWhatItCannotDo) {
  const auto expect = [](const std::vector<std::string>& arguments, int code, const std::string& message) {
    const auto result = facetwise(arguments);
    EXPECT_EQ(result.code, code);
    EXPECT_NE(result.err.find(message), std::string::npos) << result.err;
  };
  const Directory directory;
  const Server server(directory, "s.sock");
  expect({"serve", "--listen", server.address()}, 1, directory.path("s.sock"));
  expect({"serve", "--listen", "nowhere"}, 1, "nowhere");
  expect({"serve", "--listen", "unix:" + directory.path("t.sock"), "--unix-mode", "8"}, 2, "\"8\" is not a mode");
  expect({"serve", "--listen", "unix:" + directory.path("t.sock"), "--threads", "0"}, 2, "--threads");
}

TEST(VerifyVerb, ComparesWithAServer) {
  const Directory directory;
  const Server server(directory, "s.sock", {"--target", "scalar"});
  const std::string path = directory.path("verify.json");
  const auto result = facetwise({"verify", "--remote", server.address(), "--lanes", "30000", "--json", path});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_NE(result.out.find("121496 triangles"), std::string::npos) << result.out;
  const auto json = nlohmann::json::parse(read_file(path));
  EXPECT_EQ(json["equal"], true);
  EXPECT_EQ(json["triangles"], 121496);
  EXPECT_EQ(json["lanes"], json["batches"].size() * 30000);
  EXPECT_GE(json["hits"].get<double>(), 0.5 * json["rays"].get<double>());
  const double backfacing = json["backfacing"].get<double>() / json["lanes"].get<double>();
  EXPECT_GT(backfacing, 0.02);
  EXPECT_LT(backfacing, 0.30);
  ASSERT_GT(json["batches"].size(), 100u);
  ASSERT_GE(json["reflections"].size(), 5u);
  // GGX first, in the samplers' order, from the most rejections to none.
  std::vector<std::uint64_t> occluded;
  for (const auto& sampler : json["reflections"]) occluded.push_back(sampler["occluded"]);
  EXPECT_GT(occluded[0], occluded[1]);  // ndf, heitz
  EXPECT_GT(occluded[2], occluded[3]);  // cap, bounded
  EXPECT_GT(occluded[3], 0u);
  EXPECT_EQ(occluded[4], 0u);  // exact
}

TEST(VerifyVerb, NamesAMissingMesh) {
  const auto result = facetwise({"verify", "--remote", "unix:/none", "--mesh", "/none.obj"});
  EXPECT_EQ(result.code, 1);
  EXPECT_NE(result.err.find("/none.obj: "), std::string::npos) << result.err;
}

// Every call that was due is counted, the percentiles and the histogram are of them.
TEST(Load, CountsEveryCall) {
  const Directory directory;
  Server server(directory);
  const std::vector<std::string> arguments = {"load",   "--remote", server.address(), "--lanes", "100",
                                              "--rate", "200",      "--seconds",      "0.5"};
  const auto text = facetwise(arguments);
  ASSERT_EQ(text.code, 0) << text.err;
  EXPECT_NE(text.out.find("100 calls of 100 lanes"), std::string::npos) << text.out;
  auto with_json = arguments;
  with_json.insert(with_json.end(), {"--json", "--beside", "1", "--beside-lanes", "50000"});
  const auto result = facetwise(with_json);
  ASSERT_EQ(result.code, 0) << result.err;
  const auto load = nlohmann::json::parse(result.out);
  EXPECT_EQ(load["calls"], 100);
  EXPECT_EQ(load["failed"], 0);
  EXPECT_GE(load["seconds"], 0.49);  // the last was due then
  EXPECT_GT(load["beside"]["lanes_per_second"], 0);
  double before = 0;
  for (const char* name : {"p50", "p90", "p99", "p99.9", "max"}) {
    EXPECT_GE(load["microseconds"][name], before);
    before = load["microseconds"][name];
  }
  EXPECT_GT(before, 0);
  std::size_t calls = 0;
  for (const auto& bar : load["histogram"]) calls += bar["calls"].get<std::size_t>();
  EXPECT_EQ(calls, 100u);
  EXPECT_LE(load["histogram"].front()["from"], load["microseconds"]["p50"]);
  EXPECT_GT(load["histogram"].back()["to"], load["microseconds"]["max"]);
  EXPECT_EQ(server.stop(), 0);
  EXPECT_EQ(facetwise(arguments).code, 1) << "nobody there";
}

// Options of a server come from its command line, else from the environment, else from a file.
TEST(Transport, MeasuresEveryWay) {
  const auto result = facetwise({"transport", "--seconds", "0.002", "--json"});
  ASSERT_EQ(result.code, 0) << result.err;
  const nlohmann::json report = nlohmann::json::parse(result.out);
  ASSERT_EQ(report["rates"].size(), 8u);  // two transports, calls and streams, two sizes
  for (const auto& rate : report["rates"]) {
    EXPECT_GT(rate["echo_mlanes"], 0);
    EXPECT_GT(rate["facetwise_mlanes"], 0);
    EXPECT_GT(rate["ratio"], 0);
  }
  ASSERT_EQ(report["delays"].size(), 2u);
  for (const auto& delay : report["delays"]) EXPECT_LE(delay["facetwise_p50"], delay["facetwise_p99"]);
  std::set<std::string> ways;
  for (const auto& cost : report["costs"]) {
    EXPECT_GT(cost["nanoseconds"], 0);
    ways.insert(cost["way"]);
  }
  EXPECT_EQ(ways.size(), 9u);
  EXPECT_TRUE(ways.contains("shared memory"));
  EXPECT_EQ(facetwise({"transport", "--tls-ca", "x"}).code, 2);
}

TEST(Serve, TakesItsOptionsFromTheEnvironmentAndAFile) {
  const Directory directory;
  write_file(directory.path("serve.ini"), "# of a test\nthreads = 3\nmax-message-mib=5\nallow-benchmark=true\n");
  setenv("FACETWISE_SERVE_MAX_MESSAGE_MIB", "4", 1);
  setenv("FACETWISE_SERVE_TARGET", "scalar", 1);
  nlohmann::json info;
  {
    Server server(directory, "s.sock", {"--config", directory.path("serve.ini"), "--threads", "2"});
    const auto result = facetwise({"info", "--json", "--remote", server.address()});
    ASSERT_EQ(result.code, 0) << result.err;
    info = nlohmann::json::parse(result.out);
  }
  unsetenv("FACETWISE_SERVE_MAX_MESSAGE_MIB");
  unsetenv("FACETWISE_SERVE_TARGET");
  EXPECT_EQ(info["threads"], 2);
  EXPECT_EQ(info["benchmark_allowed"], true);
  EXPECT_EQ(info["max_message_bytes"], 4 << 20);
  EXPECT_EQ(info["target"], "scalar");
  // What is wrong is named, and the server does not start.
  write_file(directory.path("wrong.ini"), "treads=3\n");
  const auto key =
      facetwise({"serve", "--listen", "unix:" + directory.path("w"), "--config", directory.path("wrong.ini")});
  EXPECT_EQ(key.code, 1);
  EXPECT_NE(key.err.find("treads: not an option of serve"), std::string::npos) << key.err;
  write_file(directory.path("wrong.ini"), "threads=many\n");
  const auto value =
      facetwise({"serve", "--listen", "unix:" + directory.path("w"), "--config", directory.path("wrong.ini")});
  EXPECT_NE(value.code, 0);
  EXPECT_NE(value.err.find("threads"), std::string::npos) << value.err;
  EXPECT_NE(
      facetwise({"serve", "--listen", "unix:" + directory.path("w"), "--config", directory.path("none.ini")}).code, 0);
}

}  // namespace
}  // namespace facetwise::test
