// SPDX-License-Identifier: Apache-2.0
// Tables of slopes: uploaded by the engine by itself, listed, deleted, lost with a server, refused.
#include <cmath>
#include <thread>

#include "calls.h"
#include "facetwise/client.h"
#include "facetwise/remote_tables.h"
#include "gtest/gtest.h"
#include "server_process.h"

namespace facetwise {
namespace {

using testing::ServerProcess;
using testing::TemporaryFolder;

std::chrono::system_clock::time_point soon() { return std::chrono::system_clock::now() + std::chrono::seconds(20); }

// Small ones, each with contents of its own.
std::shared_ptr<const SlopeTable> table(double width, bool radial = true) {
  const auto density = [=](double x, double y) {
    return std::exp(-(x * x + y * y) / width) * (radial || x > 0 ? 1 : 1 + x * x);
  };
  const auto built = SlopeTable::build(
      density,
      {.radial = radial, .grid = 65, .incidence = 9, .slopes = 17, .uniforms = 16, .azimuths = radial ? 0u : 16u});
  EXPECT_TRUE(built.ok()) << built.status();
  return *built;
}

struct Answer {
  std::vector<float> x, y, z, pdf, weight;
  bool operator==(const Answer&) const = default;
};

absl::StatusOr<Answer> ask(Engine& engine, const std::shared_ptr<const SlopeTable>& slopes) {
  constexpr std::size_t kLanes = 5000;
  Answer answer;
  for (auto* column : {&answer.x, &answer.y, &answer.z, &answer.pdf, &answer.weight}) column->assign(kLanes, -7);
  Batch batch;
  batch.model = {.distribution = Distribution::table, .table = slopes};
  batch.sampler = Sampler::visible;
  batch.lanes = kLanes;
  batch.incident = {0.6f, 0.0f, 0.8f};
  batch.alpha_x = 0.5f;
  batch.alpha_y = 0.25f;
  batch.generator = Generator{.seed = 11};
  batch.out.outgoing = {answer.x, answer.y, answer.z};
  batch.out.pdf = answer.pdf;
  batch.out.weight = answer.weight;
  if (const auto statistics = engine.sample_reflection(batch); !statistics.ok()) return statistics.status();
  return answer;
}

class RemoteTables : public ::testing::Test {
 protected:
  std::string socket(const char* name = "s") const { return "unix:" + folder_.path(name); }
  static std::unique_ptr<Engine> connected(const std::string& address) {
    auto engine = connect(std::span(&address, 1), {.piece_bytes = 8192});
    EXPECT_TRUE(engine.ok()) << engine.status();
    return *std::move(engine);
  }
  static Channel channel(const std::string& address) { return *open_channel(address, {}); }
  static void expect_equal(Engine& remote, const std::shared_ptr<const SlopeTable>& slopes) {
    const auto there = ask(remote, slopes), here = ask(*local_engine(), slopes);
    ASSERT_TRUE(there.ok()) << there.status();
    ASSERT_TRUE(here.ok());
    EXPECT_EQ(*there, *here);
  }
  TemporaryFolder folder_;
};

TEST_F(RemoteTables, AreUploadedAndGiveTheLocalBits) {
  const ServerProcess server({"--listen", socket()});
  ASSERT_TRUE(server.ready());
  const auto engine = connected(socket());
  for (const auto& slopes : {table(1), table(2, false), table(1)}) expect_equal(*engine, slopes);
  const auto kept = list_tables(channel(socket()), soon());
  ASSERT_TRUE(kept.ok()) << kept.status();
  ASSERT_EQ(kept->size(), 2u);
  for (const RemoteTable& one : *kept) {
    EXPECT_EQ(one.bytes, one.radial ? table(1)->bytes() : table(2, false)->bytes());
    EXPECT_EQ(one.id, one.radial ? table(1)->id() : table(2, false)->id());
    EXPECT_LT(one.idle.count(), 20);
  }
}

TEST_F(RemoteTables, AreUploadedAgainWhenTheServerHasLostThem) {
  const auto slopes = table(1);
  auto server = std::make_unique<ServerProcess>(std::vector<std::string>{"--listen", socket()});
  const auto engine = connected(socket());
  expect_equal(*engine, slopes);
  ASSERT_TRUE(delete_table(channel(socket()), slopes->id(), soon()).ok());
  EXPECT_EQ(delete_table(channel(socket()), slopes->id(), soon()).code(), absl::StatusCode::kNotFound);
  expect_equal(*engine, slopes);
  server = nullptr;
  server = std::make_unique<ServerProcess>(std::vector<std::string>{"--listen", socket()});
  ASSERT_TRUE(server->ready());
  // Calls on the connection that was lost fail until that is noticed.
  for (int n = 0; n < 50 && ask(*engine, slopes).status().code() == absl::StatusCode::kUnavailable; ++n)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  expect_equal(*engine, slopes);
}

TEST_F(RemoteTables, ExpireWhenNobodyUsesThem) {
  const ServerProcess server({"--listen", socket(), "--table-idle-ms", "50"});
  ASSERT_TRUE(upload_table(channel(socket()), *table(1), 1024, soon()).ok());
  bool gone = false;
  for (int n = 0; n < 200 && !gone; ++n) {
    std::this_thread::sleep_for(std::chrono::milliseconds(60));
    gone = list_tables(channel(socket()), soon())->empty();
  }
  EXPECT_TRUE(gone);
}

TEST_F(RemoteTables, AreLimited) {
  const auto slopes = table(1);
  const std::string bytes = std::to_string(slopes->bytes() * 5 / 2);
  const ServerProcess server({"--listen", socket(), "--max-tables-bytes", bytes});
  const Channel open = channel(socket());
  EXPECT_TRUE(upload_table(open, *slopes, 4096, soon()).ok());
  EXPECT_TRUE(upload_table(open, *table(2), 4096, soon()).ok());
  const auto third = upload_table(open, *table(3), 4096, soon());
  EXPECT_EQ(third.code(), absl::StatusCode::kResourceExhausted) << third;
  EXPECT_TRUE(upload_table(open, *slopes, 4096, soon()).ok()) << "it is there";
  EXPECT_TRUE(delete_table(open, table(2)->id(), soon()).ok());
  EXPECT_TRUE(upload_table(open, *table(3), 4096, soon()).ok());

  const ServerProcess small({"--listen", socket("small"), "--max-table-bytes", "1000"});
  const auto large = upload_table(channel(socket("small")), *slopes, 4096, soon());
  EXPECT_EQ(large.code(), absl::StatusCode::kInvalidArgument) << large;
  EXPECT_NE(large.message().find("above the limit of 1000"), std::string::npos) << large;
}

// What strangers send: each is refused by name, and the server is as it was.
TEST_F(RemoteTables, Refusals) {
  const ServerProcess server({"--listen", socket(), "--read-ms", "300"});
  const auto slopes = table(1);
  const std::string good = slopes->serialise();
  const auto stub = v1::Sampler::NewStub(testing::open_channel(socket()));
  struct Sent {
    std::uint64_t id, bytes;
    std::string data;
    const char* error;
  };
  std::string spoilt = good;
  spoilt[good.size() / 2] ^= 1;
  for (const Sent& sent :
       {Sent{slopes->id(), good.size(), spoilt, "data: "}, Sent{slopes->id() + 1, good.size(), good, "id: "},
        Sent{slopes->id(), good.size(), good + "x", "data: more than"},
        Sent{slopes->id(), good.size(), good.substr(1), "data: "}, Sent{slopes->id(), 0, "", "data: "},
        Sent{slopes->id(), 4, "abcd", "data: "}, Sent{slopes->id(), std::uint64_t{1} << 63, good, "bytes: "}}) {
    grpc::ClientContext context;
    v1::SlopeTableInfo info;
    const auto writer = stub->UploadTable(&context, &info);
    v1::TableChunk chunk;
    chunk.set_id(sent.id);
    chunk.set_bytes(sent.bytes);
    chunk.set_data(sent.data);
    writer->Write(chunk);
    writer->WritesDone();
    const grpc::Status status = writer->Finish();
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << sent.error << status.error_message();
    EXPECT_EQ(status.error_message().rfind(sent.error, 0), 0u) << status.error_message();
  }
  {
    // One that stops half way does not stay.
    grpc::ClientContext context;
    v1::SlopeTableInfo info;
    const auto writer = stub->UploadTable(&context, &info);
    v1::TableChunk chunk;
    chunk.set_id(slopes->id());
    chunk.set_bytes(good.size());
    chunk.set_data(good.substr(0, 100));
    writer->Write(chunk);
    EXPECT_EQ(writer->Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
  v1::BatchRequest request = testing::good_request(3);
  request.mutable_model()->set_distribution(v1::TABLE);
  request.set_sampler(v1::VISIBLE);
  const auto run = [&] {
    grpc::ClientContext context;
    v1::BatchResponse response;
    return stub->Run(&context, request, &response);
  };
  EXPECT_EQ(run().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  request.mutable_model()->set_slope_table(slopes->id());
  const grpc::Status unknown = run();
  EXPECT_EQ(unknown.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(unknown.error_message().rfind("model.slope_table: ", 0), 0u) << unknown.error_message();
  EXPECT_TRUE(list_tables(channel(socket()), soon())->empty());
  expect_equal(*connected(socket()), slopes);
  EXPECT_TRUE(run().ok());
}

}  // namespace
}  // namespace facetwise
