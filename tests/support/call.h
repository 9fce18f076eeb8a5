// SPDX-License-Identifier: Apache-2.0
// Calls of the engine for tests that treat all operations alike: inputs made only by integer hashing, so that
// every machine has the same, and outputs to compare bit by bit.
#pragma once

#include <cstdint>
#include <ostream>
#include <string>
#include <vector>

#include "facetwise/engine.h"

namespace facetwise::test {

// A hash of (seed, index): 64 well-mixed bits (splitmix64).
std::uint64_t hash(std::uint64_t seed, std::uint64_t index);
// 24 bits of it as a float in [0, 1).
float uniform(std::uint64_t seed, std::uint64_t index);

// An operation, with all that it can vary.
struct Call {
  Operation operation;
  Sampler sampler;
  Shadowing shadowing;
  Model model{};              // but for its shadowing
  bool affine = false;        // mean slopes and correlated roughness too
  bool values_alone = false;  // evaluate_reflection without its pdf, for which the sampler is not read
};
std::string call_name(const Call& call);
void PrintTo(const Call& call, std::ostream* to);  // for GoogleTest
// Every operation of GGX with Smith masking, with every sampler and shadowing that changes its answer; then of every
// model with every sampler that fits, where what else a model can be goes round with them.
const std::vector<Call>& all_calls();
// Those of GGX with Smith masking that reflects all.
std::vector<Call> plain_calls();
bool is_plain(const Call& call);

// Whether the call reads and writes these columns.
bool reads(const Call& call, const InputField& field);
bool writes(const Call& call, const OutputField& field);
bool writes(const Call& call, const ByteField& field);

// Places of columns in Lanes::in: the order of input_fields().
namespace input {
enum Index : std::size_t {
  incident_x,
  incident_y,
  incident_z,
  alpha_x,
  alpha_y,
  mean_slope_x,
  mean_slope_y,
  slope_correlation,
  eta,
  f0,
  f90,
  outgoing_x,
  outgoing_y,
  outgoing_z,
  u1,
  u2,
  u3,
  count
};
// Those that every model has.
inline constexpr Index kPlain[] = {incident_x, incident_y, incident_z, alpha_x, alpha_y, outgoing_x,
                                   outgoing_y, outgoing_z, u1,         u2,      u3};
}  // namespace input

// One value per lane and input, in the order of input_fields().
struct Lanes {
  std::size_t count = 0;
  std::vector<std::vector<float>> in;
};
// Lanes of every kind, mixed: in front, grazing, behind, straight below; alpha from 1e-4 to 10 (for Phong too,
// where those above 1 are invalid), isotropic and not; u at 0 and at the largest float below 1; smooth lanes, and lanes
// that are invalid in every way.
Lanes adversarial_lanes(std::size_t count, std::uint64_t seed);
// The same without smooth and invalid lanes.
Lanes ordinary_lanes(std::size_t count, std::uint64_t seed);

// What a call gave: bits of every output, the statuses, the events, the statistics.
struct Answer {
  std::vector<std::vector<float>> out;  // in the order of output_fields(); empty: not of the operation
  std::vector<std::uint8_t> status;
  std::vector<std::uint8_t> event;  // empty: not of the operation
  Statistics statistics;
};
// True if every bit is the same (NaN included).
bool same_bits(const Answer& a, const Answer& b);
std::uint64_t digest(const Answer& answer);

// A batch of the call over these lanes and outputs, which it resizes. Random numbers are columns.
Batch make_batch(const Call& call, const Lanes& lanes, Answer& answer);
Answer run_call(const Call& call, const Lanes& lanes, const Execution& execution = {});

}  // namespace facetwise::test
