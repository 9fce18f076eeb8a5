// SPDX-License-Identifier: Apache-2.0
// Clients that send slowly, receive slowly, or do nothing: the server's memory and threads stay within its limits, others
// are answered meanwhile, and afterwards all is as before.
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstring>
#include <thread>

#include "calls.h"
#include "grpcpp/generic/generic_stub.h"
#include "gtest/gtest.h"
#include "health.h"
#include "server_process.h"
#include "wire/unix_socket.h"

namespace facetwise {
namespace {

using grpc::StatusCode;
using testing::good_request;
using testing::open_channel;
using testing::ServerProcess;
using testing::SilentCalls;

constexpr std::size_t kMiB = std::size_t{1} << 20;
// What a process holds; AddressSanitizer keeps what is freed.
#ifdef __SANITIZE_ADDRESS__
constexpr const char* kMemory = "none";
#else
constexpr const char* kMemory = "VmRSS";
#endif
// Threads that gRPC may have begun meanwhile for itself.
constexpr long kOthers = 8;

// One connection to a server, of which only so many bytes get through.
class Strait {
 public:
  Strait(const std::string& path, const std::string& server, std::size_t bytes) : left_(bytes) {
    const sockaddr_un address = wire::unix_address(path);
    listener_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 || listen(listener_, 1) != 0)
      std::abort();
    thread_ = std::thread([this, server] { carry(server); });
  }
  ~Strait() {
    ends_ = true;
    thread_.join();
    close(listener_);
  }
  bool full() const { return left_ == 0; }

 private:
  void carry(const std::string& server) {
    while (!ends_ && !readable(listener_)) {
    }
    if (ends_) return;
    const int here = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    const int there = wire::connect_unix(server);
    while (!ends_) {
      pollfd ends[] = {{there, POLLIN, 0}, {here, static_cast<short>(left_ > 0 ? POLLIN : 0), 0}};
      poll(ends, 2, 20);
      if ((ends[0].revents & (POLLIN | POLLHUP)) != 0 && !pass(there, here, buffer_.size())) break;
      if ((ends[1].revents & POLLIN) != 0) {
        const std::size_t passed = pass(here, there, std::min<std::size_t>(left_, buffer_.size()));
        if (passed == 0) break;
        left_ -= passed;
      }
    }
    close(here);
    close(there);
  }
  std::size_t pass(int from, int to, std::size_t most) {
    const ssize_t count = read(from, buffer_.data(), most);
    if (count <= 0) return 0;
    for (ssize_t sent = 0; sent < count;) {
      const ssize_t more = send(to, buffer_.data() + sent, count - sent, MSG_NOSIGNAL);
      if (more <= 0) return 0;
      sent += more;
    }
    return count;
  }
  static bool readable(int socket) {
    pollfd one = {socket, POLLIN, 0};
    return poll(&one, 1, 20) > 0;
  }

  std::array<char, 65536> buffer_;
  std::atomic<std::size_t> left_;
  std::atomic<bool> ends_{false};
  int listener_ = -1;
  std::thread thread_;
};

class HostileClients : public ::testing::Test {
 protected:
  std::string path() const { return folder_.path("s"); }
  std::string address() const { return "unix:" + path(); }

  grpc::Status run(std::size_t lanes, std::chrono::seconds limit = std::chrono::seconds(60)) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + limit);
    v1::BatchResponse response;
    const auto status = v1::Sampler::NewStub(open_channel(address()))->Run(&context, good_request(lanes), &response);
    if (status.ok() && response.statistics().accepted() != lanes) return {StatusCode::INTERNAL, "not all are accepted"};
    return status;
  }
  // Calls of the largest size, several at once, so that memory is at its level.
  void warm_up(std::size_t lanes) {
    std::vector<std::thread> callers;
    for (int n = 0; n < 3; ++n) callers.emplace_back([&] { run(lanes); });
    for (std::thread& caller : callers) caller.join();
    EXPECT_TRUE(run(lanes).ok());
  }

  testing::TemporaryFolder folder_;
};

// Lanes of good_request() whose answer is a little below so many bytes: nine columns and the status.
constexpr std::size_t lanes_of(std::size_t message_bytes) { return (message_bytes - 1024) / 37; }

// 24 requests that each stop short of their end: what has come of them would be 96 MiB.
TEST_F(HostileClients, ThatStopInTheirMessagesTakeTheRoomThereIs) {
  const std::size_t lanes = lanes_of(4 * kMiB);
  ServerProcess server({"--listen", address(), "--max-message-bytes", std::to_string(4 * kMiB), "--max-bytes-in-flight",
                        std::to_string(20 * kMiB), "--patience-ms", "100"});
  ASSERT_TRUE(server.ready());
  warm_up(lanes);
  const long before = server.status(kMemory);
  std::vector<std::unique_ptr<Strait>> straits;
  std::vector<std::thread> callers;
  std::array<std::unique_ptr<grpc::ClientContext>, 24> contexts;
  std::atomic<int> ended = 0;
  for (std::size_t k = 0; k < contexts.size(); ++k) {
    const std::string path = folder_.path("strait" + std::to_string(k));
    straits.push_back(std::make_unique<Strait>(path, this->path(), lanes * 32 - 100));
    contexts[k] = std::make_unique<grpc::ClientContext>();
    callers.emplace_back([&ended, lanes, path, context = contexts[k].get()] {
      v1::BatchResponse response;
      const auto stub = v1::Sampler::NewStub(open_channel("unix:" + path));
      EXPECT_FALSE(stub->Run(context, good_request(lanes), &response).ok());
      ++ended;
    });
  }
  for (int n = 0; n < 2000; ++n) {  // until one is
    if (std::any_of(straits.begin(), straits.end(), [](const auto& strait) { return strait->full(); })) break;
    usleep(1000);
  }
  long most = 0;
  for (int n = 0; n < 4; ++n) {  // others are answered meanwhile
    EXPECT_TRUE(run(1000).ok());
    most = std::max(most, server.status(kMemory));
  }
  EXPECT_LT(most - before, 30 * 1024) << "KiB";
  for (auto& context : contexts) context->TryCancel();
  for (std::thread& caller : callers) caller.join();
  EXPECT_TRUE(run(lanes).ok());
}

// 20 answers of 7 MiB that nobody reads, where 64 MiB are allowed.
TEST_F(HostileClients, ThatDoNotReadTheirAnswersAreCounted) {
  const std::size_t lanes = lanes_of(8 * kMiB);
  ServerProcess server({"--listen", address(), "--max-message-bytes", std::to_string(8 * kMiB), "--max-bytes-in-flight",
                        std::to_string(64 * kMiB), "--write-ms", "1500", "--patience-ms", "100000"});
  ASSERT_TRUE(server.ready());
  warm_up(lanes);
  const long before = server.status(kMemory);
  grpc::GenericStub stub(open_channel(address(), false));
  grpc::CompletionQueue queue;
  struct Call {
    grpc::ClientContext context;
    std::unique_ptr<grpc::GenericClientAsyncReaderWriter> stream;
  };
  const auto wait = [&] {
    void* tag = nullptr;
    bool good = false;
    return queue.Next(&tag, &good) && good;
  };
  std::vector<std::unique_ptr<Call>> calls;
  const std::string text = good_request(lanes).SerializeAsString();
  const grpc::Slice slice(text);
  for (int k = 0; k < 20; ++k) {
    auto& call = *calls.emplace_back(std::make_unique<Call>());
    call.stream = stub.PrepareCall(&call.context, "/facetwise.v1.Sampler/Run", &queue);
    call.stream->StartCall(&call);
    ASSERT_TRUE(wait());
    call.stream->WriteLast(grpc::ByteBuffer(&slice, 1), {}, &call);
    wait();
  }
  long most = 0;
  int refused = 0, ended_slow = 0;
  for (int n = 0; n < 10; ++n) {
    usleep(20000);
    most = std::max(most, server.status(kMemory));
  }
  EXPECT_LT(most - before, 70 * 1024) << "KiB";
  usleep(2000000);  // until those that were answered have been waited for long enough
  for (auto& call : calls) {
    grpc::Status status;
    grpc::ByteBuffer answer;
    call->stream->Read(&answer, call.get());
    EXPECT_FALSE(wait());
    call->stream->Finish(&status, call.get());
    wait();
    refused += status.error_code() == StatusCode::RESOURCE_EXHAUSTED;
    ended_slow += status.error_code() == StatusCode::CANCELLED;
  }
  EXPECT_GT(refused, 0);
  EXPECT_GT(ended_slow, 0);
  EXPECT_EQ(refused + ended_slow, 20);
  EXPECT_TRUE(run(lanes).ok());
}

// An answer that waits for its reader is sent by a server that drains.
TEST_F(HostileClients, ThatAreSlowGetTheirAnswersFromAServerThatDrains) {
  const std::size_t lanes = lanes_of(8 * kMiB);
  ServerProcess server({"--listen", address(), "--patience-ms", "300"});
  ASSERT_TRUE(server.ready());
  const auto stub = v1::Sampler::NewStub(open_channel(address(), false));
  grpc::ClientContext context;
  const auto stream = stub->RunStream(&context);
  ASSERT_TRUE(stream->Write(good_request(lanes)) && stream->WritesDone());
  usleep(500000);  // computed by then
  server.signal(SIGTERM);
  usleep(1200000);
  v1::BatchResponse response;
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(response.statistics().accepted(), lanes);
  stream->Finish();
  EXPECT_EQ(server.wait(), 0);
}

// Calls that begin and send nothing, more than there may be at work or have room.
TEST_F(HostileClients, ThatSendNothingKeepNobodyOut) {
  ServerProcess server({"--listen", address(), "--max-calls", "8", "--max-message-bytes", std::to_string(kMiB),
                        "--max-bytes-in-flight", std::to_string(16 * kMiB), "--patience-ms", "50"});
  ASSERT_TRUE(server.ready());
  EXPECT_TRUE(run(3).ok());
  const long threads = server.status("Threads");
  SilentCalls silent(open_channel(address()));
  for (int k = 0; k < 128; ++k)
    silent.begin(k % 2 == 0 ? "/facetwise.v1.Sampler/Run" : "/facetwise.v1.Sampler/RunStream");
  EXPECT_TRUE(run(1000).ok());
  EXPECT_TRUE(run(1000).ok());
  EXPECT_LE(server.status("Threads"), threads + kOthers);
  // They do not hold up the end either: it would take ten seconds.
  const auto begun = std::chrono::steady_clock::now();
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(), 0);
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(9));
}

// Streams that are idle and connections that do nothing cost no thread and little memory.
TEST_F(HostileClients, ThatAreIdleCostNoThread) {
  rlimit files;
  getrlimit(RLIMIT_NOFILE, &files);
  files.rlim_cur = files.rlim_max;
  setrlimit(RLIMIT_NOFILE, &files);
  ServerProcess server({"--listen", address(), "--max-message-bytes", std::to_string(kMiB)});
  ASSERT_TRUE(server.ready());
  EXPECT_TRUE(run(1000).ok());
  const long threads = server.status("Threads"), memory = server.status(kMemory);
  std::vector<int> connections;
  for (int k = 0; k < 1000; ++k) {
    connections.push_back(wire::connect_unix(path()));
    ASSERT_GE(connections.back(), 0) << k;
  }
  const auto channel = open_channel(address());
  const auto stub = v1::Sampler::NewStub(channel);
  std::array<grpc::ClientContext, 200> contexts;
  std::vector<std::unique_ptr<grpc::ClientReaderWriter<v1::BatchRequest, v1::BatchResponse>>> streams;
  v1::BatchResponse response;
  for (grpc::ClientContext& context : contexts) {
    streams.push_back(stub->RunStream(&context));
    ASSERT_TRUE(streams.back()->Write(good_request(3)) && streams.back()->Read(&response));
  }
  EXPECT_TRUE(run(1000).ok());
  EXPECT_LE(server.status("Threads"), threads + kOthers);
  EXPECT_LT(server.status(kMemory) - memory, 100 * 1024) << "KiB";
  for (auto& stream : streams) {  // each is still there
    ASSERT_TRUE(stream->Write(good_request(3)) && stream->Read(&response));
    EXPECT_EQ(response.statistics().accepted(), 3u);
  }
  for (const int connection : connections) close(connection);
  EXPECT_TRUE(run(1000).ok());
}

// More connections than there may be, by the server's limit or the system's: the rest wait, and come when there is room.
TEST_F(HostileClients, ThatConnectTooOftenWait) {
  for (const auto& limit : {std::vector<std::string>{"--files", "64"}, {"--max-connections", "20"}}) {
    SCOPED_TRACE(limit[0]);
    std::vector<std::string> arguments = {"--listen", address(), "--listen", "127.0.0.1:0"};
    arguments.insert(arguments.end(), limit.begin(), limit.end());
    ServerProcess server(arguments);
    ASSERT_TRUE(server.ready());
    EXPECT_TRUE(run(3).ok());
    std::vector<int> connections;
    for (int k = 0; k < 100; ++k) {
      connections.push_back(wire::connect_unix(path()));
      ASSERT_GE(connections.back(), 0);
    }
    EXPECT_EQ(run(3, std::chrono::seconds(1)).error_code(), StatusCode::DEADLINE_EXCEEDED);
    for (const int connection : connections) close(connection);
    EXPECT_TRUE(run(3).ok());
    grpc::ClientContext context;
    v1::BatchResponse response;
    const auto stub = v1::Sampler::NewStub(open_channel(server.addresses()[1]));
    EXPECT_TRUE(stub->Run(&context, good_request(3), &response).ok());
    server.signal(SIGTERM);
    EXPECT_EQ(server.wait(), 0);
  }
}

// Reflection is gRPC's own and has a thread per stream: only so many, and calls and health do not need them.
TEST_F(HostileClients, ThatReflectForEverAreLimited) {
  ServerProcess server({"--listen", address(), "--max-calls", "8"});
  ASSERT_TRUE(server.ready());
  EXPECT_TRUE(run(1000).ok());
  const long threads = server.status("Threads");
  SilentCalls silent(open_channel(address()));
  for (int k = 0; k < 92; ++k) silent.begin("/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo");
  EXPECT_TRUE(run(1000).ok());
  EXPECT_EQ(testing::Health(open_channel(address())).check(""), testing::Health::serving);
  EXPECT_LE(server.status("Threads"), threads + 16 + kOthers);
}

}  // namespace
}  // namespace facetwise
