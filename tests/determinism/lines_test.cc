// SPDX-License-Identifier: Apache-2.0
// Where columns lie in their cache lines changes nothing, and nothing is touched outside of them: all at one offset and
// each at its own, at the edge of pages that cannot be read or written, with streaming stores and without.
#include <sys/mman.h>
#include <unistd.h>

#include <cstring>

#include "determinism/compare.h"
#include "support/counts.h"
#include "support/hard_lanes.h"

namespace facetwise::test {
namespace {

constexpr std::size_t kLine = 16;     // floats
constexpr std::size_t kLanes = 1100;  // and up to a line more: beyond the lengths that are not aligned
constexpr unsigned char kUntouched = 0xA5;

// Whole pages, with one on either side that nobody may touch.
class GuardedPages {
 public:
  explicit GuardedPages(std::size_t bytes)
      : page_(static_cast<std::size_t>(sysconf(_SC_PAGESIZE))), size_((bytes + page_ - 1) / page_ * page_) {
    void* all = mmap(nullptr, size_ + 2 * page_, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    EXPECT_NE(all, MAP_FAILED);
    begin_ = static_cast<unsigned char*>(all) + page_;
    EXPECT_EQ(mprotect(begin_, size_, PROT_READ | PROT_WRITE), 0);
  }
  ~GuardedPages() { munmap(begin_ - page_, size_ + 2 * page_); }
  GuardedPages(const GuardedPages&) = delete;
  GuardedPages& operator=(const GuardedPages&) = delete;

  // Memory of a column, `gap` bytes after the front page or before the one behind.
  void* at_front(std::size_t bytes, std::size_t gap) { return place(gap, bytes); }
  void* at_back(std::size_t bytes, std::size_t gap) { return place(size_ - bytes - gap, bytes); }
  bool rest_is_untouched() const {
    for (std::size_t k = 0; k < size_; ++k)
      if ((k < used_ || k >= used_ + bytes_) && begin_[k] != kUntouched) return false;
    return true;
  }

 private:
  void* place(std::size_t from, std::size_t bytes) {
    used_ = from;
    bytes_ = bytes;
    std::memset(begin_, kUntouched, size_);
    return begin_ + from;
  }
  std::size_t page_, size_, used_ = 0, bytes_ = 0;
  unsigned char* begin_ = nullptr;
};

enum class Edge { front, back };

class CacheLines : public ::testing::Test {
 protected:
  CacheLines() {
    constexpr std::size_t kBytes = (kLanes + 3 * kLine) * sizeof(float);
    for (std::size_t k = 0; k < input_fields().size(); ++k) in_.push_back(std::make_unique<GuardedPages>(kBytes));
    for (std::size_t k = 0; k < output_fields().size(); ++k) out_.push_back(std::make_unique<GuardedPages>(kBytes));
    for (std::size_t k = 0; k < byte_fields().size(); ++k) bytes_.push_back(std::make_unique<GuardedPages>(kBytes));
  }

  // gap(n): of the n-th column, in floats (in bytes for byte columns).
  template <class Gap>
  void expect_same_at(const Call& call, const Lanes& lanes, const Answer& expected, Edge edge, const Gap& gap,
                      const Execution& execution) {
    const auto placed = [&](GuardedPages& pages, std::size_t width, std::size_t n) {
      const std::size_t bytes = lanes.count * width;
      return edge == Edge::front ? pages.at_front(bytes, gap(n) * width) : pages.at_back(bytes, gap(n) * width);
    };
    Answer got;
    Batch batch = make_batch(call, lanes, got);
    std::size_t n = 0;
    for (std::size_t k = 0; k < in_.size(); ++k) {
      if (!reads(call, input_fields()[k])) continue;
      auto* memory = static_cast<float*>(placed(*in_[k], sizeof(float), n++));
      std::memcpy(memory, lanes.in[k].data(), lanes.count * sizeof(float));
      input_fields()[k].column(batch) = {memory, lanes.count};
    }
    std::vector<std::pair<std::size_t, float*>> written;
    for (std::size_t k = 0; k < out_.size(); ++k) {
      if (!writes(call, output_fields()[k])) continue;
      written.emplace_back(k, static_cast<float*>(placed(*out_[k], sizeof(float), n++)));
      output_fields()[k].column(batch) = {written.back().second, lanes.count};
    }
    std::uint8_t* byte_columns[] = {nullptr, nullptr};
    for (std::size_t k = 0; k < bytes_.size(); ++k) {
      if (!writes(call, byte_fields()[k])) continue;
      byte_columns[k] = static_cast<std::uint8_t*>(placed(*bytes_[k], 1, n++));
      byte_fields()[k].column(batch) = {byte_columns[k], lanes.count};
    }
    got.statistics = run_ok(call, batch, execution);
    for (const auto& [k, memory] : written) {
      got.out[k].assign(memory, memory + lanes.count);
      EXPECT_TRUE(out_[k]->rest_is_untouched()) << output_fields()[k].name;
    }
    got.status.assign(byte_columns[0], byte_columns[0] + lanes.count);
    if (byte_columns[1] != nullptr) got.event.assign(byte_columns[1], byte_columns[1] + lanes.count);
    expect_same(call, expected, got);
  }

  std::vector<std::unique_ptr<GuardedPages>> in_, out_, bytes_;
};

std::vector<std::size_t> offsets() {
  if (kQuick) return {0, 1, 12};
  std::vector<std::size_t> all;
  for (std::size_t k = 0; k < kLine; ++k) all.push_back(k);
  return all;
}

TEST_F(CacheLines, EveryOffsetOfAllColumns) {
  for (const std::size_t offset : offsets()) {
    SCOPED_TRACE("offset of " + std::to_string(offset) + " floats");
    const Lanes lanes = hard_lanes(Kind::mixed, kLanes + offset, 71 + offset);
    for (const Call& call : all_calls()) {
      const Answer expected = compute(call, lanes, {.stores = Stores::cached});
      for (const Stores stores : {Stores::streaming, Stores::cached}) {
        expect_same_at(call, lanes, expected, Edge::front, [&](std::size_t) { return offset; }, {.stores = stores});
        // Ends at the page: begins at every offset as the length goes.
        expect_same_at(call, lanes, expected, Edge::back, [](std::size_t) { return std::size_t{0}; },
                       {.stores = stores});
      }
      if (HasFailure()) return;
    }
  }
}

TEST_F(CacheLines, EveryColumnAtItsOwnOffset) {
  const Lanes lanes = hard_lanes(Kind::mixed, kLanes, 91);
  std::uint64_t seed = 92;
  for (const Call& call : all_calls()) {
    const Answer expected = compute(call, lanes, {.stores = Stores::cached});
    for (int round = 0; round < (kQuick ? 1 : 6); ++round) {
      ++seed;
      const auto any = [&](std::size_t n) { return static_cast<std::size_t>(hash(seed, n) % kLine); };
      // Most at one offset, some elsewhere: only those are streamed.
      const auto few_differ = [&](std::size_t n) { return n % 5 == 3 ? any(n) : any(0); };
      for (const Target target : available_targets()) {
        const Execution execution = {.target = target, .stores = Stores::streaming};
        expect_same_at(call, lanes, expected, round % 2 == 0 ? Edge::front : Edge::back, any, execution);
        expect_same_at(call, lanes, expected, round % 2 == 0 ? Edge::back : Edge::front, few_differ, execution);
      }
    }
    if (HasFailure()) return;
  }
}

// Streamed ranges of several threads, outputs over inputs among them.
TEST_F(CacheLines, StreamsOfManyThreads) {
  const std::size_t count = kQuick ? 20'003 : 200'003;
  const Lanes lanes = hard_lanes(Kind::mixed, count, 93);
  for (const Call& call : plain_calls()) {
    const Answer expected = compute(call, lanes, {.threads = Threads::one, .stores = Stores::cached});
    expect_same(call, expected, compute(call, lanes, {.threads = Threads::several, .stores = Stores::streaming}));
    Lanes over = lanes;
    Answer got;
    Batch batch = make_batch(call, over, got);
    std::size_t to = 0;
    for (std::size_t k = 0; k < got.out.size(); ++k)
      if (writes(call, output_fields()[k])) output_fields()[k].column(batch) = {over.in[to++].data(), count};
    got.statistics = run_ok(call, batch, {.threads = Threads::several, .stores = Stores::streaming});
    to = 0;
    for (std::size_t k = 0; k < got.out.size(); ++k)
      if (writes(call, output_fields()[k])) got.out[k] = over.in[to++];
    expect_same(call, expected, got);
    if (HasFailure()) return;
  }
}

}  // namespace
}  // namespace facetwise::test
