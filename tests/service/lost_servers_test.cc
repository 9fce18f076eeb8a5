// SPDX-License-Identifier: Apache-2.0
// Servers that are absent, killed, stopped, drained or busy: a batch is answered as long as one is there, completely, once and
// right.
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <iterator>
#include <thread>

#include "calls.h"
#include "facetwise/client.h"
#include "gtest/gtest.h"
#include "server_process.h"

namespace facetwise {
namespace {

using testing::ServerProcess;
using namespace std::chrono_literals;

class LostServers : public ::testing::Test {
 protected:
  static constexpr std::size_t kLanes = 100'003;

  LostServers() {
    expected_ = computed(*local_engine());
    EXPECT_TRUE(expected_.statistics.ok());
  }

  std::string address(int n) const { return "unix:" + folder_.path(std::to_string(n)); }
  std::unique_ptr<ServerProcess> server(int n, std::vector<std::string> arguments = {}) const {
    arguments.insert(arguments.end(), {"--listen", address(n), "--drain-ms", "2000", "--patience-ms", "200"});
    return std::make_unique<ServerProcess>(arguments);
  }
  std::unique_ptr<Engine> connected(int servers, ConnectOptions options = {}) const {
    options.piece_bytes = 100'000;
    options.window = 6;
    std::vector<std::string> addresses;
    for (int n = 0; n < servers; ++n) addresses.push_back(address(n));
    auto engine = connect(addresses, options);
    EXPECT_TRUE(engine.ok()) << engine.status();
    return engine.ok() ? *std::move(engine) : nullptr;
  }

  struct Answer {
    absl::StatusOr<Statistics> statistics = Statistics{};
    std::vector<float> x, pdf;
  };
  static Answer computed(Engine& engine) {
    Answer answer;
    answer.x.assign(kLanes, -7);
    answer.pdf.assign(kLanes, -7);
    Batch batch;
    batch.lanes = kLanes;
    batch.incident = {0.0f, 0.6f, 0.8f};
    batch.alpha_x = 0.3f;
    batch.alpha_y = 0.6f;
    batch.sampler = Sampler::bounded;
    batch.generator = {.seed = 17};
    batch.out.outgoing.x = answer.x;
    batch.out.pdf = answer.pdf;
    answer.statistics = engine.sample_reflection(batch);
    return answer;
  }
  void expect_equal(Engine& engine) const {
    const Answer answer = computed(engine);
    ASSERT_TRUE(answer.statistics.ok()) << answer.statistics.status();
    EXPECT_EQ(answer.statistics->lanes(), kLanes);
    EXPECT_EQ(answer.statistics->accepted, expected_.statistics->accepted);
    EXPECT_EQ(answer.x, expected_.x);
    EXPECT_EQ(answer.pdf, expected_.pdf);
  }

  testing::TemporaryFolder folder_;
  Answer expected_;
};

TEST_F(LostServers, AbsentOnesAreNotWaitedForAndComeLater) {
  const auto second = server(1);
  std::vector<std::string> absent;
  ConnectOptions options;
  options.connect_timeout = 60s;
  options.absent = [&](const std::string& message) { absent.push_back(message); };
  const auto begun = std::chrono::steady_clock::now();
  const auto engine = connected(2, options);
  EXPECT_LT(std::chrono::steady_clock::now() - begun, 30s);
  ASSERT_EQ(absent.size(), 1u);
  EXPECT_EQ(absent[0].rfind("server " + address(0) + ": no answer yet", 0), 0u) << absent[0];
  expect_equal(*engine);
  // The first comes, the second goes.
  const auto first = server(0);
  second->signal(SIGKILL);
  second->wait();
  expect_equal(*engine);
}

// Also batches of one piece.
TEST_F(LostServers, NoneAreLeftOutWhileAllAreThere) {
  const auto first = server(0), second = server(1), third = server(2);
  ConnectOptions options;
  const auto engine = connected(3, options);
  for (int n = 0; n < 9; ++n) ASSERT_TRUE(testing::sample_one(*engine).ok());
  for (int n = 0; n < 3; ++n) {
    grpc::ClientContext context;
    v1::InfoResponse info;
    ASSERT_TRUE(v1::Sampler::NewStub(testing::open_channel(address(n)))->Info(&context, {}, &info).ok());
    EXPECT_EQ(info.load().lanes(), 3u) << n;
  }
}

TEST_F(LostServers, KilledOnesAreReplacedByTheOthers) {
  std::vector<std::unique_ptr<ServerProcess>> servers;
  for (int n = 0; n < 3; ++n) servers.push_back(server(n));
  std::atomic<bool> ends = false;
  std::atomic<int> kills = 0;
  std::thread killer([&] {
    for (int n = 0; !ends; n = (n + 1) % 3) {
      usleep(30000);
      servers[n]->signal(kills % 2 == 0 ? SIGKILL : SIGTERM);  // lost, and drained
      servers[n]->wait();
      ++kills;
      servers[n] = server(n);
    }
  });
  const auto engine = connected(3);
  while (kills < 20) {
    expect_equal(*engine);
    if (HasFailure()) break;
  }
  ends = true;
  killer.join();
}

TEST_F(LostServers, SilentOnesAreLeft) {
  const auto first = server(0), second = server(1);
  ConnectOptions options;
  options.call_timeout = 1s;
  const auto engine = connected(2, options);
  expect_equal(*engine);
  first->signal(SIGSTOP);
  expect_equal(*engine);
  first->signal(SIGCONT);
  expect_equal(*engine);
}

TEST_F(LostServers, BusyOnesAreAskedAgain) {
  const auto only = server(0, {"--max-calls", "1"});
  std::vector<std::thread> callers;
  for (int n = 0; n < 3; ++n)
    callers.emplace_back([&] {
      const auto engine = connected(1);
      for (int k = 0; k < 2; ++k) expect_equal(*engine);
    });
  for (std::thread& caller : callers) caller.join();
}

TEST_F(LostServers, AllOfThemAreAnErrorThatNamesOne) {
  auto first = server(0), second = server(1);
  ConnectOptions options;
  options.connect_timeout = 500ms;
  const auto engine = connected(2, options);
  for (auto* one : {&first, &second}) {
    (*one)->signal(SIGKILL);
    (*one)->wait();
  }
  const Answer answer = computed(*engine);
  EXPECT_EQ(answer.statistics.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(answer.statistics.status().message().rfind("server unix:", 0), 0u) << answer.statistics.status();
}

// HAProxy with the configuration that we give, for these addresses.
class Proxy {
 public:
  Proxy(const testing::TemporaryFolder& folder, const std::vector<std::unique_ptr<ServerProcess>>& servers)
      : address_("unix:" + folder.path("proxy")) {
    std::ifstream given(FACETWISE_HAPROXY);
    std::string text{std::istreambuf_iterator<char>(given), {}};
    const auto replace = [&](const std::string& from, const std::string& to) {
      const auto at = text.find(from);
      ASSERT_NE(at, std::string::npos) << from;
      text.replace(at, from.size(), to);
    };
    replace("bind 0.0.0.0:7777 proto", "bind unix@" + folder.path("proxy") + " proto");
    for (std::size_t n = 0; n < servers.size(); ++n) {
      const auto& addresses = servers[n]->addresses();
      const std::string metrics_port = addresses.at(1).substr(addresses[1].rfind(':') + 1);
      replace(" render" + std::to_string(n + 1) + ":7777", " " + addresses[0] + " port " + metrics_port);
    }
    const std::string file = folder.path("haproxy.cfg");
    std::ofstream(file) << text;
    const pid_t parent = getpid();
    process_ = fork();
    if (process_ != 0) return;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() == parent) execl("/usr/sbin/haproxy", "haproxy", "-q", "-db", "-f", file.c_str(), nullptr);
    _exit(127);
  }
  ~Proxy() {
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
  }
  Proxy(const Proxy&) = delete;
  Proxy& operator=(const Proxy&) = delete;
  const std::string& address() const { return address_; }

 private:
  const std::string address_;
  pid_t process_ = -1;
};

TEST_F(LostServers, BehindAProxyAreReplacedToo) {
  const auto tcp_server = [](const std::string& address, const std::string& metrics) {
    return std::make_unique<ServerProcess>(
        std::vector<std::string>{"--listen", address, "--metrics", metrics, "--drain-ms", "2000", "--pause-ms", "500"});
  };
  std::vector<std::unique_ptr<ServerProcess>> servers;
  for (int n = 0; n < 3; ++n) servers.push_back(tcp_server("127.0.0.1:0", "127.0.0.1:0"));
  const Proxy proxy(folder_, servers);
  ConnectOptions options;
  options.piece_bytes = 100'000;
  options.window = 6;
  options.connect_timeout = 20s;
  const auto engine = connect(std::span(&proxy.address(), 1), options);
  ASSERT_TRUE(engine.ok()) << engine.status();
  expect_equal(**engine);
  std::atomic<bool> ends = false;
  std::atomic<int> kills = 0;
  std::thread killer([&] {
    for (int n = 0; !ends; n = (n + 1) % 3) {
      usleep(300000);
      servers[n]->signal(kills % 2 == 0 ? SIGKILL : SIGTERM);
      servers[n]->wait();
      const std::vector<std::string> addresses = servers[n]->addresses();
      servers[n] = tcp_server(addresses[0], addresses[1]);
      ++kills;
    }
  });
  while (kills < 8 && !HasFailure()) expect_equal(**engine);
  ends = true;
  killer.join();
}

}  // namespace
}  // namespace facetwise
