// The baseline's loops. Model and sampler are template arguments, as they would be fixed in a renderer's loop, and
// what the loop has no use for (the weight) is not computed.
#include "facetwise/baseline.h"
#include "runner.h"

namespace facetwise::bench {
namespace {

// The columns of a batch as plain pointers with a step: 1 for a value per lane, 0 for one value.
struct In {
  explicit In(const Column<float>& column) : data(column.data()), step(column.one_value() ? 0 : 1) {}
  float operator[](std::size_t lane) const { return data[lane * step]; }
  const float* data;
  std::size_t step;
};

struct Inputs {
  explicit Inputs(const Batch& batch)
      : lanes(batch.lanes),
        ix(batch.incident.x),
        iy(batch.incident.y),
        iz(batch.incident.z),
        ax(batch.alpha_x),
        ay(batch.alpha_y) {}
  baseline::Vector i(std::size_t lane) const { return {ix[lane], iy[lane], iz[lane]}; }
  std::size_t lanes;
  In ix, iy, iz, ax, ay;
};

template <baseline::Model model, Sampler sampler>
constexpr bool needs_u3 = sampler == Sampler::exact || (sampler == Sampler::visible && model.masking == Masking::vcavity);

template <baseline::Model model, Sampler sampler>
std::uint64_t sample_normals(const Batch& batch) {
  const Inputs in(batch);
  const In u1(batch.u1), u2(batch.u2), u3(needs_u3<model, sampler> ? batch.u3 : batch.u2);
  float *mx = batch.out.normal.x.data(), *my = batch.out.normal.y.data(), *mz = batch.out.normal.z.data();
  float* pdf = batch.out.pdf.data();
  std::uint64_t occluded = 0;
  for (std::size_t lane = 0; lane < in.lanes; ++lane) {
    const auto s = baseline::sample_normal(model, sampler, in.i(lane), in.ax[lane], in.ay[lane], u1[lane],
                                           u2[lane], u3[lane]);
    mx[lane] = s.m.x;
    my[lane] = s.m.y;
    mz[lane] = s.m.z;
    pdf[lane] = s.pdf;
    occluded += !s.accepted;
  }
  return occluded;
}

template <baseline::Model model, Sampler sampler>
std::uint64_t sample_reflections(const Batch& batch) {
  const Inputs in(batch);
  const In u1(batch.u1), u2(batch.u2), u3(needs_u3<model, sampler> ? batch.u3 : batch.u2);
  float *ox = batch.out.outgoing.x.data(), *oy = batch.out.outgoing.y.data(),
        *oz = batch.out.outgoing.z.data();
  float* pdf = batch.out.pdf.data();
  std::uint64_t occluded = 0;
  for (std::size_t lane = 0; lane < in.lanes; ++lane) {
    const auto s = baseline::sample_reflection(model, sampler, Shadowing::correlated, in.i(lane), in.ax[lane],
                                               in.ay[lane], u1[lane], u2[lane], u3[lane]);
    ox[lane] = s.o.x;
    oy[lane] = s.o.y;
    oz[lane] = s.o.z;
    pdf[lane] = s.pdf;
    occluded += !s.accepted;
  }
  return occluded;
}

// evaluate_and_pdf calls both functions: the baseline has none that shares their work.
template <baseline::Model model, Sampler sampler, bool want_value, bool want_pdf>
std::uint64_t query(const Batch& batch) {
  const Inputs in(batch);
  const In ox(batch.outgoing.x), oy(batch.outgoing.y), oz(batch.outgoing.z);
  float *value = batch.out.value.data(), *pdf = batch.out.pdf.data();
  std::uint64_t occluded = 0;
  for (std::size_t lane = 0; lane < in.lanes; ++lane) {
    const baseline::Vector i = in.i(lane), o = {ox[lane], oy[lane], oz[lane]};
    if constexpr (want_value)
      value[lane] = baseline::evaluate_reflection(model, Shadowing::correlated, i, o, in.ax[lane], in.ay[lane]);
    if constexpr (want_pdf) pdf[lane] = baseline::pdf_reflection(model, sampler, i, o, in.ax[lane], in.ay[lane]);
    occluded += o.z <= 0;
  }
  return occluded;
}

template <baseline::Model model>
std::uint64_t mask(const Batch& batch) {
  const Inputs in(batch);
  float* masking = batch.out.masking.data();
  for (std::size_t lane = 0; lane < in.lanes; ++lane)
    masking[lane] = baseline::masking(model, in.i(lane), in.ax[lane], in.ay[lane]);
  return 0;
}

template <baseline::Model model, Sampler sampler>
std::uint64_t run_sampler(Operation operation, const Batch& batch) {
  switch (operation) {
    case Operation::sample_normal:
      return sample_normals<model, sampler>(batch);
    case Operation::sample_reflection:
      return sample_reflections<model, sampler>(batch);
    case Operation::pdf_reflection:
      return query<model, sampler, false, true>(batch);
    case Operation::evaluate_reflection:
      return query<model, sampler, true, false>(batch);
    case Operation::evaluate_and_pdf:
      return query<model, sampler, true, true>(batch);
    case Operation::masking:
      return mask<model>(batch);
    default:
      return 0;  // there are none of dielectrics
  }
}

template <baseline::Model model>
std::uint64_t run_model(Operation operation, const Batch& batch) {
  const auto with = [&]<Sampler sampler>() -> std::uint64_t {
    if constexpr (baseline::has_baseline(model, sampler)) return run_sampler<model, sampler>(operation, batch);
    return 0;
  };
  // What has no use for a sampler is the same of each.
  if (operation == Operation::evaluate_reflection || operation == Operation::masking)
    return with.template operator()<Sampler::ndf>();
  switch (batch.sampler) {
    case Sampler::ndf:
      return with.template operator()<Sampler::ndf>();
    case Sampler::heitz:
      return with.template operator()<Sampler::heitz>();
    case Sampler::cap:
      return with.template operator()<Sampler::cap>();
    case Sampler::bounded:
      return with.template operator()<Sampler::bounded>();
    case Sampler::exact:
      return with.template operator()<Sampler::exact>();
    case Sampler::visible:
      return with.template operator()<Sampler::visible>();
  }
  return 0;
}

template <Masking masking>
std::uint64_t run_masking(Operation operation, const Batch& batch) {
  switch (batch.model.distribution) {
    case Distribution::ggx:
      return run_model<baseline::Model{Distribution::ggx, masking}>(operation, batch);
    case Distribution::beckmann:
      return run_model<baseline::Model{Distribution::beckmann, masking}>(operation, batch);
    case Distribution::student_t:
      return run_model<baseline::Model{Distribution::student_t, masking}>(operation, batch);
    default:
      return 0;
  }
}

}  // namespace

std::uint64_t run_scalar(Operation operation, const Batch& batch) {
  return batch.model.masking == Masking::smith ? run_masking<Masking::smith>(operation, batch)
                                               : run_masking<Masking::vcavity>(operation, batch);
}

}  // namespace facetwise::bench
