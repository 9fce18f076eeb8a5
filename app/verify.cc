#include "app/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cstring>
#include <random>

#include "app/errors.h"

namespace facetwise::app {
namespace {

// All outputs of an operation.
struct Answer {
  std::vector<std::vector<float>>
      columns;  // as output_fields(); empty where the operation has no such output
  std::vector<std::uint8_t> status;
  Statistics statistics;
  double seconds = 0;
};

// `fill` is what the memory holds before: an output that an engine does not write is seen as a difference.
absl::StatusOr<Answer> ask(Engine& engine, Operation operation, Batch batch, std::uint32_t fill) {
  Answer answer;
  for (const OutputField& field : output_fields()) {
    auto& column = answer.columns.emplace_back();
    if (!(field.operations & bit(operation))) continue;
    column.assign(batch.lanes, std::bit_cast<float>(fill));
    field.column(batch) = OutputColumn<float>(column);
  }
  answer.status.assign(batch.lanes, static_cast<std::uint8_t>(fill));
  batch.out.status = answer.status;
  const auto start = std::chrono::steady_clock::now();
  auto statistics = engine.run(operation, batch);
  if (!statistics.ok()) return statistics.status();
  answer.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  answer.statistics = *statistics;
  return answer;
}

// Says where two columns differ; nothing where they do not.
template <class T>
std::string column_difference(std::string_view name, const std::vector<T>& remote,
                              const std::vector<T>& local) {
  if (remote.empty() || std::memcmp(remote.data(), local.data(), remote.size() * sizeof(T)) == 0) return {};
  std::size_t count = 0, first = 0;
  for (std::size_t lane = remote.size(); lane-- > 0;)
    if (std::memcmp(&remote[lane], &local[lane], sizeof(T)) != 0) ++count, first = lane;
  return fmt::format("{} differs in {} lanes, first in lane {}: {} remotely, {} locally", name, count, first,
                     remote[first], local[first]);
}

std::string difference(const Answer& remote, const Answer& local) {
  for (std::size_t k = 0; k < local.columns.size(); ++k)
    if (auto text = column_difference(output_fields()[k].name, remote.columns[k], local.columns[k]);
        !text.empty())
      return text;
  if (auto text = column_difference("out.status", remote.status, local.status); !text.empty()) return text;
  if (remote.statistics != local.statistics) return "the statistics differ";
  return {};
}

std::uint64_t bytes(const Answer& answer) {
  std::uint64_t total = answer.status.size();
  for (const auto& column : answer.columns) total += column.size() * sizeof(float);
  return total;
}

// Uniform numbers in [0, 1) with 24 bits, as a renderer's own generator makes them.
std::vector<float> uniform_numbers(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::vector<float> numbers(count);
  for (float& number : numbers) number = static_cast<float>(generator() >> 40) * 0x1p-24f;
  return numbers;
}

bool samples(Operation operation) {
  return operation == Operation::sample_normal || operation == Operation::sample_reflection;
}

// The inputs of a batch besides what was traced. The batch's columns point into it.
struct Inputs {
  scene::Lanes lanes;
  std::vector<float> u1, u2, u3;
  std::vector<float> ox, oy, oz;

  absl::StatusOr<Batch> batch(const VerifyCase& what, std::uint64_t seed) {
    Batch batch;
    batch.model.shadowing = what.shadowing;
    batch.sampler = what.sampler;
    batch.lanes = lanes.size();
    batch.incident = {lanes.incident_x, lanes.incident_y, lanes.incident_z};
    batch.alpha_x = lanes.alpha_x;
    batch.alpha_y = lanes.alpha_y;
    if (samples(what.operation)) {
      if (what.generator) {
        batch.generator.emplace().seed = seed;
        return batch;
      }
      u1 = uniform_numbers(lanes.size(), 3 * seed);
      u2 = uniform_numbers(lanes.size(), 3 * seed + 1);
      batch.u1 = u1;
      batch.u2 = u2;
      if (uses_u3(what.sampler)) {
        u3 = uniform_numbers(lanes.size(), 3 * seed + 2);
        batch.u3 = u3;
      }
    } else if (what.operation != Operation::masking) {
      // Directions that light comes from: reflections by visible normals, some of them below the surface.
      for (auto* column : {&ox, &oy, &oz}) column->resize(lanes.size());
      Batch directions = batch;
      directions.sampler = Sampler::cap;
      directions.generator.emplace().seed = seed;
      directions.out.outgoing = {ox, oy, oz};
      if (auto status = sample_reflection(directions); !status.ok()) return status.status();
      batch.outgoing = {ox, oy, oz};
    }
    return batch;
  }
};

}  // namespace

std::vector<VerifyCase> verify_cases(std::span<const Sampler> samplers) {
  std::vector<VerifyCase> cases;
  for (const bool generator : {true, false})
    for (const Sampler sampler : samplers)
      cases.push_back(
          {.operation = Operation::sample_reflection, .sampler = sampler, .generator = generator});
  for (const Sampler sampler : samplers)
    if (samples_normals(sampler) && sampler != Sampler::ndf)
      cases.push_back({.operation = Operation::sample_normal, .sampler = sampler});
  cases.push_back({.operation = Operation::pdf_reflection, .sampler = samplers.back()});
  cases.push_back({.operation = Operation::evaluate_reflection, .sampler = samplers.back()});
  cases.push_back({.operation = Operation::evaluate_and_pdf,
                   .sampler = samplers[samplers.size() > 1 ? samplers.size() - 2 : 0],
                   .shadowing = Shadowing::uncorrelated});
  cases.push_back({.operation = Operation::masking, .sampler = samplers.back()});
  return cases;
}

bool Verification::equal() const {
  return std::all_of(batches.begin(), batches.end(),
                     [](const auto& batch) { return batch.difference.empty(); });
}

std::uint64_t Verification::lanes() const {
  std::uint64_t total = 0;
  for (const auto& batch : batches) total += batch.statistics.lanes();
  return total;
}

absl::StatusOr<Verification> verify(Engine& remote, Engine& local, scene::Camera& camera,
                                    const VerifyOptions& options,
                                    const std::function<void(const VerifiedBatch&)>& progress) {
  const auto cases = verify_cases(options.samplers);
  Verification verification;
  for (std::size_t k = 0; k < options.batches; ++k) {
    const VerifyCase& what = cases[k % cases.size()];
    Inputs inputs;
    inputs.lanes = camera.trace(options.lanes);
    const auto batch = inputs.batch(what, options.seed + k);
    if (!batch.ok()) return batch.status();
    const auto there = ask(remote, what.operation, *batch, 0xffffffff);
    if (!there.ok()) return there.status();
    const auto here = ask(local, what.operation, *batch, 0x7fabcdef);
    if (!here.ok()) return here.status();
    verification.batches.push_back({.what = what,
                                    .statistics = here->statistics,
                                    .backfacing = inputs.lanes.backfacing,
                                    .bytes = bytes(*here),
                                    .remote_seconds = there->seconds,
                                    .local_seconds = here->seconds,
                                    .difference = difference(*there, *here)});
    progress(verification.batches.back());
  }
  verification.triangles = camera.triangles();
  verification.rays = camera.rays();
  verification.hits = camera.hits();
  return verification;
}

}  // namespace facetwise::app
