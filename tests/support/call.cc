// SPDX-License-Identifier: Apache-2.0
#include "support/call.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <mutex>
#include <set>
#include <stdexcept>

#include "facetwise/albedo_table.h"
#include "facetwise/slope_table.h"

namespace facetwise::test {
namespace {

constexpr float kBelowOne = 0x1.fffffep-1f;

// A unit vector whose z is `z` before the sign: only sqrt, * and /.
struct Vector {
  float x, y, z;
};
Vector direction(std::uint64_t seed, std::uint64_t lane, float z) {
  for (std::uint64_t attempt = 0;; ++attempt) {
    const float x = 2 * uniform(seed, 64 * lane + 2 * attempt) - 1;
    const float y = 2 * uniform(seed, 64 * lane + 2 * attempt + 1) - 1;
    const float r2 = x * x + y * y;
    if (r2 > 1 || r2 < 0.01f) continue;
    const float scale = std::sqrt(1 - z * z) / std::sqrt(r2);
    return {x * scale, y * scale, z};
  }
}

Vector any_direction(std::uint64_t seed, std::uint64_t lane, bool queried) {
  const float u = uniform(seed + 1, lane);
  const float sign = queried && hash(seed + 2, lane) % 8 != 0 ? 1.0f : -1.0f;
  switch (hash(seed + 3, lane) % 10) {
    case 0: return {0, 0, 1};
    case 1: return direction(seed, lane, u * 1e-3f);  // grazing
    case 2: return direction(seed, lane, u * 1e-6f);
    case 3: return direction(seed, lane, sign * u * 1e-3f);
    case 4: return direction(seed, lane, sign * u);  // behind, for incident directions
    case 5: return direction(seed, lane, -1 + u * 1e-4f);
    default: return direction(seed, lane, u);
  }
}

float any_alpha(std::uint64_t seed, std::uint64_t lane) {
  constexpr float kAlphas[] = {1e-4f, 1e-3f, 0.01f, 0.05f, 0.1f, 0.3f, 0.5f, 0.8f, 1.0f, 1.5f, 2.0f, 4.0f, 10.0f};
  const std::uint64_t bits = hash(seed, lane);
  return bits % 2 == 0 ? kAlphas[(bits >> 8) % std::size(kAlphas)] : 0.01f + uniform(seed + 1, lane);
}

float any_u(std::uint64_t seed, std::uint64_t lane) {
  const std::uint64_t kind = hash(seed, lane) % 32;
  return kind == 0 ? 0.0f : kind == 1 ? kBelowOne : kind == 2 ? 1e-30f : uniform(seed + 1, lane);
}

}  // namespace

std::uint64_t hash(std::uint64_t seed, std::uint64_t index) {
  std::uint64_t z = seed * 0xD1342543DE82EF95u + (index + 1) * 0x9E3779B97F4A7C15u;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return z ^ (z >> 31);
}

float uniform(std::uint64_t seed, std::uint64_t index) {
  return static_cast<float>(hash(seed, index) >> 40) * 0x1p-24f;
}

bool is_plain(const Call& call) {
  return call.model.distribution == Distribution::ggx && call.model.masking == Masking::smith &&
         call.model.interface == Interface::conductor && call.model.normalisation == Normalisation::unbiased &&
         !call.model.retro && call.model.compensation == Compensation::none && !call.affine;
}

namespace {

// Symmetric about n are all but some tables.
bool is_skewed(const Model& model) { return model.table != nullptr && !model.table->radial(); }

}  // namespace

bool reads(const Call& call, const InputField& field) {
  if (!(field.operations & bit(call.operation))) return false;
  if (field.name == "eta") return call.model.interface == Interface::dielectric;
  if (field.name == "f0" || field.name == "f90") return call.model.interface == Interface::schlick;
  if (field.name == "slope_correlation") return call.affine && !is_skewed(call.model);
  // What Raab's back-vector does needs slopes that are symmetric about n.
  if (field.name.starts_with("mean_slope")) return call.affine && !call.model.retro;
  return true;
}

bool writes(const Call& call, const OutputField& field) {
  if (call.values_alone && field.name == "out.pdf") return false;
  return computes(call.operation, call.model, field);
}

bool writes(const Call& call, const ByteField& field) { return field.operations & bit(call.operation); }

std::string call_name(const Call& call) {
  std::string text(name(call.operation));
  const auto append = [&](auto value) { text.append("/").append(name(value)); };
  const Model& model = call.model;
  if (model.distribution != Distribution::ggx || model.masking != Masking::smith) {
    append(model.distribution);
    text.append(is_skewed(model) ? "-skewed-" : "-").append(name(model.masking));
  }
  if (has_sampler(call.operation) && !call.values_alone) append(call.sampler);
  if (call.shadowing == Shadowing::uncorrelated) append(call.shadowing);
  if (model.normalisation != Normalisation::unbiased) append(model.normalisation);
  if (model.interface != Interface::conductor) append(model.interface);
  if (model.transport != Transport::radiance) append(model.transport);
  if (model.compensation != Compensation::none) append(model.compensation);
  if (model.retro) text += "/retro";
  if (call.affine) text += "/affine";
  return text;
}

void PrintTo(const Call& call, std::ostream* to) { *to << call_name(call); }

namespace {

// GGX with Smith masking, a conductor.
void add_plain(std::vector<Call>& calls) {
  for (const Operation operation : all_operations()) {
    if (operation >= Operation::sample_transmission) continue;
    const bool shadowed = operation == Operation::sample_reflection || operation == Operation::evaluate_reflection;
    if (operation == Operation::evaluate_reflection)
      for (const Shadowing shadowing : {Shadowing::correlated, Shadowing::uncorrelated})
        calls.push_back(
            {.operation = operation, .sampler = Sampler::cap, .shadowing = shadowing, .values_alone = true});
    for (const Sampler sampler : all_samplers()) {
      if (operation == Operation::masking && sampler != Sampler::cap) continue;
      if (sampler == Sampler::visible) continue;  // `cap`
      if (operation == Operation::sample_normal && !samples_normals(sampler)) continue;
      calls.push_back({operation, sampler, Shadowing::correlated});
      if (shadowed) calls.push_back({operation, sampler, Shadowing::uncorrelated});
    }
  }
}

// What else a model can be, a little of it in each call.
void vary(Call& call, std::size_t turn) {
  if (turn % 3 == 1) call.shadowing = Shadowing::uncorrelated;
  if (turn % 4 == 1) call.model.normalisation = Normalisation::biased;
  if (turn % 4 == 2) call.model.transport = Transport::importance;
  if (turn % 5 == 3 && !is_skewed(call.model)) call.model.retro = true;
  if (call.operation >= Operation::sample_transmission) return;
  if (turn % 2 == 1) call.model.interface = turn % 4 == 1 ? Interface::schlick : Interface::dielectric;
}

bool fits(const Call& call) {
  static const Lanes lanes = ordinary_lanes(1, 1);
  Answer answer;
  return check(call.operation, make_batch(call, lanes, answer)).ok();
}

void add_model(const Model& model, bool affine, std::vector<Call>& calls, std::set<std::string>& names) {
  std::size_t turn = calls.size();
  for (const Operation operation : all_operations()) {
    if (operation == Operation::albedo) continue;  // below
    Model varied = model;
    if (operation >= Operation::sample_transmission) varied.interface = Interface::dielectric;
    const auto add = [&](Sampler sampler, bool values_alone) {
      Call call{operation, sampler, Shadowing::correlated, varied, affine, values_alone};
      vary(call, ++turn);
      if (affine && !fits(call)) return;
      if (names.insert(call_name(call)).second) calls.push_back(call);  // those of plain GGX are there
    };
    if (operation == Operation::evaluate_reflection) add(Sampler::visible, true);
    if (operation == Operation::masking) add(Sampler::visible, false);
    for (const Sampler sampler : samplers_for(operation, varied)) add(sampler, false);
  }
}

// Albedo, and what compensation multiplies.
void add_compensated(const Model& model, std::vector<Call>& calls) {
  std::size_t turn = calls.size();
  calls.push_back(
      {Operation::albedo, Sampler::visible, turn % 2 ? Shadowing::correlated : Shadowing::uncorrelated, model});
  for (const Operation operation : {Operation::sample_reflection, Operation::evaluate_reflection}) {
    Call call{operation, Sampler::visible, ++turn % 2 ? Shadowing::correlated : Shadowing::uncorrelated, model};
    call.model.interface = turn % 3 ? Interface::schlick : Interface::conductor;
    call.model.retro = turn % 5 == 0;
    call.model.compensation = Compensation::turquin;
    calls.push_back(call);
  }
}

// Each with Kelemen's lobe, by one of the operations that have it.
void add_with_lobe(const Model& model, std::size_t turn, std::vector<Call>& calls) {
  constexpr Operation kWithLobe[] = {Operation::sample_reflection, Operation::evaluate_reflection,
                                     Operation::sample_reflection, Operation::pdf_reflection};
  const Operation operation = kWithLobe[turn % 4];
  const std::vector<Sampler> samplers = samplers_for(operation, model);
  Call call{operation, samplers[turn % samplers.size()], Shadowing::correlated, model};
  call.model.interface = turn % 3 && operation != Operation::pdf_reflection ? Interface::schlick : Interface::conductor;
  call.model.retro = turn % 5 == 1;
  call.model.compensation = Compensation::kelemen;
  calls.push_back(call);
}

// Albedo of a dielectric, or one of the operations that it compensates.
void add_dielectric_albedo(Model model, std::size_t turn, std::vector<Call>& calls) {
  constexpr Operation kOperations[] = {Operation::albedo, Operation::sample_scattering, Operation::evaluate_scattering,
                                       Operation::sample_transmission, Operation::evaluate_reflection};
  const Operation operation = kOperations[turn % std::size(kOperations)];
  model.interface = Interface::dielectric;
  if (operation != Operation::albedo) model.compensation = Compensation::turquin;
  calls.push_back({operation, Sampler::visible, Shadowing::correlated, model});
}

// Small tables, quick to build wherever tests run, each when it is first needed: an emulator takes a second for all.
void keep_small_albedo_table(const Model& model) {
  static std::mutex mutex;
  static std::vector<AlbedoTable::Key> kept;
  const std::lock_guard lock(mutex);
  const AlbedoTable::Key key = AlbedoTable::key_of(model);
  if (std::find(kept.begin(), kept.end(), key) != kept.end()) return;
  const auto table = AlbedoTable::build(
      model, {.sizes = {17, 9, 5, 5, 3, 3}, .dielectric_sizes = {9, 5, 0, 0, 0, 0, 9}, .samples = 4});
  if (!table.ok()) return;  // calls say why
  use_albedo_table(*table);
  kept.push_back(key);
}

}  // namespace

std::vector<Call> plain_calls() {
  std::vector<Call> calls;
  add_plain(calls);
  return calls;
}

namespace {

// Committed, since another machine's sine may make other tables: of SlopeTable::build() with few nodes.
std::shared_ptr<const SlopeTable> committed_table(const char* file) {
  auto table = SlopeTable::load(std::string(FACETWISE_TEST_TABLES) + file);
  if (!table.ok()) throw std::runtime_error(std::string(table.status().message()));
  return *std::move(table);
}

// Those of a radial and of a skewed table.
std::vector<Model> tabulated_models() {
  std::vector<Model> models;
  for (const char* file : {"/radial.slopes", "/skewed.slopes"})
    for (const Model& model : all_models(committed_table(file)))
      if (model.distribution == Distribution::table) models.push_back(model);
  return models;
}

std::vector<Call> make_all_calls() {
  std::vector<Call> calls;
  add_plain(calls);
  std::set<std::string> names;
  for (const Call& call : calls) names.insert(call_name(call));
  std::size_t closed = 0;
  const std::vector<Model> both[] = {all_models(), tabulated_models()};
  for (const auto& models : both) {
    for (const Model& model : models) add_model(model, false, calls, names);
    for (const Model& model : models)
      if (takes_slopes(model)) add_model(model, true, calls, names);
    for (const Model& model : models)
      if (!is_skewed(model)) add_compensated(model, calls);
    if (closed == 0) closed = calls.size();
  }
  // Tests go through each of these; what else a table can be they share with the others.
  std::size_t few = closed;
  for (std::size_t k = closed; k < calls.size(); k += 3) calls[few++] = calls[k];
  calls.resize(few);
  std::size_t turn = 0;
  for (const auto& models : both)
    for (const Model& model : models)
      if (!is_skewed(model)) add_with_lobe(model, turn++, calls);
  for (const auto& models : both)
    for (const Model& model : models)
      if (!is_skewed(model)) add_dielectric_albedo(model, turn++, calls);
#ifdef FACETWISE_QUICK
  // For an emulator: all of plain GGX, and of the models every seventh; but of Phong's, which take it seconds each, one.
  const std::size_t plain = plain_calls().size();
  std::size_t kept = plain;
  bool has_phong = false;
  for (std::size_t k = plain; k < calls.size(); k += 7) {
    const bool phong = calls[k].model.distribution == Distribution::phong;
    if (!phong || !has_phong) calls[kept++] = calls[k];
    has_phong |= phong;
  }
  calls.resize(kept);
#endif
  return calls;
}

}  // namespace

// Once in a process: each of a suite's tests is one, and an emulator takes a second to make them for every suite.
const std::vector<Call>& all_calls() {
  static const std::vector<Call> calls = make_all_calls();
  return calls;
}

Lanes ordinary_lanes(std::size_t count, std::uint64_t seed) {
  Lanes lanes;
  lanes.count = count;
  lanes.in.assign(input::count, std::vector<float>(count));
  for (std::size_t lane = 0; lane < count; ++lane) {
    const Vector i = any_direction(100 * seed + 1, lane, false), o = any_direction(100 * seed + 11, lane, true);
    const float alpha_x = any_alpha(100 * seed + 21, lane);
    // Stretches of isotropic lanes, so that whole vectors of them and mixed ones occur.
    const bool isotropic = (lane / 64) % 2 == 0 || hash(100 * seed + 31, lane) % 3 == 0;
    const float alpha_y = isotropic ? alpha_x : any_alpha(100 * seed + 41, lane);
    const float values[] = {i.x,
                            i.y,
                            i.z,
                            alpha_x,
                            alpha_y,
                            o.x,
                            o.y,
                            o.z,
                            any_u(100 * seed + 51, lane),
                            any_u(100 * seed + 61, lane),
                            any_u(100 * seed + 71, lane)};
    for (std::size_t k = 0; k < std::size(values); ++k) lanes.in[input::kPlain[k]][lane] = values[k];
    const auto between = [&](std::uint64_t stream, float low, float high) {
      return low + (high - low) * uniform(100 * seed + stream, lane);
    };
    const bool steep = hash(100 * seed + 80, lane) % 8 == 0;
    lanes.in[input::mean_slope_x][lane] = between(81, -1, 1) * (steep ? 100.0f : 0.5f);
    lanes.in[input::mean_slope_y][lane] = hash(100 * seed + 82, lane) % 4 == 0 ? 0.0f : between(83, -0.5f, 0.5f);
    lanes.in[input::slope_correlation][lane] = between(84, -1, 1) * 0.999f;
    const std::uint64_t medium = hash(100 * seed + 85, lane) % 16;
    constexpr float kMedia[] = {1.0f, 1.5f, 1 / 1.5f, kSmallestEta, kLargestEta, 1.0000001f};
    lanes.in[input::eta][lane] = medium < std::size(kMedia) ? kMedia[medium] : between(86, 0.4f, 2.5f);
    lanes.in[input::f0][lane] = between(87, 0, 1);
    lanes.in[input::f90][lane] = medium == 0 ? 0.0f : between(88, 0.5f, 1);
  }
  return lanes;
}

Lanes adversarial_lanes(std::size_t count, std::uint64_t seed) {
  Lanes lanes = ordinary_lanes(count, seed);
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  constexpr float kBad[] = {kNan,     -kNan,   kInf, -kInf,   -0.0f, 0.0f,     1e-40f, -1e-40f, 5e-5f,
                            9.99e-5f, 10.001f, 1.0f, 1.0005f, -1.0f, 0x1p100f, 2.0f,   -0.1f};
  for (std::size_t lane = 0; lane < count; ++lane) {
    const std::uint64_t bits = hash(seed + 1000, lane);
    if ((lane / 128) % 2 == 0 || bits % 6 != 0) continue;
    constexpr std::size_t kPlain = std::size(input::kPlain), kOthers = input::count - kPlain;
    float& value = lanes.in[input::kPlain[(bits >> 8) % kPlain]][lane];
    value = (bits >> 16) % 4 == 0 ? std::bit_cast<float>(static_cast<std::uint32_t>(bits >> 32))
                                  : kBad[(bits >> 24) % std::size(kBad)];
    // Columns of only some models.
    const std::uint64_t more = hash(seed + 2000, lane);
    float& other = lanes.in[input::mean_slope_x + more % kOthers][lane];
    other = (more >> 16) % 4 == 0 ? std::bit_cast<float>(static_cast<std::uint32_t>(more >> 32))
                                  : kBad[(more >> 24) % std::size(kBad)];
  }
  return lanes;
}

bool same_bits(const Answer& a, const Answer& b) {
  if (a.statistics != b.statistics || a.status != b.status || a.event != b.event || a.out.size() != b.out.size())
    return false;
  for (std::size_t k = 0; k < a.out.size(); ++k) {
    if (a.out[k].size() != b.out[k].size()) return false;
    if (!a.out[k].empty() && std::memcmp(a.out[k].data(), b.out[k].data(), 4 * a.out[k].size()) != 0) return false;
  }
  return true;
}

std::uint64_t digest(const Answer& answer) {
  std::uint64_t digest = 0;
  for (const auto& column : answer.out)
    for (const float value : column) digest = hash(digest, std::bit_cast<std::uint32_t>(value));
  for (const std::uint8_t status : answer.status) digest = hash(digest, status);
  for (const std::uint8_t event : answer.event) digest = hash(digest, event);
  return digest;
}

Batch make_batch(const Call& call, const Lanes& lanes, Answer& answer) {
  Batch batch;
  batch.model = call.model;
  batch.model.shadowing = call.shadowing;
  batch.sampler = call.sampler;
  batch.lanes = lanes.count;
  if (reads_albedo(call.operation, batch.model)) keep_small_albedo_table(batch.model);
  for (std::size_t k = 0; k < lanes.in.size(); ++k)
    if (reads(call, input_fields()[k])) input_fields()[k].column(batch) = lanes.in[k];
  answer.out.resize(output_fields().size());
  for (std::size_t k = 0; k < answer.out.size(); ++k) {
    if (!writes(call, output_fields()[k])) continue;
    answer.out[k].assign(lanes.count, -7.0f);
    output_fields()[k].column(batch) = answer.out[k];
  }
  answer.status.assign(lanes.count, 77);
  batch.out.status = answer.status;
  if (call.operation == Operation::sample_scattering) {
    answer.event.assign(lanes.count, 77);
    batch.out.event = answer.event;
  }
  return batch;
}

Answer run_call(const Call& call, const Lanes& lanes, const Execution& execution) {
  Answer answer;
  const auto statistics = run(call.operation, make_batch(call, lanes, answer), execution);
  if (statistics.ok()) answer.statistics = *statistics;
  return answer;
}

}  // namespace facetwise::test
