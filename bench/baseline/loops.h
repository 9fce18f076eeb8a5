// SPDX-License-Identifier: Apache-2.0
// The baseline's loops. Model and sampler are template arguments, as they would be fixed in a renderer's loop, and
// what the loop has no use for (the weight) is not computed.
#pragma once

#include "bench/baseline/baseline.h"
#include "bench/baseline/loop.h"

// Outputs are no inputs: without a promise, vectorised code would test every pair of columns first.
#ifdef FACETWISE_BASELINE_VECTORISED
#define FACETWISE_LOOP _Pragma("GCC ivdep") for
#define FACETWISE_FLATTEN [[gnu::flatten]]  // calls are not vectorised
#else
#define FACETWISE_LOOP for
#define FACETWISE_FLATTEN
#endif

namespace facetwise::baseline {
inline namespace FACETWISE_BASELINE_BUILD {

#ifdef FACETWISE_BASELINE_VECTORISED
struct In {
  explicit In(const LoopColumn& column) : data(column.data) {}
  float operator[](std::size_t lane) const { return data[lane]; }
  const float* data;
};
using Count = std::uint32_t;  // as wide as the lanes
#else
struct In {
  explicit In(const LoopColumn& column) : data(column.data), step(column.step) {}
  float operator[](std::size_t lane) const { return data[lane * step]; }
  const float* data;
  std::size_t step;
};
using Count = std::uint64_t;
#endif

struct Inputs {
  explicit Inputs(const Loop& loop)
      : lanes(loop.lanes), ix(loop.ix), iy(loop.iy), iz(loop.iz), ax(loop.alpha_x), ay(loop.alpha_y) {}
  Vector i(std::size_t lane) const { return {ix[lane], iy[lane], iz[lane]}; }
  std::size_t lanes;
  In ix, iy, iz, ax, ay;
};

// Where the engine's sampler reads it, so that the column is there.
template <Model model, Sampler sampler>
constexpr bool needs_u3 =
    model.masking == Masking::vcavity ? sampler == Sampler::exact || sampler == Sampler::visible
                                      : sampler == Sampler::exact&& model.distribution == Distribution::ggx;

template <Model model, Sampler sampler>
FACETWISE_FLATTEN std::uint64_t sample_normals(const Loop& loop) {
  const Inputs in(loop);
  const In u1(loop.u1), u2(loop.u2), u3(needs_u3<model, sampler> ? loop.u3 : loop.u2);
  float *mx = loop.x, *my = loop.y, *mz = loop.z, *pdf = loop.pdf;
  Count occluded = 0;
  FACETWISE_LOOP(std::size_t lane = 0; lane < in.lanes; ++lane) {
    const auto s = sample_normal(model, sampler, in.i(lane), in.ax[lane], in.ay[lane], u1[lane], u2[lane], u3[lane]);
    mx[lane] = s.m.x;
    my[lane] = s.m.y;
    mz[lane] = s.m.z;
    pdf[lane] = s.pdf;
    occluded += !s.accepted;
  }
  return occluded;
}

template <Model model, Sampler sampler>
FACETWISE_FLATTEN std::uint64_t sample_reflections(const Loop& loop) {
  const Inputs in(loop);
  const In u1(loop.u1), u2(loop.u2), u3(needs_u3<model, sampler> ? loop.u3 : loop.u2);
  float *ox = loop.x, *oy = loop.y, *oz = loop.z, *pdf = loop.pdf;
  Count occluded = 0;
  FACETWISE_LOOP(std::size_t lane = 0; lane < in.lanes; ++lane) {
    const auto s = sample_reflection(model, sampler, Shadowing::correlated, in.i(lane), in.ax[lane], in.ay[lane],
                                     u1[lane], u2[lane], u3[lane]);
    ox[lane] = s.o.x;
    oy[lane] = s.o.y;
    oz[lane] = s.o.z;
    pdf[lane] = s.pdf;
    occluded += !s.accepted;
  }
  return occluded;
}

// Where both are wanted both functions are called: the baseline has none that shares their work.
template <Model model, Sampler sampler, bool want_value, bool want_pdf>
FACETWISE_FLATTEN std::uint64_t query(const Loop& loop) {
  const Inputs in(loop);
  const In ox(loop.ox), oy(loop.oy), oz(loop.oz);
  float *value = loop.value, *pdf = loop.pdf;
  Count occluded = 0;
  FACETWISE_LOOP(std::size_t lane = 0; lane < in.lanes; ++lane) {
    const Vector i = in.i(lane), o = {ox[lane], oy[lane], oz[lane]};
    if constexpr (want_value)
      value[lane] = evaluate_reflection(model, Shadowing::correlated, i, o, in.ax[lane], in.ay[lane]);
    if constexpr (want_pdf) pdf[lane] = pdf_reflection(model, sampler, i, o, in.ax[lane], in.ay[lane]);
    occluded += o.z <= 0;
  }
  return occluded;
}

template <Model model>
FACETWISE_FLATTEN std::uint64_t mask(const Loop& loop) {
  const Inputs in(loop);
  float* g1 = loop.masking_g1;
  FACETWISE_LOOP(std::size_t lane = 0; lane < in.lanes; ++lane)
  g1[lane] = masking(model, in.i(lane), in.ax[lane], in.ay[lane]);
  return 0;
}

template <Model model, Sampler sampler>
std::uint64_t run_sampler(const Loop& loop) {
  switch (loop.operation) {
    case Operation::sample_normal: return sample_normals<model, sampler>(loop);
    case Operation::sample_reflection: return sample_reflections<model, sampler>(loop);
    case Operation::pdf_reflection: return query<model, sampler, false, true>(loop);
    case Operation::evaluate_reflection:
      return loop.pdf == nullptr ? query<model, sampler, true, false>(loop) : query<model, sampler, true, true>(loop);
    case Operation::masking: return mask<model>(loop);
    default: return 0;  // not for dielectrics
  }
}

template <Model model>
std::uint64_t run_model(const Loop& loop) {
  const auto with = [&]<Sampler sampler>() -> std::uint64_t {
    if constexpr (has_baseline(model, sampler)) return run_sampler<model, sampler>(loop);
    return 0;
  };
  // What has no use for a sampler is the same of each.
  if (loop.operation == Operation::masking || (loop.operation == Operation::evaluate_reflection && loop.pdf == nullptr))
    return with.template operator()<Sampler::ndf>();
  switch (loop.sampler) {
    case Sampler::ndf: return with.template operator()<Sampler::ndf>();
    case Sampler::heitz: return with.template operator()<Sampler::heitz>();
    case Sampler::cap: return with.template operator()<Sampler::cap>();
    case Sampler::bounded: return with.template operator()<Sampler::bounded>();
    case Sampler::exact: return with.template operator()<Sampler::exact>();
    case Sampler::visible: return with.template operator()<Sampler::visible>();
  }
  return 0;
}

}  // namespace FACETWISE_BASELINE_BUILD
}  // namespace facetwise::baseline
