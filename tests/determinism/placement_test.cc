// SPDX-License-Identifier: Apache-2.0
// Where columns lie changes nothing: any 4-byte alignment, any stride, each column its own.
#include <cstring>
#include <memory>

#include "determinism/compare.h"
#include "support/hard_lanes.h"

namespace facetwise::test {
namespace {

// Memory of exactly as many bytes as a strided column needs, the first value `offset` bytes in.
template <class T>
class Strided {
 public:
  Strided(std::size_t count, std::size_t stride, std::size_t offset)
      : stride_(stride),
        offset_(offset),
        count_(count),
        size_(offset + (count == 0 ? 0 : (count - 1) * stride + sizeof(T))),
        bytes_(new unsigned char[size_]) {
    std::memset(bytes_.get(), kPadding, size_);
  }
  void set(std::size_t lane, T value) { std::memcpy(at(lane), &value, sizeof value); }
  T get(std::size_t lane) const {
    T value;
    std::memcpy(&value, at(lane), sizeof value);
    return value;
  }
  Column<T> column() const { return {reinterpret_cast<T*>(at(0)), count_, stride_}; }
  OutputColumn<T> output() const { return {reinterpret_cast<T*>(at(0)), count_, stride_}; }
  // Nothing before, between or behind the values was written.
  bool padding_is_whole() const {
    for (std::size_t k = 0; k < size_; ++k) {
      const bool value = k >= offset_ && (k - offset_) % stride_ < sizeof(T);
      if (!value && bytes_[k] != kPadding) return false;
    }
    return true;
  }

 private:
  static constexpr unsigned char kPadding = 0xFF;  // NaN
  unsigned char* at(std::size_t lane) const { return bytes_.get() + offset_ + lane * stride_; }
  std::size_t stride_, offset_, count_, size_;
  std::unique_ptr<unsigned char[]> bytes_;
};

// Strides of up to 1 + gap values and offsets of up to 16, of the seed's choice for every column.
void expect_same_placed(const Call& call, const Lanes& lanes, const Answer& expected, std::uint64_t seed,
                        std::uint64_t gap, const Execution& execution) {
  std::uint64_t drawn = 0;
  const auto below = [&](std::uint64_t n) { return static_cast<std::size_t>(hash(seed, drawn++) % n); };
  Answer got;
  Batch batch = make_batch(call, lanes, got);
  std::vector<Strided<float>> in, out;
  for (std::size_t k = 0; k < lanes.in.size(); ++k) {
    if (!reads(call, input_fields()[k])) continue;
    const std::size_t stride = 4 * (1 + below(gap + 1)), offset = 4 * below(16);
    auto& memory = in.emplace_back(lanes.count, stride, offset);
    for (std::size_t lane = 0; lane < lanes.count; ++lane) memory.set(lane, lanes.in[k][lane]);
    input_fields()[k].column(batch) = memory.column();
  }
  for (std::size_t k = 0; k < got.out.size(); ++k) {
    if (!writes(call, output_fields()[k])) continue;
    const std::size_t stride = 4 * (1 + below(gap + 1)), offset = 4 * below(16);
    output_fields()[k].column(batch) = out.emplace_back(lanes.count, stride, offset).output();
  }
  const std::size_t status_stride = 1 + below(gap + 1), status_offset = below(64);
  const Strided<std::uint8_t> status(lanes.count, status_stride, status_offset);
  batch.out.status = status.output();

  got.statistics = run_ok(call, batch, execution);
  auto memory = out.begin();
  for (std::size_t k = 0; k < got.out.size(); ++k) {
    if (!writes(call, output_fields()[k])) continue;
    EXPECT_TRUE(memory->padding_is_whole()) << output_fields()[k].name;
    for (std::size_t lane = 0; lane < lanes.count; ++lane) got.out[k][lane] = memory->get(lane);
    ++memory;
  }
  EXPECT_TRUE(status.padding_is_whole());
  for (std::size_t lane = 0; lane < lanes.count; ++lane) got.status[lane] = status.get(lane);
  expect_same(call, expected, got);
}

TEST(Placement, AnyAlignmentOfFourBytes) {
  std::uint64_t seed = 41;
  for (const std::size_t count : {1u, 17u, 64u, 1100u}) {
    const Lanes lanes = hard_lanes(Kind::mixed, count, 42 + count);
    for (const Call& call : all_calls()) {
      const Answer expected = compute(call, lanes);
      for (const Target target : available_targets())
        for (int round = 0; round < 3; ++round)
          expect_same_placed(call, lanes, expected, ++seed, 0, {.target = target});
      if (HasFailure()) return;
    }
  }
}

TEST(Placement, AnyStride) {
  std::uint64_t seed = 1041;
  for (const std::size_t count : {0u, 1u, 2u, 31u, 65u, 1100u}) {
    const Lanes lanes = hard_lanes(Kind::mixed, count, 44 + count);
    for (const Call& call : all_calls()) {
      const Answer expected = compute(call, lanes);
      for (const std::uint64_t gap : {1u, 2u, 12u}) expect_same_placed(call, lanes, expected, ++seed, gap, {});
      if (HasFailure()) return;
    }
  }
}

}  // namespace
}  // namespace facetwise::test
