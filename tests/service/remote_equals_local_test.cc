// SPDX-License-Identifier: Apache-2.0
// The remote engine gives what the local one does, to the last byte, whatever the columns look like.
#include <signal.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <map>
#include <random>
#include <string>

#include "columns.h"
#include "facetwise/client.h"
#include "gtest/gtest.h"
#include "server_process.h"

namespace facetwise {
namespace {

using testing::kUntouched;
using testing::Memory;
using testing::ServerProcess;
using testing::Shape;
using testing::TemporaryFolder;

// Lanes as a structure each, so that any column can be strided. Some are invalid, smooth, or face away.
struct Lane {
  float ix, iy, iz, ox, oy, oz, ax, ay, u1, u2, u3, padding;
  std::uint64_t id;
};

std::vector<Lane> make_lanes(std::size_t count) {
  std::mt19937 random(20240611 + static_cast<unsigned>(count));
  std::uniform_real_distribution<float> uniform(0, 0.999f);
  const auto direction = [&](float& x, float& y, float& z, float lowest) {
    z = lowest + (1 - lowest) * uniform(random);
    const float phi = 6.2831853f * uniform(random), r = std::sqrt((1 - z) * (1 + z));
    x = r * std::cos(phi);
    y = r * std::sin(phi);
  };
  std::vector<Lane> lanes(count);
  for (std::size_t k = 0; k < count; ++k) {
    Lane& lane = lanes[k];
    direction(lane.ix, lane.iy, lane.iz, -0.3f);
    direction(lane.ox, lane.oy, lane.oz, -0.2f);
    lane.ax = 0.01f + uniform(random);
    lane.ay = 0.01f + uniform(random);
    lane.u1 = uniform(random);
    lane.u2 = uniform(random);
    lane.u3 = uniform(random);
    lane.id = 0x123456789abcull * k + 5;
    if (k % 23 == 7) lane.ax = 1e-5f;
    if (k % 29 == 3) lane.iz = NAN;
    if (k % 31 == 4) lane.ay = -1;
  }
  return lanes;
}

struct Outputs {
  std::vector<Memory<float>> columns;
  Memory<std::uint8_t> status;
  bool operator==(const Outputs&) const = default;
};

// Every output of the operation; `some` leaves out every other one, parts of directions among them.
Outputs make_outputs(Operation operation, Batch& batch, Shape shape, bool some) {
  Outputs outputs{{}, {batch.lanes, shape, 0xee}};
  outputs.columns.reserve(16);
  std::size_t k = 0;
  for (const OutputField& field : output_fields()) {
    if (!(field.operations & bit(operation)) || (some && k++ % 2 == 0)) continue;
    outputs.columns.emplace_back(batch.lanes, shape, kUntouched);
    field.column(batch) = outputs.columns.back().out();
  }
  if (!some) batch.out.status = outputs.status.out();
  return outputs;
}

bool takes(Operation operation, Sampler sampler) {
  if (operation == Operation::sample_normal) return samples_normals(sampler);
  if (operation == Operation::masking) return sampler == Sampler::cap;
  return true;
}

enum class Random { columns, generator, generator_ids, generator_one_id };

struct Case {
  std::size_t lanes = 0;
  Shape shape = Shape::contiguous;
  bool broadcast = false;  // roughness and o are one value
  bool active = false;
  bool some_outputs = false;
  Random random = Random::columns;
  Shadowing shadowing = Shadowing::correlated;
};

class Remote : public ::testing::Test {
 protected:
  std::unique_ptr<Engine> connect_to(const std::vector<std::string>& addresses, std::size_t piece_bytes, int window) {
    ConnectOptions options;
    options.piece_bytes = piece_bytes;
    options.window = window;
    auto engine = connect(addresses, options);
    EXPECT_TRUE(engine.ok()) << engine.status();
    return engine.ok() ? *std::move(engine) : nullptr;
  }

  // Runs every operation with every sampler on both engines and compares all memory.
  void compare(Engine& remote, const Case& c) {
    const std::vector<Lane> lanes = make_lanes(c.lanes);
    std::map<std::string, Memory<float>> columns;
    const auto add = [&](const char* name, float Lane::*member) {
      auto& memory = columns.emplace(name, Memory<float>(c.lanes, c.shape, 0)).first->second;
      for (std::size_t k = 0; k < c.lanes; ++k) memory[k] = lanes[k].*member;
    };
    add("incident.x", &Lane::ix), add("incident.y", &Lane::iy), add("incident.z", &Lane::iz);
    add("outgoing.x", &Lane::ox), add("outgoing.y", &Lane::oy), add("outgoing.z", &Lane::oz);
    add("alpha_x", &Lane::ax), add("alpha_y", &Lane::ay);
    add("u1", &Lane::u1), add("u2", &Lane::u2), add("u3", &Lane::u3);
    Memory<std::uint64_t> ids(c.lanes, c.shape, 0);
    for (std::size_t k = 0; k < c.lanes; ++k) ids[k] = lanes[k].id;
    std::vector<std::uint32_t> active;
    for (std::size_t k = 0; k < c.lanes; ++k)
      if (const std::size_t lane = (k * 7 + 3) % c.lanes; c.lanes % 7 != 0 && lane % 3 != 1) active.push_back(lane);

    for (const Operation operation : all_operations()) {
      if (operation > Operation::masking) continue;  // needs a dielectric: below
      for (const Sampler sampler : all_samplers()) {
        if (!takes(operation, sampler)) continue;
        SCOPED_TRACE(std::string(name(operation)) + " " + std::string(name(sampler)));
        Batch batch;
        batch.sampler = sampler;
        batch.model.shadowing = c.shadowing;
        batch.lanes = c.lanes;
        const bool samples = operation <= Operation::sample_reflection;
        const bool generates = samples && c.random != Random::columns;
        for (const InputField& field : input_fields()) {
          const std::string name(field.name);
          if (!(field.operations & bit(operation)) || !columns.contains(name) || (name[0] == 'u' && generates))
            continue;
          field.column(batch) = columns.at(name).in();
        }
        if (c.broadcast) {
          batch.alpha_x = 0.3f;
          batch.alpha_y = 0.8f;
          if (!samples && operation != Operation::masking) batch.outgoing = {0.0f, 0.6f, 0.8f};
        }
        if (generates) {
          batch.generator =
              Generator{.seed = 0xfedcba9876543210, .dimension = 3, .id = {}, .first_id = (1ull << 32) - 10};
          if (c.random == Random::generator_ids) batch.generator->id = ids.in();
          if (c.random == Random::generator_one_id) batch.generator->id = std::uint64_t{99};
        }
        if (c.active) batch.active = active;

        Batch there = batch, here = batch;
        Outputs far = make_outputs(operation, there, c.shape, c.some_outputs);
        Outputs near = make_outputs(operation, here, c.shape, c.some_outputs);
        const auto answered = remote.run(operation, there);
        const auto expected = run(operation, here);
        ASSERT_TRUE(expected.ok()) << expected.status();
        ASSERT_TRUE(answered.ok()) << answered.status();
        EXPECT_EQ(*answered, *expected);
        EXPECT_EQ(far, near);
      }
    }
  }

  TemporaryFolder folder_;
};

constexpr std::size_t kSizes[] = {0, 1, 2, 15, 16, 17, 333, 1009, 20011};

TEST_F(Remote, GivesTheSameBytesForEveryShapeOfColumn) {
  ServerProcess server({"--listen", "unix:" + folder_.path("s")});
  ASSERT_TRUE(server.ready());
  const auto engine = connect_to(server.addresses(), 4096, 4);
  ASSERT_NE(engine, nullptr);
  for (const std::size_t lanes : kSizes)
    for (const Shape shape : {Shape::contiguous, Shape::strided})
      for (const bool broadcast : {false, true})
        for (const bool active : {false, true}) {
          SCOPED_TRACE(::testing::Message() << lanes << " lanes, strided " << (shape == Shape::strided)
                                            << ", broadcast " << broadcast << ", active " << active);
          compare(*engine, {.lanes = lanes, .shape = shape, .broadcast = broadcast, .active = active});
          if (HasFatalFailure()) return;
        }
}

TEST_F(Remote, GivesTheSameBytesForEveryKindOfRandomNumbers) {
  ServerProcess server({"--listen", "unix:" + folder_.path("s")});
  ASSERT_TRUE(server.ready());
  const auto engine = connect_to(server.addresses(), 5000, 3);
  ASSERT_NE(engine, nullptr);
  for (const std::size_t lanes : {1, 17, 5003})
    for (const Random random : {Random::generator, Random::generator_ids, Random::generator_one_id})
      for (const bool active : {false, true})
        for (const bool some : {false, true}) {
          SCOPED_TRACE(::testing::Message() << lanes << " lanes, random " << static_cast<int>(random) << ", active "
                                            << active << ", some outputs " << some);
          compare(*engine, {.lanes = lanes,
                            .shape = Shape::strided,
                            .broadcast = some,
                            .active = active,
                            .some_outputs = some,
                            .random = random,
                            .shadowing = Shadowing::uncorrelated});
          if (HasFatalFailure()) return;
        }
}

TEST_F(Remote, GivesTheSameBytesOverTcpAndFromSeveralServers) {
  ServerProcess one({"--listen", "127.0.0.1:0", "--listen", "unix:" + folder_.path("s"), "--threads", "1"});
  ServerProcess other({"--listen", "unix:" + folder_.path("t")});
  ASSERT_TRUE(one.ready() && other.ready());
  ASSERT_EQ(one.addresses().size(), 2u);
  const auto tcp = connect_to({one.addresses()[0]}, 1 << 20, 4);
  const auto three = connect_to({one.addresses()[0], one.addresses()[1], other.addresses()[0]}, 8192, 7);
  ASSERT_TRUE(tcp && three);
  compare(*tcp, {.lanes = 200003});
  compare(*three, {.lanes = 50021, .active = true, .random = Random::generator});
}

// A server computes large messages a piece at a time: larger ones while no other call computes, one after the other and
// several at once.
TEST_F(Remote, GivesTheSameBytesWhereServersCutMessages) {
  ServerProcess server({"--listen", "unix:" + folder_.path("s"), "--max-message-bytes", "67108864"});
  ASSERT_TRUE(server.ready());
  const auto alone = connect_to(server.addresses(), std::size_t{60} << 20, 1);
  const auto several = connect_to(server.addresses(), std::size_t{3} << 20, 4);
  ASSERT_TRUE(alone && several);
  compare(*alone, {.lanes = 300007, .broadcast = true, .random = Random::generator});
  compare(*several, {.lanes = 300007, .random = Random::generator_ids});
}

// A piece is one lane where that is all that fits, and never above the server's limit.
TEST_F(Remote, PiecesRespectTheServersLimit) {
  ServerProcess server({"--listen", "unix:" + folder_.path("s"), "--max-message-bytes", "8192"});
  ASSERT_TRUE(server.ready());
  for (const std::size_t piece : {std::size_t{1}, std::size_t{1} << 26}) {
    const auto engine = connect_to(server.addresses(), piece, 5);
    ASSERT_NE(engine, nullptr);
    compare(*engine, {.lanes = 101});
    if (piece == 1) continue;
    compare(*engine, {.lanes = 9001, .broadcast = true, .random = Random::generator});
    // Hardly any bytes a lane: the limit on lanes counts.
    Batch batch;
    batch.lanes = 30001;
    batch.incident = {0.0f, 0.6f, 0.8f};
    batch.alpha_x = batch.alpha_y = 0.5f;
    const auto statistics = engine->masking(batch);
    ASSERT_TRUE(statistics.ok()) << statistics.status();
    EXPECT_EQ(statistics->accepted, 30001u);
  }
}

TEST_F(Remote, OutputsMayBeTheInputs) {
  ServerProcess server({"--listen", "unix:" + folder_.path("s")});
  const auto engine = connect_to(server.addresses(), 4096, 4);
  ASSERT_NE(engine, nullptr);
  std::vector<Lane> near = make_lanes(3001), far = near;
  const auto in_place = [](std::vector<Lane>& lanes) {
    const auto in = [&](float Lane::*member) { return Column<float>(&(lanes[0].*member), lanes.size(), sizeof(Lane)); };
    const auto out = [&](float Lane::*member) {
      return OutputColumn<float>(&(lanes[0].*member), lanes.size(), sizeof(Lane));
    };
    Batch batch;
    batch.lanes = lanes.size();
    batch.incident = {in(&Lane::ix), in(&Lane::iy), in(&Lane::iz)};
    batch.alpha_x = in(&Lane::ax), batch.alpha_y = in(&Lane::ay);
    batch.u1 = in(&Lane::u1), batch.u2 = in(&Lane::u2), batch.u3 = in(&Lane::u3);
    batch.out.outgoing = {out(&Lane::ix), out(&Lane::iy), out(&Lane::iz)};
    batch.out.pdf = out(&Lane::u1);
    return batch;
  };
  ASSERT_TRUE(engine->sample_reflection(in_place(far)).ok());
  ASSERT_TRUE(sample_reflection(in_place(near)).ok());
  EXPECT_EQ(std::memcmp(near.data(), far.data(), near.size() * sizeof(Lane)), 0);
}

// The same error as the local engine's, and no output written.
TEST_F(Remote, MalformedCallsGetTheLocalError) {
  ServerProcess server({"--listen", "unix:" + folder_.path("s")});
  const auto engine = connect_to(server.addresses(), 4096, 4);
  ASSERT_NE(engine, nullptr);
  std::vector<float> x(12, 0.0f), z(12, 1.0f), alpha(12, 0.5f), pdf(12, kUntouched), u(12, 0.25f);
  Batch good;
  good.lanes = 12;
  good.incident = {x, x, z};
  good.alpha_x = good.alpha_y = alpha;
  good.u1 = good.u2 = good.u3 = u;
  good.out.pdf = pdf;
  const auto expect_same_error = [&](const char* what, const auto& change) {
    Batch bad = good;
    change(bad);
    const auto near = sample_reflection(bad), far = engine->sample_reflection(bad);
    ASSERT_FALSE(near.ok()) << what;
    EXPECT_EQ(near.status(), far.status()) << what;
    for (const float value : pdf) ASSERT_EQ(value, kUntouched) << what;
  };
  const std::vector<std::uint32_t> beyond = {3, 12};
  expect_same_error("count", [](Batch& b) { b.lanes = 13; });
  expect_same_error("missing", [](Batch& b) { b.alpha_y = {}; });
  expect_same_error("both", [](Batch& b) { b.generator = Generator{}; });
  expect_same_error("extra", [&](Batch& b) { b.outgoing.x = x; });
  expect_same_error("output", [&](Batch& b) { b.out.masking = pdf; });
  expect_same_error("overlap", [&](Batch& b) { b.out.weight = pdf; });
  expect_same_error("sampler", [](Batch& b) { b.sampler = static_cast<Sampler>(77); });
  expect_same_error("active", [&](Batch& b) { b.active = beyond; });
  Compaction bad{.lanes = 12, .active = {}, .status = {}, .index = {}, .columns = {}};
  EXPECT_EQ(engine->compact(bad).status(), compact(bad).status());
  EXPECT_FALSE(compact(bad).ok());
  EXPECT_TRUE(engine->sample_reflection(good).ok());
}

TEST_F(Remote, ErrorsNameTheServer) {
  ConnectOptions options;
  options.connect_timeout = std::chrono::milliseconds(300);
  const std::string nobody = "unix:" + folder_.path("nobody");
  const auto refused = connect(std::vector{nobody}, options);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_NE(std::string(refused.status().message()).find("server " + nobody), std::string::npos) << refused.status();
  EXPECT_EQ(connect(std::vector<std::string>{}).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(connect(std::vector<std::string>{"nonsense"}).status().code(), absl::StatusCode::kInvalidArgument);

  ServerProcess server({"--listen", "unix:" + folder_.path("s")});
  options.connect_timeout = std::chrono::milliseconds(2000);
  const auto connected = connect(server.addresses(), options);
  ASSERT_TRUE(connected.ok()) << connected.status();
  const auto& engine = *connected;
  server.signal(SIGKILL);
  server.wait();
  std::vector<float> masking(5000);
  Batch batch;
  batch.lanes = masking.size();
  batch.incident = {0.0f, 0.6f, 0.8f};
  batch.alpha_x = batch.alpha_y = 0.5f;
  batch.out.masking = masking;
  const auto lost = engine->masking(batch);
  EXPECT_EQ(lost.status().code(), absl::StatusCode::kUnavailable) << lost.status();
  EXPECT_TRUE(lost.status().message().find("server " + server.addresses()[0] + ": ") == 0) << lost.status();

  EXPECT_EQ(engine->masking(batch).status().code(), absl::StatusCode::kUnavailable);

  // The engine finds a server that comes back.
  ServerProcess again({"--listen", "unix:" + folder_.path("s")});
  ASSERT_TRUE(again.ready());
  const auto found = engine->masking(batch);
  EXPECT_TRUE(found.ok()) << found.status();
}

}  // namespace
}  // namespace facetwise
