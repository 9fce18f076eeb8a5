// SPDX-License-Identifier: Apache-2.0
// Columns in memory that client and server share: the same bits without sending them; and clients and servers that die, stop, lie
// or are somebody else.
#include "facetwise/shared_memory.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <future>
#include <thread>

#include "calls.h"
#include "facetwise/client.h"
#include "gtest/gtest.h"
#include "server_process.h"
#include "wire/region.h"
#include "wire/unix_socket.h"

namespace facetwise {
namespace {

using grpc::StatusCode;
using testing::open_channel;
using testing::ServerProcess;
using namespace std::chrono_literals;

constexpr std::size_t kLanes = 50'003, kColumns = 26;

class Shared : public ::testing::Test {
 protected:
  std::string address() const { return "unix:" + folder_.path("s"); }
  std::unique_ptr<ServerProcess> server(std::vector<std::string> arguments = {"--max-shared-bytes",
                                                                              "100000000"}) const {
    arguments.insert(arguments.end(), {"--listen", address()});
    return std::make_unique<ServerProcess>(arguments);
  }
  absl::StatusOr<std::unique_ptr<Engine>> connected(ConnectOptions options = {}) const {
    options.shared_memory = memory_;
    const std::string where = address();
    return connect(std::span(&where, 1), options);
  }
  v1::InfoResponse info() const {
    grpc::ClientContext context;
    v1::InfoResponse info;
    EXPECT_TRUE(v1::Sampler::NewStub(open_channel(address()))->Info(&context, {}, &info).ok());
    return info;
  }
  // What the server says to an offer; nothing where it ends the connection.
  std::optional<std::string> offer(const wire::RegionOffer& offer, int file) const {
    const int socket = wire::connect_unix(wire::region_path(folder_.path("s")));
    EXPECT_TRUE(wire::send_offer(socket, offer, file).ok());
    wire::RegionAnswer answer;
    const bool answered = recv(socket, &answer, sizeof answer, MSG_WAITALL) == sizeof answer;
    close(socket);
    return answered ? std::optional(std::string(answer.refusal)) : std::nullopt;
  }

  testing::TemporaryFolder folder_;
  std::shared_ptr<SharedMemory> memory_ = *SharedMemory::make(ColumnMemory::bytes(kColumns, kLanes));
};

// A batch whose columns are the first ones of `columns`.
Batch batch_in(const ColumnMemory& columns, Operation operation, const Model& model) {
  Batch batch;
  batch.model = model;
  batch.lanes = kLanes;
  batch.sampler = Sampler::visible;
  std::size_t next = 0;
  const auto column = [&] { return std::span(columns[next++], kLanes); };
  const auto filled = [&](auto value) {
    const auto values = column();
    for (std::size_t lane = 0; lane < kLanes; ++lane) values[lane] = value(static_cast<float>(lane) / kLanes);
    return values;
  };
  batch.incident.x = filled([](float t) { return std::sin(6 * t); });
  batch.incident.y = filled([](float) { return 0.0f; });
  batch.incident.z = filled([](float t) { return std::cos(6 * t); });
  batch.alpha_x = filled([](float t) { return t; });
  batch.alpha_y = filled([](float t) { return 1 - t; });
  batch.eta = filled([](float t) { return 1.1f + t; });
  batch.outgoing = {filled([](float) { return 0.0f; }), filled([](float) { return 0.6f; }),
                    filled([](float) { return 0.8f; })};
  if (samples(operation)) batch.generator = {.seed = 5};
  for (const OutputField& field : output_fields())
    if ((field.operations & bit(operation)) != 0 && computes(operation, model, field)) field.column(batch) = column();
  for (const ByteField& field : byte_fields())
    if ((field.operations & bit(operation)) != 0)
      field.column(batch) = {reinterpret_cast<std::uint8_t*>(columns[next++]), kLanes};
  // Only what the operation reads.
  for (const InputField& field : input_fields())
    if (!reads(operation, model, batch.sampler, field)) field.column(batch) = {};
  EXPECT_LE(next, kColumns);
  return batch;
}

TEST_F(Shared, BitsAreThoseOfThisMachineAndNothingIsSent) {
  const auto process = server();
  const auto engine = connected({.piece_bytes = 100'000});
  ASSERT_TRUE(engine.ok()) << engine.status();
  EXPECT_EQ(info().load().shared_bytes(), memory_->bytes());
  const ColumnMemory there(memory_->data(), kColumns, kLanes), here(kColumns, kLanes);
  const Model glass{.masking = Masking::smith, .interface = Interface::dielectric}, metal{};
  for (const Operation operation : all_operations()) {
    const Model& model = scatters(operation) ? glass : metal;
    std::memset(here[0], 0x11, ColumnMemory::bytes(kColumns, kLanes));
    std::memset(memory_->data(), 0x11, memory_->bytes());
    const Batch wanted = batch_in(here, operation, model), got = batch_in(there, operation, model);
    const auto wanted_statistics = run(operation, wanted), statistics = (*engine)->run(operation, got);
    ASSERT_TRUE(wanted_statistics.ok() && statistics.ok()) << wanted_statistics.status() << statistics.status();
    EXPECT_EQ(*statistics, *wanted_statistics);
    EXPECT_EQ(std::memcmp(here[0], memory_->data(), ColumnMemory::bytes(kColumns, kLanes)), 0) << name(operation);
  }
}

TEST_F(Shared, ColumnsElsewhereAreSent) {
  const auto process = server();
  const auto engine = connected({.piece_bytes = 100'000});
  ASSERT_TRUE(engine.ok()) << engine.status();
  const ColumnMemory there(memory_->data(), kColumns, kLanes), here(kColumns, kLanes);
  Batch wanted = batch_in(here, Operation::sample_reflection, {}),
        got = batch_in(there, Operation::sample_reflection, {});
  ASSERT_TRUE(run(Operation::sample_reflection, wanted).ok());
  // One part of a direction each way, one column, and numbers with gaps; ids beside them in shared memory.
  std::vector<float> y(got.incident.y.data(), got.incident.y.data() + kLanes), z(kLanes), weight(2 * kLanes);
  got.incident.y = y;
  got.out.outgoing.z = z;
  got.out.weight = {weight.data(), kLanes, 8};
  auto* ids = reinterpret_cast<std::uint64_t*>(there[kColumns - 2]);
  for (std::size_t lane = 0; lane < kLanes; ++lane) ids[lane] = lane;
  got.generator->id = {ids, kLanes};
  float* pairs = there[kColumns - 4];
  for (std::size_t lane = 0; lane < kLanes; ++lane) pairs[2 * lane + 1] = got.alpha_x[lane];
  got.alpha_x = {pairs + 1, kLanes, 8};
  const auto statistics = (*engine)->sample_reflection(got);
  ASSERT_TRUE(statistics.ok()) << statistics.status();
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    ASSERT_EQ(got.out.outgoing.x[lane], wanted.out.outgoing.x[lane]) << lane;
    ASSERT_EQ(z[lane], wanted.out.outgoing.z[lane]) << lane;
    ASSERT_EQ(weight[2 * lane], wanted.out.weight[lane]) << lane;
    ASSERT_EQ(got.out.status[lane], wanted.out.status[lane]) << lane;
  }
  // Lanes of a list are sent.
  const std::uint32_t active[] = {7, 3, kLanes - 1};
  got.active = active;
  std::fill(weight.begin(), weight.end(), -1.0f);
  ASSERT_TRUE((*engine)->sample_reflection(got).ok());
  EXPECT_EQ(weight[6], wanted.out.weight[3]);
  EXPECT_EQ(weight[8], -1);
}

TEST_F(Shared, MalformedCallsNameTheColumn) {
  const auto process = server();
  const auto engine = connected();
  ASSERT_TRUE(engine.ok()) << engine.status();
  const auto stub = v1::Sampler::NewStub(open_channel(address()));
  v1::BatchRequest good = testing::good_request(100);
  good.clear_alpha_x();
  v1::SharedColumns& shared = *good.mutable_shared();
  shared.set_region(memory_->id());
  v1::SharedColumn& alpha = *shared.add_columns();
  alpha.set_name("alpha_x");
  alpha.set_count(100);
  alpha.set_stride(4);
  const auto answer = [&](const v1::BatchRequest& request) {
    grpc::ClientContext context;
    v1::BatchResponse response;
    return stub->Run(&context, request, &response);
  };
  EXPECT_TRUE(answer(good).ok()) << answer(good).error_message();
  const auto bad = [&](auto change, const std::string& begin, StatusCode code = StatusCode::INVALID_ARGUMENT) {
    v1::BatchRequest request = good;
    change(request, *request.mutable_shared()->mutable_columns(0));
    const grpc::Status status = answer(request);
    EXPECT_EQ(status.error_code(), code) << begin;
    EXPECT_EQ(status.error_message().rfind(begin, 0), 0u) << status.error_message();
  };
  using Request = v1::BatchRequest;
  using Column = v1::SharedColumn;
  const std::uint64_t bytes = memory_->bytes();
  bad([](Request& r, Column&) { r.mutable_shared()->set_region(1); }, "shared.region: no memory 0000000000000001",
      StatusCode::NOT_FOUND);
  bad([&](Request&, Column& c) { c.set_offset(bytes - 396); }, "alpha_x: goes beyond");
  bad([&](Request&, Column& c) { c.set_offset(~std::uint64_t{3}); }, "alpha_x: goes beyond");
  bad([](Request&, Column& c) { c.set_stride(std::uint64_t{1} << 62); }, "alpha_x: goes beyond");
  bad([](Request&, Column& c) { c.set_count(~std::uint64_t{0}); }, "alpha_x: goes beyond");
  bad([](Request&, Column& c) { c.set_offset(2); }, "alpha_x: offset 2 and stride 4 are not whole");
  bad([](Request&, Column& c) { c.set_stride(0); }, "alpha_x: offset 0 and stride 0 are not whole");
  bad([](Request&, Column& c) { c.set_count(99); }, "alpha_x: 99 values for 100 lanes");
  bad([](Request&, Column& c) { c.set_name("u1"); }, "u1: given twice");
  bad([](Request&, Column& c) { c.set_name("generator.id"); }, "generator.id: without a generator");
  bad([](Request&, Column& c) { c.set_name("colour\n"); }, "shared.columns: no column \"colour\\n\"");
  bad([](Request&, Column& c) { c.set_name("out.value"); }, "out.value: not computed by sample_reflection");
  bad([](Request&, Column& c) { c.set_name("out.weight"); }, "out.weight: wanted in the answer and in shared memory");
  bad([](Request& r, Column&) { *r.mutable_shared()->add_columns() = r.shared().columns(0); }, "alpha_x: given twice");
  bad([](Request&, Column& c) { c.set_name(std::string(20000, 'x')); }, "shared: ");
  // Outputs over inputs.
  bad(
      [](Request& r, Column&) {
        r.clear_outputs();
        Column& pdf = *r.mutable_shared()->add_columns() = r.shared().columns(0);
        pdf.set_name("out.pdf");
        pdf.set_offset(4);
      },
      "out.pdf: ");
}

TEST_F(Shared, OffersThatAreNotTaken) {
  const auto refused = [&](const wire::RegionOffer& what, int file, const std::string& why) {
    const auto answer = offer(what, file);
    ASSERT_TRUE(answer) << why;
    EXPECT_NE(answer->find(why), std::string::npos) << *answer;
  };
  {
    const auto process = server({"--max-shared-bytes", "8192"});
    const auto too_much = connected();
    EXPECT_EQ(too_much.status().code(), absl::StatusCode::kPermissionDenied) << too_much.status();
    EXPECT_NE(too_much.status().message().find("above the limit of 8192"), std::string::npos) << too_much.status();
    const int shrinks = memfd_create("test", MFD_CLOEXEC | MFD_ALLOW_SEALING);
    ASSERT_EQ(ftruncate(shrinks, 4096), 0);
    refused({.id = 1, .bytes = 4096}, shrinks, "not sealed against shrinking");
    ASSERT_EQ(fcntl(shrinks, F_ADD_SEALS, F_SEAL_SHRINK), 0);
    refused({.id = 1, .bytes = 8192}, shrinks, "8192 bytes announced, the file has 4096");
    refused({.id = 0, .bytes = 4096}, shrinks, "its id is 0");
    refused({.id = 1, .bytes = 4096}, STDIN_FILENO, "file of memory");
    EXPECT_EQ(offer({.id = 1, .bytes = 4096}, shrinks), "");
    EXPECT_EQ(offer({.magic = 7, .id = 1, .bytes = 4096}, shrinks), std::nullopt);
    close(shrinks);
  }
  {
    const auto process = server({"--max-shared-bytes", "100000000", "--unix-user", std::to_string(geteuid() + 1)});
    refused({.id = memory_->id(), .bytes = memory_->bytes()}, memory_->file(), "does not share memory with user");
  }
  {
    const auto process = server({});
    EXPECT_EQ(connected().status().code(), absl::StatusCode::kFailedPrecondition) << connected().status();
  }
  const std::string elsewhere = "127.0.0.1:1";
  EXPECT_EQ(connect(std::span(&elsewhere, 1), {.shared_memory = memory_}).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST_F(Shared, ServersThatDieAreGivenItAgain) {
  auto process = server();
  const auto engine = connected({.piece_bytes = 20'000, .connect_timeout = 20s});
  ASSERT_TRUE(engine.ok()) << engine.status();
  const ColumnMemory there(memory_->data(), kColumns, kLanes), here(kColumns, kLanes);
  const Batch wanted = batch_in(here, Operation::sample_reflection, {});
  ASSERT_TRUE(run(Operation::sample_reflection, wanted).ok());
  for (int n = 0; n < 6; ++n) {
    const Batch got = batch_in(there, Operation::sample_reflection, {});
    // The server is this thread's child, and would end with it.
    auto pending = std::async(std::launch::async, [&] { return (*engine)->sample_reflection(got); });
    std::this_thread::sleep_for(std::chrono::milliseconds(3 * n));
    process->signal(SIGKILL);
    process->wait();
    process = server();
    const auto statistics = pending.get();
    ASSERT_TRUE(statistics.ok()) << statistics.status();
    EXPECT_EQ(std::memcmp(got.out.weight.data(), wanted.out.weight.data(), 4 * kLanes), 0);
  }
}

TEST_F(Shared, ServersThatStopAreAnErrorSinceTheyMayGoOn) {
  const auto process = server();
  ConnectOptions options;
  options.call_timeout = 500ms;
  const auto engine = connected(options);
  ASSERT_TRUE(engine.ok()) << engine.status();
  const ColumnMemory there(memory_->data(), kColumns, kLanes);
  const Batch batch = batch_in(there, Operation::sample_reflection, {});
  process->signal(SIGSTOP);
  const auto status = (*engine)->sample_reflection(batch).status();
  process->signal(SIGCONT);
  EXPECT_EQ(status.code(), absl::StatusCode::kDeadlineExceeded) << status;
  EXPECT_NE(status.message().find("may still write to the shared memory"), std::string::npos) << status;
  EXPECT_TRUE((*engine)->sample_reflection(batch).ok());
}

TEST_F(Shared, OfClientsThatDieNothingStays) {
  const auto process = server();
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  // A process of its own, which knows nothing of this one's threads.
  const pid_t client = fork();
  if (client == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    // Without gRPC, which does not survive a fork: the offer alone.
    const int socket = wire::connect_unix(wire::region_path(folder_.path("s")));
    char byte = socket >= 0 && wire::send_offer(socket, {.id = 7, .bytes = memory_->bytes()}, memory_->file()).ok() &&
                        recv(socket, &byte, 1, 0) == 1
                    ? 'y'
                    : 'n';
    if (write(ready[1], &byte, 1) == 1) pause();
    _exit(1);
  }
  char byte = 0;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  EXPECT_EQ(byte, 'y');
  EXPECT_EQ(info().load().shared_bytes(), memory_->bytes());
  kill(client, SIGKILL);
  waitpid(client, nullptr, 0);
  std::size_t left = 1;
  for (int n = 0; n < 100 && left > 0; ++n) {
    std::this_thread::sleep_for(50ms);
    left = info().load().shared_bytes();
  }
  EXPECT_EQ(left, 0u);
  for (const int end : ready) close(end);
}

}  // namespace
}  // namespace facetwise
