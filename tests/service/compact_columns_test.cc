// SPDX-License-Identifier: Apache-2.0
// Columns in half their bytes: errors as stated, over directions and weights of every kind.
#include "wire/compact_columns.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

#include "calls.h"
#include "facetwise/client.h"
#include "server_process.h"

namespace facetwise::wire {
namespace {

TEST(CompactColumns, DirectionsAreAsCloseAsStated) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  double worst = 0;
  const auto check = [&](double zed, double phi) {
    const double r = std::sqrt(1 - zed * zed);
    const float x = static_cast<float>(r * std::cos(phi)), y = static_cast<float>(r * std::sin(phi)),
                z = static_cast<float>(zed);
    char packed[kDirectionBytes];
    float u, v, w;
    pack_directions(&x, &y, &z, 1, packed);
    unpack_directions(packed, 1, &u, &v, &w);
    ASSERT_NEAR(double{u} * u + double{v} * v + double{w} * w, 1, 6e-7);
    const double chord = std::hypot(double{u} - x, double{v} - y, double{w} - z);
    worst = std::max(worst, 2 * std::asin(chord / 2));
    ASSERT_TRUE(z == 0 || (w != 0 && std::signbit(z) == std::signbit(w))) << zed << ' ' << phi;
  };
  for (int n = 0; n < 2'000'000; ++n) check(uniform(random), std::numbers::pi * uniform(random));
  // Next to the horizon, and along the edges.
  for (int n = 0; n < 200'000; ++n)
    for (const double zed : {1e-9, 1e-5, -1e-9, -1e-5, 0.0, 1.0, -1.0}) check(zed, std::numbers::pi * uniform(random));
  for (int quarter = -4; quarter <= 4; ++quarter)
    for (const double zed : {0.5, -0.5, 1e-7, -1e-7}) check(zed, quarter * std::numbers::pi / 4);
  EXPECT_LT(worst, 8e-5);
  EXPECT_GT(worst, 3e-5);  // what is stated is not far from what is
  const float nothing = 0;
  char packed[kDirectionBytes];
  float u = 1, v = 1, w = 1;
  pack_directions(&nothing, &nothing, &nothing, 1, packed);
  unpack_directions(packed, 1, &u, &v, &w);
  EXPECT_EQ(u, 0);
  EXPECT_EQ(v, 0);
  EXPECT_EQ(w, 0);
}

TEST(CompactColumns, WeightsAreHalves) {
  // Each half stands for itself.
  for (std::uint32_t half = 0; half < 0x7c00; ++half) {
    const auto bits = static_cast<std::uint16_t>(half);
    const double expected = half < 0x400 ? std::ldexp(half, -24)
                                         : std::ldexp(1 + (half & 0x3ff) / 1024.0, static_cast<int>(half >> 10) - 15);
    float value;
    unpack_weights(reinterpret_cast<const char*>(&bits), 1, &value);
    ASSERT_EQ(value, expected) << half;
    std::uint16_t back;
    pack_weights(&value, 1, reinterpret_cast<char*>(&back));
    ASSERT_EQ(back, bits);
  }
  std::mt19937 random(2);
  std::uniform_real_distribution<float> exponent(-30, 40);
  for (int n = 0; n < 1'000'000; ++n) {
    const float weight = std::exp2(exponent(random));
    std::uint16_t packed;
    float back;
    pack_weights(&weight, 1, reinterpret_cast<char*>(&packed));
    unpack_weights(reinterpret_cast<const char*>(&packed), 1, &back);
    if (weight >= 65504) {
      ASSERT_EQ(back, 65504);
    } else if (weight >= 6.1035156e-5f) {
      ASSERT_LE(std::fabs(back / weight - 1), 0x1p-11f) << weight;
    } else {
      ASSERT_LE(std::fabs(back - weight), 0x1p-25f) << weight;
    }
  }
}

// Through a server: what is packed is as close as stated, the rest has its bits.
TEST(CompactColumns, AnswersAreHalf) {
  const testing::TemporaryFolder folder;
  const std::string address = "unix:" + folder.path("s");
  const testing::ServerProcess server({"--listen", address});
  ASSERT_TRUE(server.ready());
  ConnectOptions options;
  options.compact_answers = true;
  options.piece_bytes = 50'000;
  const auto engine = connect(std::span(&address, 1), options);
  ASSERT_TRUE(engine.ok()) << engine.status();
  constexpr std::size_t kLanes = 70'001;
  // x, y, z, m.x, m.y, m.z, pdf; weights with gaps.
  std::vector<std::vector<float>> here(7, std::vector<float>(kLanes, -7)), there = here;
  std::vector<float> weight_here(2 * kLanes, -7), weight_there = weight_here;
  std::vector<std::uint8_t> status_here(kLanes), status_there(kLanes);
  Batch batch;
  batch.lanes = kLanes;
  std::vector<float> alpha(kLanes);
  for (std::size_t k = 0; k < kLanes; ++k) alpha[k] = k % 100 == 3 ? -1 : static_cast<float>(k) / kLanes;
  batch.incident = {0.6f, 0.0f, 0.8f};
  batch.alpha_x = batch.alpha_y = alpha;
  batch.sampler = Sampler::cap;
  batch.generator = {.seed = 3};
  const auto outputs = [&](std::vector<std::vector<float>>& columns, std::vector<float>& weight,
                           std::vector<std::uint8_t>& status) {
    batch.out.outgoing = {columns[0], columns[1], columns[2]};
    batch.out.normal = {columns[3], columns[4], columns[5]};
    batch.out.pdf = columns[6];
    batch.out.weight = {weight.data(), kLanes, 8};
    batch.out.status = status;
  };
  outputs(here, weight_here, status_here);
  const auto wanted = sample_reflection(batch);
  outputs(there, weight_there, status_there);
  const auto got = (*engine)->sample_reflection(batch);
  ASSERT_TRUE(wanted.ok() && got.ok()) << got.status();
  EXPECT_EQ(*wanted, *got);
  EXPECT_EQ(here[6], there[6]);
  EXPECT_EQ(status_here, status_there);
  for (std::size_t k = 0; k < kLanes; ++k) {
    for (const int m : {0, 3}) {
      const double chord = std::hypot(double{here[m][k]} - there[m][k], double{here[m + 1][k]} - there[m + 1][k],
                                      double{here[m + 2][k]} - there[m + 2][k]);
      ASSERT_LE(chord, 8e-5) << k;
      ASSERT_EQ(here[m + 2][k] > 0, there[m + 2][k] > 0) << k;
    }
    ASSERT_NEAR(weight_there[2 * k], weight_here[2 * k], std::max(weight_here[2 * k] * 0x1p-11f, 0x1p-25f)) << k;
    ASSERT_EQ(weight_there[2 * k + 1], -7);
  }
  // Of a list of lanes, and one part of a direction alone.
  const std::uint32_t active[] = {9, 2};
  std::fill(there[1].begin(), there[1].end(), -7.0f);
  batch.active = active;
  batch.out = {};
  batch.out.outgoing.y = there[1];
  ASSERT_TRUE((*engine)->sample_reflection(batch).ok());
  EXPECT_NEAR(there[1][9], here[1][9], 8e-5);
  EXPECT_EQ(there[1][3], -7);

  // What could never be held is refused at once.
  v1::BatchRequest large = testing::good_request(1);
  large.set_lanes(4'000'000);
  large.clear_outputs();
  large.add_outputs(v1::OUTGOING);
  large.set_compact_answer(true);

  v1::BatchRequest request = testing::good_request(1000);
  request.clear_outputs();
  for (const v1::Output output : {v1::OUTGOING, v1::PDF, v1::WEIGHT, v1::STATUS}) request.add_outputs(output);
  const auto stub = v1::Sampler::NewStub(testing::open_channel(address));
  std::size_t bytes[2];
  for (const bool compact : {false, true}) {
    request.set_compact_answer(compact);
    grpc::ClientContext context;
    v1::BatchResponse response;
    ASSERT_TRUE(stub->Run(&context, request, &response).ok());
    bytes[compact] = response.ByteSizeLong();
  }
  grpc::ClientContext context;
  v1::BatchResponse response;
  const grpc::Status status = stub->Run(&context, large, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(status.error_message().rfind("compact_answer: ", 0), 0u) << status.error_message();
  EXPECT_NEAR(static_cast<double>(bytes[0]), 21'000, 100);
  EXPECT_NEAR(static_cast<double>(bytes[1]), 11'000, 100);
}

}  // namespace
}  // namespace facetwise::wire
