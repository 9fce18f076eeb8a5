// SPDX-License-Identifier: Apache-2.0
// A server's life: sockets and locks, limits, clients that go away, draining.
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <fstream>
#include <thread>

#include "calls.h"
#include "facetwise/client.h"
#include "gtest/gtest.h"
#include "health.h"
#include "server_process.h"
#include "wire/unix_socket.h"

namespace facetwise {
namespace {

using grpc::StatusCode;
using testing::good_request;
using testing::Health;
using testing::open_channel;
using testing::ServerProcess;

using Clock = std::chrono::steady_clock;

// One value for all columns: a small request for much work, some ten nanoseconds a lane.
v1::BatchRequest slow_request(std::size_t lanes) {
  v1::BatchRequest slow = good_request(1);
  slow.mutable_model()->set_distribution(v1::BECKMANN);
  slow.set_sampler(v1::VISIBLE);
  slow.set_lanes(lanes);
  slow.clear_outputs();
  slow.add_outputs(v1::STATUS);
  return slow;
}

class Lifetime : public ::testing::Test {
 protected:
  std::string unix_address() const { return "unix:" + folder_.path("s"); }

  static std::unique_ptr<v1::Sampler::Stub> stub_of(const std::string& address) {
    return v1::Sampler::NewStub(open_channel(address));
  }
  static grpc::Status run(v1::Sampler::Stub& stub, std::size_t lanes) {
    grpc::ClientContext context;
    v1::BatchResponse response;
    return stub.Run(&context, good_request(lanes), &response);
  }

  static grpc::Status run_request(v1::Sampler::Stub& stub, const v1::BatchRequest& request) {
    grpc::ClientContext context;
    v1::BatchResponse response;
    return stub.Run(&context, request, &response);
  }

  testing::TemporaryFolder folder_;
};

TEST_F(Lifetime, ASecondServerOnTheSameSocketIsRefused) {
  ServerProcess first({"--listen", unix_address()});
  ASSERT_TRUE(first.ready());
  const auto stub = stub_of(unix_address());
  EXPECT_TRUE(run(*stub, 3).ok());
  ServerProcess second({"--listen", unix_address()});
  EXPECT_FALSE(second.ready());
  EXPECT_EQ(second.wait(), 1);
  EXPECT_NE(second.errors().find(unix_address() + ": another server listens there"), std::string::npos)
      << second.errors();
  EXPECT_TRUE(run(*stub_of(unix_address()), 3).ok());  // the first one is still there

  // Ended well: nothing is left.
  first.signal(SIGTERM);
  EXPECT_EQ(first.wait(), 0);
  struct stat there;
  EXPECT_NE(stat(folder_.path("s").c_str(), &there), 0);
  EXPECT_NE(stat(folder_.path("s.lock").c_str(), &there), 0);
}

TEST_F(Lifetime, AKilledServersSocketIsTakenOver) {
  ServerProcess first({"--listen", unix_address()});
  ASSERT_TRUE(first.ready());
  first.signal(SIGKILL);
  EXPECT_EQ(first.wait(), -SIGKILL);
  struct stat there;
  ASSERT_EQ(stat(folder_.path("s").c_str(), &there), 0);
  ServerProcess second({"--listen", unix_address()});
  ASSERT_TRUE(second.ready());
  EXPECT_TRUE(run(*stub_of(unix_address()), 3).ok());
}

TEST_F(Lifetime, SocketsAreTheOwnersAlone) {
  ServerProcess server({"--listen", unix_address()});
  struct stat there;
  ASSERT_EQ(stat(folder_.path("s").c_str(), &there), 0);
  EXPECT_EQ(there.st_mode & 0777, 0600u);
}

TEST_F(Lifetime, AddressesThatCannotBeListenedOnAreRefused) {
  const auto expect_refused = [](const std::vector<std::string>& arguments, const std::string& message) {
    ServerProcess server(arguments);
    EXPECT_FALSE(server.ready());
    EXPECT_EQ(server.wait(), 1);
    EXPECT_NE(server.errors().find(message), std::string::npos) << server.errors();
  };
  std::ofstream(folder_.path("file")) << "precious";
  expect_refused({"--listen", "unix:" + folder_.path("file")}, "a file of that name is not a socket");
  std::string text;
  std::ifstream(folder_.path("file")) >> text;
  EXPECT_EQ(text, "precious");
  expect_refused({"--listen", "unix:" + folder_.path("no/such/folder")}, "cannot make its lock file: No such file");
  expect_refused({"--listen", "unix:/" + std::string(200, 'x')}, "is too long a path");
  expect_refused({"--listen", "unix:"}, "has no path");
  expect_refused({"--listen", "8000"}, "is neither unix:PATH nor HOST:PORT");
  expect_refused({"--listen", "127.0.0.1:99999"}, "is neither unix:PATH nor HOST:PORT");
  for (const char* strange :
       {"unix-abstract:1234", "dns:///localhost:1", "ipv4:127.0.0.1:1", "vsock:1", "a b:1", "[::1:5", "::1:5"})
    expect_refused({"--listen", strange}, "is neither unix:PATH nor HOST:PORT");
  for (const char* open : {"0.0.0.0:0", "[::]:0", "192.0.2.1:0", "example.org:0"})
    expect_refused({"--listen", open}, "is open to the network");
  ServerProcess everywhere({"--listen", "0.0.0.0:0", "--insecure"});
  EXPECT_TRUE(everywhere.ready()) << "said aloud";
  ServerProcess server({"--listen", "127.0.0.1:0"});
  ASSERT_TRUE(server.ready());
  expect_refused({"--listen", server.addresses()[0]}, server.addresses()[0] + ": cannot listen there");
  // One bad address takes the good one's socket away again.
  expect_refused({"--listen", unix_address(), "--listen", server.addresses()[0]}, "cannot listen there");
  ServerProcess good({"--listen", unix_address()});
  EXPECT_TRUE(good.ready());
}

TEST_F(Lifetime, InfoTellsWhatRuns) {
  ServerProcess server({"--listen", unix_address(), "--threads", "1", "--max-message-bytes", "1000000"});
  grpc::ClientContext context;
  v1::InfoResponse info;
  ASSERT_TRUE(stub_of(unix_address())->Info(&context, {}, &info).ok());
  EXPECT_EQ(info.version(), std::string(version()));
  EXPECT_EQ(info.target(), std::string(name(*resolve(Target::best))));
  ASSERT_EQ(info.available_targets_size(), static_cast<int>(available_targets().size()));
  EXPECT_EQ(info.available_targets(0), std::string(name(available_targets()[0])));
  EXPECT_EQ(info.threads(), 1u);
  EXPECT_EQ(info.max_message_bytes(), 1000000u);
  EXPECT_FALSE(info.cpu().empty());
  EXPECT_FALSE(info.benchmark_allowed());
}

TEST_F(Lifetime, CallsAboveTheLimitAreRefused) {
  ServerProcess server({"--listen", unix_address(), "--threads", "1", "--max-calls", "2", "--max-message-bytes",
                        "1000000000", "--max-bytes-in-flight", "50000000000"});
  const auto stub = stub_of(unix_address());
  // Streams that are idle are not at work. (A client has its answer before the server has seen that it left: once more then.)
  std::unique_ptr<grpc::ClientContext> contexts[3];
  std::unique_ptr<grpc::ClientReaderWriter<v1::BatchRequest, v1::BatchResponse>> streams[3];
  v1::BatchResponse response;
  for (int k = 0; k < 3; ++k) do {
      streams[k].reset();
      contexts[k] = std::make_unique<grpc::ClientContext>();
      streams[k] = stub->RunStream(contexts[k].get());
    } while (!streams[k]->Write(good_request(3)) || !streams[k]->Read(&response));
  while (!run(*stub, 3).ok()) usleep(1000);
  usleep(100000);
  for (int k = 0; k < 2; ++k) ASSERT_TRUE(streams[k]->Write(slow_request(200000000)));
  grpc::Status refused;
  while ((refused = run(*stub, 3)).ok()) usleep(1000);  // until both are in
  EXPECT_EQ(refused.error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_NE(refused.error_message().find("the server answers 2 calls, its limit"), std::string::npos);
  for (int k = 0; k < 2; ++k) contexts[k]->TryCancel();
  while (!run(*stub, 3).ok()) usleep(1000);
  ASSERT_TRUE(streams[2]->Write(good_request(3)) && streams[2]->Read(&response));
}

TEST_F(Lifetime, BytesAboveTheLimitAreRefused) {
  ServerProcess server(
      {"--listen", unix_address(), "--max-message-bytes", "1000000", "--max-bytes-in-flight", "5000000"});
  ASSERT_TRUE(server.ready());
  const auto stub = v1::Sampler::NewStub(open_channel(unix_address(), false));
  // Answers that nobody reads are held.
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReaderWriter<v1::BatchRequest, v1::BatchResponse>>> streams;
  grpc::Status status;
  for (int k = 0; (status = run(*stub, 20000)).ok(); ++k) {
    ASSERT_LT(k, 100);
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    streams.push_back(stub->RunStream(contexts.back().get()));
    if (streams.back()->Write(good_request(20000))) continue;
    status = streams.back()->Finish();  // it is the one that is refused
    break;
  }
  EXPECT_EQ(status.error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_NE(status.error_message().find("bytes of messages"), std::string::npos) << status.error_message();
  for (auto& context : contexts) context->TryCancel();
  // What was held is given back; a client has its answer before the server has seen that it left.
  int refused = 0;
  for (int k = 0; k < 100; ++k)
    while (!run(*stub, 20000).ok()) {
      ASSERT_LT(++refused, 5000);
      usleep(1000);
    }
}

// A limit under which no call could ever be answered is an error of the start, not of every call.
TEST_F(Lifetime, LimitsThatAnswerNothingAreRefused) {
  ServerProcess server(
      {"--listen", unix_address(), "--max-message-bytes", "1000000", "--max-bytes-in-flight", "4999999"});
  EXPECT_FALSE(server.ready());
  EXPECT_EQ(server.wait(), 1);
  EXPECT_NE(server.errors().find("max_bytes_in_flight: below five times"), std::string::npos) << server.errors();
}

TEST_F(Lifetime, CallsThatSendNothingAreEnded) {
  ServerProcess server({"--listen", unix_address(), "--read-ms", "200", "--idle-ms", "400"});
  ASSERT_TRUE(server.ready());
  testing::SilentCalls silent(open_channel(unix_address()));
  for (const char* method : {"Run", "Compact", "RunStream", "CompactStream"})
    silent.begin(std::string("/facetwise.v1.Sampler/") + method);
  for (const grpc::Status& ended : silent.end()) EXPECT_EQ(ended.error_code(), StatusCode::CANCELLED);
  EXPECT_TRUE(run(*stub_of(unix_address()), 3).ok());
}

// Calls compute in turns.
TEST_F(Lifetime, ShortCallsDoNotWaitForLongOnes) {
  ServerProcess server({"--listen", unix_address(), "--threads", "1", "--max-message-bytes", "1000000000",
                        "--max-bytes-in-flight", "5000000000"});
  ASSERT_TRUE(server.ready());
  const auto stub = stub_of(unix_address());
  std::atomic<int> done{0};
  std::vector<std::thread> long_calls;
  for (int n = 0; n < 4; ++n)
    long_calls.emplace_back([&] {
      EXPECT_TRUE(run_request(*stub, slow_request(60000000)).ok());
      ++done;
    });
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  for (int n = 0; n < 3; ++n) {
    EXPECT_TRUE(run(*stub, 1000).ok());
    EXPECT_TRUE(run(*stub, 50000).ok());  // long too, but much shorter
  }
  EXPECT_EQ(done, 0);
  for (std::thread& call : long_calls) call.join();
}

// A deadline ends the work too: the server has drained long before the call would have been done.
TEST_F(Lifetime, DeadlinesStopTheWork) {
  const std::vector<std::string> arguments = {
      "--listen",   unix_address(),          "--threads", "1", "--max-message-bytes",
      "1000000000", "--max-bytes-in-flight", "5000000000"};
  const auto stub = stub_of(unix_address());
  Clock::duration stopped;
  {
    ServerProcess server(arguments);
    ASSERT_TRUE(server.ready());
    const auto begun = Clock::now();
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(300));
    v1::BatchResponse response;
    EXPECT_EQ(stub->Run(&context, slow_request(200000000), &response).error_code(), StatusCode::DEADLINE_EXCEEDED);
    EXPECT_TRUE(run(*stub, 3).ok());
    server.signal(SIGTERM);
    EXPECT_EQ(server.wait(), 0);
    stopped = Clock::now() - begun;
  }
  // How long it is without a deadline, by a twentieth of it.
  ServerProcess server(arguments);
  ASSERT_TRUE(server.ready());
  const auto again_stub = stub_of(unix_address());
  const auto again = Clock::now();
  EXPECT_TRUE(run_request(*again_stub, slow_request(10000000)).ok());
  EXPECT_LT(stopped, std::chrono::milliseconds(1000) + 10 * (Clock::now() - again));
}

TEST_F(Lifetime, OutlivesClientsThatGoAway) {
  ServerProcess server({"--listen", unix_address()});
  const auto stub = stub_of(unix_address());
  for (int k = 0; k < 50; ++k) {
    // Gone in the middle of a stream, with an answer unread.
    grpc::ClientContext context;
    const auto stream = stub->RunStream(&context);
    stream->Write(good_request(20000));
    if (k % 2 == 0) stream->Write(good_request(20000));
    context.TryCancel();
  }
  for (int k = 0; k < 50; ++k) {
    grpc::ClientContext expired;
    expired.set_deadline(std::chrono::system_clock::now() + std::chrono::microseconds(k * 50));
    v1::BatchResponse response;
    const grpc::Status status = stub->Run(&expired, good_request(100000), &response);
    EXPECT_TRUE(status.ok() || status.error_code() == StatusCode::DEADLINE_EXCEEDED) << status.error_message();
  }
  // Connections that send something else, or nothing, and close.
  for (const char* text :
       {"", "GET / HTTP/1.1\r\n\r\n", "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\xff\xff\xff\xff\xff\xff\xff\xff\xff"}) {
    const int connection = wire::connect_unix(folder_.path("s"));
    ASSERT_GE(connection, 0);
    EXPECT_EQ(send(connection, text, std::strlen(text), MSG_NOSIGNAL), static_cast<ssize_t>(std::strlen(text)));
    close(connection);
  }
  for (int k = 0; k < 20; ++k) ASSERT_TRUE(run(*stub_of(unix_address()), 1000).ok());
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(), 0);
}

TEST_F(Lifetime, TellsItsHealth) {
  ServerProcess server({"--listen", unix_address()});
  Health health(open_channel(unix_address()));
  EXPECT_EQ(health.check(""), Health::serving);
  EXPECT_EQ(health.check("facetwise.v1.Sampler"), Health::serving);
  EXPECT_EQ(health.check("no.such.Service"), Health::unknown);
}

// SIGTERM while clients call and one watches the health: every call that was taken is answered, the watcher
// hears of it, the process ends with 0 although the watcher stays.
TEST_F(Lifetime, DrainsUnderLoad) {
  for (const std::string& address : {unix_address(), std::string("127.0.0.1:0")}) {
    SCOPED_TRACE(address);
    ServerProcess server({"--listen", address});
    ASSERT_TRUE(server.ready());
    Health::Watch watch(open_channel(server.addresses()[0]), "facetwise.v1.Sampler");
    ASSERT_EQ(watch.next(), Health::serving);

    std::atomic<int> answered{0}, refused{0}, wrong{0};
    std::vector<std::thread> clients;
    for (int k = 0; k < 3; ++k) {
      clients.emplace_back([&, lanes = 1000 + 100000 * k] {
        const auto stub = stub_of(server.addresses()[0]);
        for (;;) {
          const grpc::Status status = run(*stub, lanes);
          if (status.ok()) {
            ++answered;
            continue;
          }
          // Not taken: the connection is closed or being closed. Anything else is a call that was dropped.
          const bool not_taken = status.error_code() == StatusCode::UNAVAILABLE;
          EXPECT_TRUE(not_taken) << status.error_code() << ": " << status.error_message();
          ++(not_taken ? refused : wrong);
          break;
        }
      });
    }
    while (answered < 30) usleep(1000);
    server.signal(SIGTERM);
    EXPECT_EQ(watch.next(), Health::not_serving);
    EXPECT_EQ(server.wait(), 0);
    for (std::thread& client : clients) client.join();
    EXPECT_EQ(wrong, 0);
    EXPECT_EQ(refused, 3);
  }
}

// Between saying so and refusing there is a pause.
TEST_F(Lifetime, CallsAreTakenUntilTheWatchersKnow) {
  ServerProcess server({"--listen", unix_address(), "--pause-ms", "1500"});
  ASSERT_TRUE(server.ready());
  Health::Watch watch(open_channel(unix_address()), "facetwise.v1.Sampler");
  ASSERT_EQ(watch.next(), Health::serving);
  const auto stub = stub_of(unix_address());
  ASSERT_TRUE(run(*stub, 3).ok());
  server.signal(SIGTERM);
  EXPECT_EQ(watch.next(), Health::not_serving);
  EXPECT_TRUE(run(*stub, 3).ok());
  grpc::Status status;
  while ((status = run(*stub, 3)).ok()) usleep(10000);
  EXPECT_EQ(status.error_code(), StatusCode::UNAVAILABLE);
  EXPECT_EQ(server.wait(), 0);
}

// A call that computes when the signal comes is answered.
TEST_F(Lifetime, FinishesCallsInFlight) {
  ServerProcess server({"--listen", unix_address(), "--allow-benchmark"});
  const auto stub = stub_of(unix_address());
  grpc::ClientContext context;
  const auto stream = stub->RunStream(&context);
  v1::BatchResponse response;
  ASSERT_TRUE(stream->Write(good_request(10)) && stream->Read(&response));
  usleep(300000);  // for the server to wait for the next message
  server.signal(SIGTERM);
  usleep(300000);
  // The stream was open before: its next message is answered, then it ends.
  ASSERT_TRUE(stream->Write(good_request(100000)));
  ASSERT_TRUE(stream->Read(&response)) << stream->Finish().error_message();
  EXPECT_EQ(response.statistics().accepted(), 100000u);
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_EQ(stream->Finish().error_code(), StatusCode::UNAVAILABLE);
  EXPECT_EQ(server.wait(), 0);
}

// A stream that stays idle is ended after the drain time.
TEST_F(Lifetime, DoesNotWaitForeverForAnIdleStream) {
  ServerProcess server({"--listen", unix_address(), "--drain-ms", "300"});
  const auto stub = stub_of(unix_address());
  grpc::ClientContext context;
  const auto stream = stub->RunStream(&context);
  v1::BatchResponse response;
  ASSERT_TRUE(stream->Write(good_request(10)) && stream->Read(&response));
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(), 0);
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_FALSE(stream->Finish().ok());
}

TEST_F(Lifetime, ASecondSignalEndsItAtOnce) {
  ServerProcess server({"--listen", unix_address()});
  const auto stub = stub_of(unix_address());
  grpc::ClientContext context;
  const auto stream = stub->RunStream(&context);
  v1::BatchResponse response;
  ASSERT_TRUE(stream->Write(good_request(10)) && stream->Read(&response));
  server.signal(SIGTERM);
  usleep(200000);
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(), -SIGTERM);
}

TEST_F(Lifetime, BenchmarksAreOffUnlessAllowed) {
  ServerProcess server({"--listen", unix_address()});
  grpc::ClientContext context;
  const auto reader = stub_of(unix_address())->Benchmark(&context, {});
  v1::BenchmarkProgress progress;
  EXPECT_FALSE(reader->Read(&progress));
  const grpc::Status status = reader->Finish();
  EXPECT_EQ(status.error_code(), StatusCode::PERMISSION_DENIED);
  EXPECT_NE(status.error_message().find("--allow-benchmark"), std::string::npos);
}

TEST_F(Lifetime, BenchmarksReportAsTheyGo) {
  ServerProcess server({"--listen", unix_address(), "--allow-benchmark"});
  const auto stub = stub_of(unix_address());
  const auto benchmark = [&](const std::string& filter, double min_seconds, int* reports = nullptr) {
    grpc::ClientContext context;
    v1::BenchmarkRequest request;
    request.set_filter(filter);
    request.set_min_seconds(min_seconds);
    const auto reader = stub->Benchmark(&context, request);
    v1::BenchmarkProgress progress;
    for (unsigned k = 1; reader->Read(&progress); ++k) {
      EXPECT_EQ(progress.done(), k);
      EXPECT_EQ(progress.total(), 3u);
      EXPECT_EQ(progress.result().operation(), filter);
      if (reports != nullptr) ++*reports;
    }
    return reader->Finish();
  };
  int reports = 0;
  EXPECT_TRUE(benchmark("some", 0.5, &reports).ok());
  EXPECT_EQ(reports, 3);
  const auto expect_invalid = [](const grpc::Status& status, const std::string& message) {
    EXPECT_EQ(status.error_code(), StatusCode::INVALID_ARGUMENT);
    EXPECT_TRUE(status.error_message().starts_with(message)) << status.error_message();
  };
  expect_invalid(benchmark("fail", 0), "filter: the runner says no");
  expect_invalid(benchmark(std::string(1001, 'x'), 0), "filter: 1001 bytes");
  for (const double seconds : {-1.0, 10.5, std::nan("")}) expect_invalid(benchmark("", seconds), "min_seconds: ");

  // One at a time; it ends when its client goes.
  grpc::ClientContext context;
  v1::BenchmarkRequest request;
  request.set_filter("long");
  const auto reader = stub->Benchmark(&context, request);
  v1::BenchmarkProgress progress;
  ASSERT_TRUE(reader->Read(&progress));
  EXPECT_EQ(benchmark("some", 0).error_code(), StatusCode::RESOURCE_EXHAUSTED);
  context.TryCancel();
  while (reader->Read(&progress)) {
  }
  EXPECT_EQ(reader->Finish().error_code(), StatusCode::CANCELLED);
  while (!benchmark("some", 0).ok()) usleep(1000);

  // And when the server drains.
  grpc::ClientContext other;
  const auto last = stub->Benchmark(&other, request);
  ASSERT_TRUE(last->Read(&progress));
  server.signal(SIGTERM);
  while (last->Read(&progress)) {
  }
  EXPECT_EQ(last->Finish().error_code(), StatusCode::UNAVAILABLE);
  EXPECT_EQ(server.wait(), 0);
}

}  // namespace
}  // namespace facetwise
