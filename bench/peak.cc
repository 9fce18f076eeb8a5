// SPDX-License-Identifier: Apache-2.0
#include "peak.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bench/peak.cc"
#include "hwy/cache_control.h"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
#include "hwy/highway.h"

#ifndef FACETWISE_BENCH_PEAK_TABLE_
#define FACETWISE_BENCH_PEAK_TABLE_
namespace facetwise::bench {
struct PeakTable {
  std::uint64_t (*multiply_add)(std::uint64_t, float&);
  void (*copy_columns)(const float* const*, int, float* const*, int, std::size_t, std::size_t, bool);
  float (*read_column)(const float*, std::size_t, std::size_t);
};
}  // namespace facetwise::bench
#endif

HWY_BEFORE_NAMESPACE();
namespace facetwise::bench {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

std::uint64_t MultiplyAdd(std::uint64_t rounds, float& sink) {
  const hn::ScalableTag<float> d;
  const auto scale = hn::Set(d, 0.999f), offset = hn::Set(d, 0.001f);
  // Twelve chains cover the latency of four cycles on two units, and fit into 16 registers with the
  // constants.
  auto a = hn::Set(d, 0.1f), b = hn::Set(d, 0.2f), c = hn::Set(d, 0.3f), e = hn::Set(d, 0.4f);
  auto f = hn::Set(d, 0.5f), g = hn::Set(d, 0.6f), h = hn::Set(d, 0.7f), i = hn::Set(d, 0.8f);
  auto j = hn::Set(d, 0.9f), k = hn::Set(d, 1.1f), l = hn::Set(d, 1.2f), m = hn::Set(d, 1.3f);
  for (std::uint64_t round = 0; round < rounds; ++round) {
    a = hn::MulAdd(a, scale, offset);
    b = hn::MulAdd(b, scale, offset);
    c = hn::MulAdd(c, scale, offset);
    e = hn::MulAdd(e, scale, offset);
    f = hn::MulAdd(f, scale, offset);
    g = hn::MulAdd(g, scale, offset);
    h = hn::MulAdd(h, scale, offset);
    i = hn::MulAdd(i, scale, offset);
    j = hn::MulAdd(j, scale, offset);
    k = hn::MulAdd(k, scale, offset);
    l = hn::MulAdd(l, scale, offset);
    m = hn::MulAdd(m, scale, offset);
  }
  const auto sum = ((a + b) + (c + e)) + ((f + g) + (h + i)) + ((j + k) + (l + m));
  sink = hn::GetLane(hn::SumOfLanes(d, sum));
  return rounds * 12 * 2 * hn::Lanes(d);
}

template <bool kStreaming, class D, class V>
HWY_INLINE void Put(V v, D d, float* to) {
  if constexpr (kStreaming && HWY_ARCH_X86 && hn::MaxLanes(D()) >= 8) {
    hn::Stream(v, d, to);
  } else {
    hn::StoreU(v, d, to);
  }
}

// Fixed numbers of columns, so that a vector of each is all that an iteration does.
template <int kInputs, int kOutputs, bool kStreaming>
void CopyFixed(const float* const* inputs, float* const* outputs, std::size_t begin, std::size_t end) {
  const hn::ScalableTag<float> d;
  for (std::size_t lane = begin; lane < end; lane += hn::Lanes(d)) {
    for (int k = 0; k < kOutputs - 1; ++k) Put<kStreaming>(hn::LoadU(d, inputs[k] + lane), d, outputs[k] + lane);
    auto sum = hn::LoadU(d, inputs[kOutputs - 1] + lane);
    for (int k = kOutputs; k < kInputs; ++k) sum = sum + hn::LoadU(d, inputs[k] + lane);
    Put<kStreaming>(sum, d, outputs[kOutputs - 1] + lane);
  }
}

template <bool kStreaming>
void CopyColumnsBy(const float* const* inputs, int input_count, float* const* outputs, int output_count,
                   std::size_t begin, std::size_t end) {
  const auto shape = [&](int in, int out) HWY_ATTR { return input_count == in && output_count == out; };
  if (shape(5, 4)) return CopyFixed<5, 4, kStreaming>(inputs, outputs, begin, end);
  if (shape(6, 4)) return CopyFixed<6, 4, kStreaming>(inputs, outputs, begin, end);
  if (shape(7, 4)) return CopyFixed<7, 4, kStreaming>(inputs, outputs, begin, end);
  if (shape(8, 4)) return CopyFixed<8, 4, kStreaming>(inputs, outputs, begin, end);
  if (shape(8, 2)) return CopyFixed<8, 2, kStreaming>(inputs, outputs, begin, end);
  if (shape(8, 1)) return CopyFixed<8, 1, kStreaming>(inputs, outputs, begin, end);
  if (shape(5, 1)) return CopyFixed<5, 1, kStreaming>(inputs, outputs, begin, end);
  const hn::ScalableTag<float> d;
  for (std::size_t lane = begin; lane < end; lane += hn::Lanes(d)) {
    auto sum = hn::Zero(d);
    for (int k = 0; k < input_count; ++k) {
      const auto value = hn::LoadU(d, inputs[k] + lane);
      if (k < output_count - 1)
        Put<kStreaming>(value, d, outputs[k] + lane);
      else
        sum = sum + value;
    }
    Put<kStreaming>(sum, d, outputs[output_count - 1] + lane);
  }
}

void CopyColumns(const float* const* inputs, int input_count, float* const* outputs, int output_count,
                 std::size_t begin, std::size_t end, bool streaming) {
  if (!streaming) return CopyColumnsBy<false>(inputs, input_count, outputs, output_count, begin, end);
  CopyColumnsBy<true>(inputs, input_count, outputs, output_count, begin, end);
  hwy::FlushStream();
}

float ReadColumn(const float* column, std::size_t begin, std::size_t end) {
  const hn::ScalableTag<float> d;
  auto a = hn::Zero(d), b = a, c = a, e = a;
  const std::size_t lanes = hn::Lanes(d);
  std::size_t lane = begin;
  for (; lane + 4 * lanes <= end; lane += 4 * lanes) {
    a = a + hn::LoadU(d, column + lane);
    b = b + hn::LoadU(d, column + lane + lanes);
    c = c + hn::LoadU(d, column + lane + 2 * lanes);
    e = e + hn::LoadU(d, column + lane + 3 * lanes);
  }
  for (; lane < end; lane += lanes) a = a + hn::LoadU(d, column + lane);
  return hn::GetLane(hn::SumOfLanes(d, (a + b) + (c + e)));
}

extern const PeakTable kPeakTable;
const PeakTable kPeakTable = {MultiplyAdd, CopyColumns, ReadColumn};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise::bench
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace facetwise::bench {
namespace {

const PeakTable& table(Target target) {
  switch (resolve(target).value_or(Target::scalar)) {
#if HWY_TARGETS & HWY_AVX3
    case Target::avx3: return N_AVX3::kPeakTable;
#endif
#if HWY_TARGETS & HWY_AVX2
    case Target::avx2: return N_AVX2::kPeakTable;
#endif
#if HWY_TARGETS & HWY_NEON
    case Target::neon: return N_NEON::kPeakTable;
#endif
    default: return N_SCALAR::kPeakTable;
  }
}

}  // namespace

std::uint64_t multiply_add(Target target, std::uint64_t rounds, float& sink) {
  return table(target).multiply_add(rounds, sink);
}

void copy_columns(Target target, const float* const* inputs, int input_count, float* const* outputs, int output_count,
                  std::size_t begin, std::size_t end, bool streaming) {
  table(target).copy_columns(inputs, input_count, outputs, output_count, begin, end, streaming);
}

float read_column(Target target, const float* column, std::size_t begin, std::size_t end) {
  return table(target).read_column(column, begin, end);
}

}  // namespace facetwise::bench
#endif  // HWY_ONCE
