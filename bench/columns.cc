// SPDX-License-Identifier: Apache-2.0
#include "columns.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <numbers>
#include <string>

#include "absl/strings/str_cat.h"

namespace facetwise::bench {
namespace {

// SplitMix64 (Steele et al. 2014) as a hash of the lane and the column: uniform in [0, 1).
float uniform(std::uint64_t lane, std::uint64_t column) {
  std::uint64_t z = (column << 40 | lane) * 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return static_cast<float>((z ^ (z >> 31)) >> 40) * 0x1p-24f;
}

// Bytes that can be had without swapping; "unlimited" where the system does not say.
std::uint64_t available_memory() {
  std::ifstream meminfo("/proc/meminfo");
  std::string key;
  std::uint64_t kilobytes = 0;
  for (std::string rest; meminfo >> key >> kilobytes && std::getline(meminfo, rest);)
    if (key == "MemAvailable:") return kilobytes * 1024;
  return std::numeric_limits<std::uint64_t>::max();
}

}  // namespace

absl::StatusOr<Columns> Columns::make(std::size_t lanes, std::size_t malloc_lanes) {
  constexpr std::size_t kColumns = std::size_t{kInputs} + kOutputs;
  // Large pieces of memory from malloc are whole pages of which it takes the first 16 bytes itself.
  constexpr std::size_t kPage = 4096 / sizeof(float);
  const std::size_t malloc_stride = malloc_lanes == 0 ? 0 : (malloc_lanes + kMallocOffset + kPage - 1) / kPage * kPage;
  const std::uint64_t bytes = ColumnMemory::bytes(kColumns, lanes) + kColumns * malloc_stride * sizeof(float);
  if (bytes > available_memory() / 10 * 9)
    return absl::ResourceExhaustedError(absl::StrCat("batch: columns of ", lanes, " lanes take ", bytes >> 20,
                                                     " MiB, more than this machine has free; filter for "
                                                     "smaller batches"));
  Columns columns;
  columns.kind_ = ColumnMemory(kColumns, lanes);
  columns.malloc_lanes_ = malloc_lanes;
  columns.malloc_stride_ = malloc_stride;
  columns.malloc_.reset(new (std::align_val_t{4096}) float[kColumns * malloc_stride + kMallocOffset]());
  for (std::size_t k = 0; k < kColumns; ++k) std::fill_n(columns.kind_[k], lanes, 0.0f);
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    const float z = std::max(uniform(lane, 0), 0x1p-24f);
    const float r = std::sqrt((1 - z) * (1 + z));
    const float phi = 2 * std::numbers::pi_v<float> * uniform(lane, 1);
    columns.input(kIx)[lane] = r * std::cos(phi);
    columns.input(kIy)[lane] = r * std::sin(phi);
    columns.input(kIz)[lane] = z;
    columns.input(kIzBackfacing)[lane] = uniform(lane, 2) < 0.1f ? -z : z;
    columns.input(kU1)[lane] = uniform(lane, 3);
    columns.input(kU2)[lane] = uniform(lane, 4);
    columns.input(kU3)[lane] = uniform(lane, 5);
  }
  return columns;
}

void Columns::set_roughness(float alpha_x, float alpha_y, std::size_t lanes) {
  if (alpha_x != alpha_x_ || alpha_y != alpha_y_) rough_lanes_ = query_lanes_ = 0;
  alpha_x_ = alpha_x;
  alpha_y_ = alpha_y;
  for (std::size_t lane = rough_lanes_; lane < lanes; ++lane) {
    input(kAlphaX)[lane] = alpha_x > 0 ? alpha_x : 0.05f + 0.95f * uniform(lane, 6);
    input(kAlphaY)[lane] = alpha_y > 0 ? alpha_y : 0.05f + 0.95f * uniform(lane, 7);
  }
  rough_lanes_ = std::max(rough_lanes_, lanes);
}

absl::Status Columns::prepare(const Case& which) {
  set_roughness(which.alpha_x, which.alpha_y, which.lanes());
  if (which.inputs == Inputs::malloc_placed)
    for (int k = 0; k < kInputs; ++k) std::copy_n(input(k), which.batch, malloc_column(k));
  if (!which.has_outgoing()) return absl::OkStatus();
  const std::size_t lanes = which.batch;
  const Case drawing{.operation = which.operation == Operation::evaluate_transmission ? Operation::sample_transmission
                                  : which.operation == Operation::evaluate_scattering ? Operation::sample_scattering
                                                                                      : Operation::sample_reflection,
                     .distribution = which.distribution,
                     .masking = which.masking,
                     .sampler = Sampler::visible,
                     .alpha_x = which.alpha_x,
                     .alpha_y = which.alpha_y,
                     .batch = lanes};
  Case drawn = query_;
  drawn.batch = lanes;
  if (drawing.comparable(drawn) && query_lanes_ >= lanes) return absl::OkStatus();
  Batch sampling = batch(drawing);
  sampling.out = {};
  sampling.out.outgoing = {{input(kOx), lanes}, {input(kOy), lanes}, {input(kOz), lanes}};
  if (auto sampled = run(drawing.operation, sampling); !sampled.ok()) return sampled.status();
  query_ = drawing;
  query_lanes_ = lanes;
  return absl::OkStatus();
}

Batch Columns::batch(const Case& which, std::size_t first) const {
  const std::size_t lanes = which.batch;
  const bool placed = which.inputs == Inputs::malloc_placed;
  const auto column = [&](int index) { return (placed ? malloc_column(index) : input(index)) + first; };
  const auto in = [&](Index index) { return Column<float>(column(index), lanes); };
  const auto out = [&](int index) { return OutputColumn<float>(column(kInputs + index), lanes); };
  Batch batch;
  batch.lanes = lanes;
  batch.model = which.model();
  if (which.scatters()) batch.eta = 1.5f;
  if (which.sampler) batch.sampler = *which.sampler;
  batch.incident = {in(kIx), in(kIy), in(which.inputs == Inputs::backfacing ? kIzBackfacing : kIz)};
  if (which.inputs == Inputs::one_roughness) {
    batch.alpha_x = which.alpha_x;
    batch.alpha_y = which.alpha_y;
  } else {
    batch.alpha_x = in(kAlphaX);
    batch.alpha_y = in(kAlphaY);
  }
  if (which.is_sampling()) {
    if (which.inputs == Inputs::generator) {
      batch.generator = Generator{.seed = 1, .dimension = 0, .id = {}, .first_id = 0};
    } else {
      batch.u1 = in(kU1);
      batch.u2 = in(kU2);
      if (which.uses_u3()) batch.u3 = in(kU3);
    }
  } else if (which.has_outgoing()) {
    batch.outgoing = {in(kOx), in(kOy), in(kOz)};
  }
  switch (which.operation) {
    case Operation::sample_normal:
      batch.out.normal = {out(0), out(1), out(2)};
      batch.out.pdf = out(3);
      break;
    case Operation::sample_reflection:
    case Operation::sample_transmission:
    case Operation::sample_scattering:
      batch.out.outgoing = {out(0), out(1), out(2)};
      batch.out.pdf = out(3);
      break;
    case Operation::pdf_reflection: batch.out.pdf = out(0); break;
    case Operation::evaluate_reflection:
      batch.out.value = out(0);
      if (which.sampler) batch.out.pdf = out(1);
      break;
    case Operation::evaluate_transmission:
    case Operation::evaluate_scattering:
      batch.out.value = out(0);
      batch.out.pdf = out(1);
      break;
    case Operation::masking: batch.out.masking = out(0); break;
    case Operation::albedo: batch.out.albedo = out(0); break;
  }
  return batch;
}

}  // namespace facetwise::bench
