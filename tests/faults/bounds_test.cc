// SPDX-License-Identifier: Apache-2.0
// Nothing is read or written outside the columns: buffers of exactly the size, so that AddressSanitizer sees
// an overrun, and others amid NaN and guard values, so that any build does.
#include <bit>
#include <cstring>
#include <memory>

#include "faults/malformed_call.h"
#include "support/counts.h"

namespace facetwise::test {
namespace {

constexpr float kGuard = -3.25f;

// A column of exactly the bytes that it needs, on the heap.
class Exact {
 public:
  Exact(const std::vector<float>& values, std::size_t stride)
      : stride_(stride), count_(values.size()), bytes_(new char[size()]) {
    std::memset(bytes_.get(), 0xFF, size());
    for (std::size_t lane = 0; lane < count_; ++lane) std::memcpy(bytes_.get() + lane * stride, &values[lane], 4);
  }
  std::size_t size() const { return count_ == 0 ? 0 : (count_ - 1) * stride_ + 4; }
  float* data() const { return reinterpret_cast<float*>(bytes_.get()); }
  float get(std::size_t lane) const {
    float value;
    std::memcpy(&value, bytes_.get() + lane * stride_, 4);
    return value;
  }
  bool gaps_are_whole() const {
    for (std::size_t byte = 0; byte < size(); ++byte)
      if (byte % stride_ >= 4 && bytes_[byte] != '\xFF') return false;
    return true;
  }

 private:
  std::size_t stride_, count_;
  std::unique_ptr<char[]> bytes_;
};

TEST(Bounds, ExactlySizedBuffers) {
  for (const Call& call : plain_calls())
    for (const std::size_t stride : {4u, 8u, 12u, 28u})
      for (std::size_t count = 0; count <= 40; ++count) {
        const Lanes lanes = adversarial_lanes(count, 100 + count);
        const Answer expected = run_call(call, lanes);
        Answer answer;
        Batch batch = make_batch(call, lanes, answer);
        std::vector<Exact> in, out;
        for (std::size_t k = 0; k < lanes.in.size(); ++k) {
          auto& column = input_fields()[k].column(batch);
          if (column.present()) column = {in.emplace_back(lanes.in[k], stride).data(), count, stride};
        }
        std::vector<std::size_t> written;
        for (std::size_t k = 0; k < answer.out.size(); ++k) {
          auto& column = output_fields()[k].column(batch);
          if (!column.present()) continue;
          column = {out.emplace_back(std::vector<float>(count, kGuard), stride).data(), count, stride};
          written.push_back(k);
        }
        const std::unique_ptr<std::uint8_t[]> status(new std::uint8_t[count]);
        batch.out.status = {status.get(), count};
        const auto statistics = run(call.operation, batch);
        ASSERT_TRUE(statistics.ok()) << statistics.status();
        ASSERT_EQ(*statistics, expected.statistics);
        ASSERT_EQ(statistics->lanes(), count);
        for (std::size_t lane = 0; lane < count; ++lane) {
          ASSERT_EQ(status[lane], expected.status[lane]);
          for (std::size_t c = 0; c < written.size(); ++c)
            ASSERT_EQ(std::bit_cast<std::uint32_t>(out[c].get(lane)),
                      std::bit_cast<std::uint32_t>(expected.out[written[c]][lane]))
                << call_name(call) << ", " << output_fields()[written[c]].name << ", lane " << lane << " of " << count;
        }
        for (const Exact& column : out) ASSERT_TRUE(column.gaps_are_whole());
        for (const Exact& column : in) ASSERT_TRUE(column.gaps_are_whole());
      }
}

// Every column contiguous, in the midst of NaN (inputs) and guard values (outputs), with a shift of 0 to 4
// floats.
TEST(Bounds, GuardsAroundColumns) {
  constexpr std::size_t kGuards = 48;  // more than the widest pair of vectors
  for (const Call& call : plain_calls())
    for (const std::size_t count : {1u, 7u, 15u, 16u, 17u, 31u, 32u, 33u, 511u, 530u}) {
      const Lanes lanes = adversarial_lanes(count, 200 + count);
      const Answer expected = run_call(call, lanes);
      Answer answer;
      Batch batch = make_batch(call, lanes, answer);
      std::vector<std::vector<float>> in(lanes.in.size()), out(answer.out.size());
      const auto shifted = [&](std::size_t k) { return kGuards + k % 5; };
      for (std::size_t k = 0; k < in.size(); ++k) {
        auto& column = input_fields()[k].column(batch);
        if (!column.present()) continue;
        in[k].assign(count + 2 * kGuards + 5, std::bit_cast<float>(~0u));
        std::copy(lanes.in[k].begin(), lanes.in[k].end(), in[k].begin() + static_cast<std::ptrdiff_t>(shifted(k)));
        column = {in[k].data() + shifted(k), count};
      }
      for (std::size_t k = 0; k < out.size(); ++k) {
        auto& column = output_fields()[k].column(batch);
        if (!column.present()) continue;
        out[k].assign(count + 2 * kGuards + 5, kGuard);
        column = {out[k].data() + shifted(k), count};
      }
      std::vector<std::uint8_t> status(count + 2 * kGuards, 99);
      batch.out.status = {status.data() + kGuards, count};
      ASSERT_TRUE(run(call.operation, batch).ok());
      for (std::size_t k = 0; k < out.size(); ++k)
        for (std::size_t n = 0; n < out[k].size(); ++n) {
          const std::size_t lane = n - shifted(k);  // wraps below the column
          ASSERT_EQ(std::bit_cast<std::uint32_t>(out[k][n]),
                    std::bit_cast<std::uint32_t>(lane < count ? expected.out[k][lane] : kGuard))
              << call_name(call) << ", " << output_fields()[k].name << ", " << count << " lanes";
        }
      for (std::size_t n = 0; n < status.size(); ++n)
        ASSERT_EQ(status[n], n - kGuards < count ? expected.status[n - kGuards] : 99);
    }
}

}  // namespace
}  // namespace facetwise::test
