// SPDX-License-Identifier: Apache-2.0
#include "app/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstring>
#include <random>

#include "app/errors.h"
#include "facetwise/slope_table.h"

namespace facetwise::app {
namespace {

// All outputs of an operation.
struct Answer {
  std::vector<std::vector<float>> columns;       // as output_fields(); empty where the operation has no such output
  std::vector<std::vector<std::uint8_t>> bytes;  // as byte_fields()
  Statistics statistics;
  double seconds = 0;
};

// `fill` is what the memory holds before: an output that an engine does not write is seen as a difference.
absl::StatusOr<Answer> ask(Engine& engine, Operation operation, Batch batch, std::uint32_t fill) {
  Answer answer;
  for (const OutputField& field : output_fields()) {
    auto& column = answer.columns.emplace_back();
    if (!computes(operation, batch.model, field)) continue;
    column.assign(batch.lanes, std::bit_cast<float>(fill));
    field.column(batch) = OutputColumn<float>(column);
  }
  for (const ByteField& field : byte_fields()) {
    auto& column = answer.bytes.emplace_back();
    if (!(field.operations & bit(operation))) continue;
    column.assign(batch.lanes, static_cast<std::uint8_t>(fill));
    field.column(batch) = OutputColumn<std::uint8_t>(column);
  }
  const auto start = std::chrono::steady_clock::now();
  auto statistics = engine.run(operation, batch);
  if (!statistics.ok()) return statistics.status();
  answer.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  answer.statistics = *statistics;
  return answer;
}

// Says where two columns differ; nothing where they do not.
template <class T>
std::string column_difference(std::string_view name, const std::vector<T>& remote, const std::vector<T>& local) {
  if (remote.empty() || std::memcmp(remote.data(), local.data(), remote.size() * sizeof(T)) == 0) return {};
  std::size_t count = 0, first = 0;
  for (std::size_t lane = remote.size(); lane-- > 0;)
    if (std::memcmp(&remote[lane], &local[lane], sizeof(T)) != 0) ++count, first = lane;
  return fmt::format("{} differs in {} lanes, first in lane {}: {} remotely, {} locally", name, count, first,
                     remote[first], local[first]);
}

std::string difference(const Answer& remote, const Answer& local) {
  for (std::size_t k = 0; k < local.columns.size(); ++k)
    if (auto text = column_difference(output_fields()[k].name, remote.columns[k], local.columns[k]); !text.empty())
      return text;
  for (std::size_t k = 0; k < local.bytes.size(); ++k)
    if (auto text = column_difference(byte_fields()[k].name, remote.bytes[k], local.bytes[k]); !text.empty())
      return text;
  if (remote.statistics != local.statistics) return "the statistics differ";
  return {};
}

std::uint64_t bytes(const Answer& answer) {
  std::uint64_t total = 0;
  for (const auto& column : answer.columns) total += column.size() * sizeof(float);
  for (const auto& column : answer.bytes) total += column.size();
  return total;
}

// Uniform numbers in [0, 1) with 24 bits, as a renderer's own generator makes them.
std::vector<float> uniform_numbers(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::vector<float> numbers(count);
  for (float& number : numbers) number = static_cast<float>(generator() >> 40) * 0x1p-24f;
  return numbers;
}

bool reads(Operation operation, std::string_view name) {
  const auto fields = input_fields();
  return std::any_of(fields.begin(), fields.end(), [&](const InputField& field) {
    return field.name == name && (field.operations & bit(operation));
  });
}

// What draws the directions that a query is asked about.
Operation drawing(Operation query) {
  if (query == Operation::evaluate_transmission) return Operation::sample_transmission;
  if (query == Operation::evaluate_scattering) return Operation::sample_scattering;
  return Operation::sample_reflection;
}

bool is_skewed(const Model& model) { return model.table != nullptr && !model.table->radial(); }

// The inputs of a batch besides what was traced. The batch's columns point into it.
struct Inputs {
  scene::Lanes lanes;
  std::vector<float> u1, u2, u3;
  std::vector<float> ox, oy, oz;
  std::vector<float> mean_slope_x, correlation, eta, f0;

  absl::StatusOr<Batch> batch(const VerifyCase& what, std::uint64_t seed) {
    Batch batch;
    batch.model = what.model;
    batch.sampler = what.sampler;
    batch.lanes = lanes.size();
    batch.incident = {lanes.incident_x, lanes.incident_y, lanes.incident_z};
    batch.alpha_x = lanes.alpha_x;
    batch.alpha_y = lanes.alpha_y;
    if (what.affine) {
      mean_slope_x = scaled(0.5f, -0.25f, seed + 11);
      correlation = scaled(1.5f, -0.75f, seed + 12);
      batch.mean_slope_x = mean_slope_x;
      batch.mean_slope_y = 0.125f;
      if (!is_skewed(what.model)) batch.slope_correlation = correlation;
    }
    if (what.model.interface == Interface::dielectric) eta = scaled(1.5f, 0.6f, seed + 13);
    if (what.model.interface == Interface::schlick) f0 = scaled(0.9f, 0.02f, seed + 14);
    set_interface(what.operation, batch);
    if (samples(what.operation)) {
      if (what.generator) {
        batch.generator.emplace().seed = seed;
        return batch;
      }
      u1 = uniform_numbers(lanes.size(), 3 * seed);
      u2 = uniform_numbers(lanes.size(), 3 * seed + 1);
      batch.u1 = u1;
      batch.u2 = u2;
      if (uses_u3(what.model, what.sampler) || what.operation == Operation::sample_scattering) {
        u3 = uniform_numbers(lanes.size(), 3 * seed + 2);
        batch.u3 = u3;
      }
    } else if (reads(what.operation, "outgoing.x")) {
      // Directions that light comes from: by visible normals, some of them on the wrong side.
      for (auto* column : {&ox, &oy, &oz}) column->resize(lanes.size());
      Batch directions = batch;
      directions.sampler = Sampler::visible;
      directions.generator.emplace().seed = seed;
      directions.out.outgoing = {ox, oy, oz};
      set_interface(drawing(what.operation), directions);
      if (auto status = run(drawing(what.operation), directions); !status.ok()) return status.status();
      batch.outgoing = {ox, oy, oz};
    }
    return batch;
  }

 private:
  std::vector<float> scaled(float by, float from, std::uint64_t seed) const {
    auto numbers = uniform_numbers(lanes.size(), seed);
    for (float& number : numbers) number = from + by * number;
    return numbers;
  }

  void set_interface(Operation operation, Batch& batch) const {
    batch.eta = batch.f0 = {};
    if (!eta.empty() && reads(operation, "eta")) batch.eta = eta;
    if (!f0.empty() && reads(operation, "f0")) batch.f0 = f0;
  }
};

// Small tables of a radial density and of a skewed one.
std::vector<std::shared_ptr<const SlopeTable>> tables() {
  std::vector<std::shared_ptr<const SlopeTable>> built;
  for (const bool radial : {true, false}) {
    const auto density = [radial](double x, double y) {
      return std::exp(-x * x - y * y) * (radial || x > 0 ? 1.0 : 1 + x * x);
    };
    const auto table = SlopeTable::build(
        density,
        {.radial = radial, .grid = 65, .incidence = 9, .slopes = 17, .uniforms = 16, .azimuths = radial ? 0u : 16u});
    if (table.ok()) built.push_back(*table);
  }
  return built;
}

void add_ggx_smith(std::span<const Sampler> samplers, std::vector<VerifyCase>& cases) {
  for (const bool generator : {true, false})
    for (const Sampler sampler : samplers)
      cases.push_back({.operation = Operation::sample_reflection, .sampler = sampler, .generator = generator});
  for (const Sampler sampler : samplers)
    if (samples_normals(sampler) && sampler != Sampler::ndf)
      cases.push_back({.operation = Operation::sample_normal, .sampler = sampler});
  cases.push_back({.operation = Operation::pdf_reflection, .sampler = samplers.back()});
  cases.push_back({.operation = Operation::evaluate_reflection, .sampler = samplers.back()});
  cases.push_back({.operation = Operation::evaluate_reflection,
                   .model = {.shadowing = Shadowing::uncorrelated},
                   .sampler = samplers[samplers.size() > 1 ? samplers.size() - 2 : 0]});
  cases.push_back({.operation = Operation::masking, .sampler = samplers.back()});
  cases.push_back({.operation = Operation::albedo, .sampler = samplers.back()});
  for (const Compensation compensation : {Compensation::turquin, Compensation::kelemen})
    cases.push_back({.operation = Operation::sample_reflection,
                     .model = {.interface = Interface::schlick, .compensation = compensation},
                     .sampler = samplers.back()});
}

// What `samplers` have of a composition, each operation that reads a sampler with each that fits. What else a model
// can be goes round with them.
void add_composition(const Model& composition, std::span<const Sampler> samplers, std::vector<VerifyCase>& cases) {
  const bool ggx_smith = composition.distribution == Distribution::ggx && composition.masking == Masking::smith;
  bool any = false;
  std::size_t turn = 0;
  for (const Operation operation : all_operations()) {
    const bool both_sides = scatters(operation);
    if (ggx_smith && !both_sides) continue;  // add_ggx_smith()
    Model model = composition;
    model.interface = both_sides ? Interface::dielectric : Interface::conductor;
    for (const Sampler sampler : samplers_for(operation, model)) {
      if (std::find(samplers.begin(), samplers.end(), sampler) == samplers.end()) continue;
      any = true;
      VerifyCase what{.operation = operation, .model = model, .sampler = sampler, .generator = ++turn % 2 == 0};
      if (turn % 3 == 0) what.model.shadowing = Shadowing::uncorrelated;
      if (turn % 3 == 1) what.model.normalisation = Normalisation::biased;
      if (turn % 4 == 1) what.model.transport = Transport::importance;
      if (!both_sides && operation != Operation::sample_normal)
        what.model.interface = turn % 2 == 0 ? Interface::schlick : Interface::dielectric;
      if (turn % 5 == 3) what.model.retro = !is_skewed(model);
      cases.push_back(what);
    }
  }
  if (!any || ggx_smith) return;
  const Sampler sampler = samplers.back();
  cases.push_back({.operation = Operation::masking, .model = composition, .sampler = sampler});
}

}  // namespace

std::vector<VerifyCase> verify_cases(std::span<const Sampler> samplers) {
  std::vector<VerifyCase> cases;
  add_ggx_smith(samplers, cases);
  std::vector<Model> models = all_models();
  for (const auto& table : tables())
    for (const Model& model : all_models(table))
      if (model.distribution == Distribution::table) models.push_back(model);
  for (const Model& model : models) add_composition(model, samplers, cases);
  // Mean slopes and correlated roughness.
  if (std::find(samplers.begin(), samplers.end(), Sampler::visible) == samplers.end()) return cases;
  for (const Model& model : models)
    for (const Operation operation :
         {Operation::sample_normal, Operation::sample_reflection, Operation::evaluate_reflection, Operation::masking})
      if (takes_slopes(model))
        cases.push_back({.operation = operation, .model = model, .sampler = Sampler::visible, .affine = true});
  return cases;
}

bool Verification::equal() const {
  return std::all_of(batches.begin(), batches.end(), [](const auto& batch) { return batch.difference.empty(); });
}

std::uint64_t Verification::lanes() const {
  std::uint64_t total = 0;
  for (const auto& batch : batches) total += batch.statistics.lanes();
  return total;
}

absl::StatusOr<Verification> verify(Engine& remote, Engine& local, scene::Camera& camera, const VerifyOptions& options,
                                    const std::function<void(const VerifiedBatch&)>& progress) {
  const auto cases = verify_cases(options.samplers);
  Verification verification;
  const std::size_t batches = options.batches > 0 ? options.batches : cases.size();
  for (std::size_t k = 0; k < batches; ++k) {
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
