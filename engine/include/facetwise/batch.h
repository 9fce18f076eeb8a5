// SPDX-License-Identifier: Apache-2.0
// The batch: what every operation, local or remote, takes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "facetwise/column.h"
#include "facetwise/model.h"

namespace facetwise {

//   operation              reads                             writes on request (Batch::out)
//   sample_normal          incident roughness random         normal incident_dot_normal pdf [1/sr of m] status
//   sample_reflection      incident roughness random         outgoing normal incident_dot_normal pdf weight status
//   pdf_reflection         incident roughness outgoing       pdf status
//   evaluate_reflection    incident roughness outgoing       value pdf status
//   masking                incident roughness                masking projected_area share_unoccluded status
//   sample_transmission    incident roughness random         outgoing normal incident_dot_normal pdf weight eta_scale
//                                                            status
//   evaluate_transmission  incident roughness outgoing       value pdf status
//   sample_scattering      incident roughness random         the same, event branch_probability
//   evaluate_scattering    incident roughness outgoing       value pdf branch_probability status
//   albedo                 incident roughness                albedo mean_albedo transmitted status
//
// "roughness" is alpha and, as far as given, mean_slope and slope_correlation. Operations also read what the
// model's interface needs: f0, f90 (Schlick) or eta (dielectric). Values and masking are no sampler's: evaluate_* read
// Batch::sampler where the pdf is wanted, masking and albedo never.
//
// albedo is what share of the light from i the surface reflects by one scattering at microfacets with F = 1 (conductor or
// schlick): what a layer above another leaves to it is about 1 - F albedo. Of a dielectric it is what it reflects by
// Fresnel's equations, and `transmitted` what goes through. It takes no mean slope; i_z <= 0 is answered as i_z = 0.
// docs/albedo.md has its errors.
//
// With a dielectric, *_reflection and *_transmission force the event: each microfacet reflects, or transmits,
// whatever its Fresnel reflectance F, which is then part of weight and value only. *_scattering choose between
// the two by u3, in proportion to F v_R and (1 - F) v_T where v_R, v_T say whether the direction would be
// accepted; the pdf has that probability as a factor. evaluate_scattering answers for both sides: o_z > 0 is
// reflection, o_z < 0 transmission.
enum class Operation : std::uint8_t {
  sample_normal = 0,
  sample_reflection = 1,
  pdf_reflection = 2,
  evaluate_reflection = 3,
  masking = 4,
  sample_transmission = 5,
  evaluate_transmission = 6,
  sample_scattering = 7,
  evaluate_scattering = 8,
  albedo = 9,
};

// Whether an operation draws random numbers.
constexpr bool samples(Operation operation) {
  return operation == Operation::sample_normal || operation == Operation::sample_reflection ||
         operation == Operation::sample_transmission || operation == Operation::sample_scattering;
}
// Whether an operation draws by a sampler, or gives a sampler's density.
constexpr bool has_sampler(Operation operation) {
  return operation != Operation::masking && operation != Operation::albedo;
}
// Whether it is one of a dielectric's, which also transmits: *_transmission and *_scattering.
constexpr bool scatters(Operation operation) {
  return operation >= Operation::sample_transmission && operation <= Operation::evaluate_scattering;
}

std::string_view name(Operation);
std::optional<Operation> parse_operation(std::string_view);
std::span<const Operation> all_operations();

// Three columns of unit vectors in the local frame (model.h).
struct Direction {
  Column<float> x{}, y{}, z{};
};
struct OutputDirection {
  OutputColumn<float> x{}, y{}, z{};
};

// In-kernel random numbers: Philox4x32-10 (Salmon et al. 2011) with key = seed and counter =
// (id, dimension, 0). u1, u2, u3 are the upper 24 bits of its first three words times 2^-24. A lane's id
// is its value in `id`, or first_id + its index where no `id` is given: so a path gets the same numbers
// however a batch is split, compacted or reordered.
struct Generator {
  std::uint64_t seed = 0;
  std::uint32_t dimension = 0;
  Column<std::uint64_t> id{};
  std::uint64_t first_id = 0;
};

// A batch of lanes. Set what the operation reads and the outputs that are wanted. A column that the
// operation does not know, a missing one, one of the wrong length or one that overlaps another makes an
// error that names it (for instance "alpha_x: 10 values for 12 lanes"); then nothing is written.
//
// An output may be the same memory as an input of the same lane (same address, same stride); any other
// overlap is an error.
struct Batch {
  Model model{};
  Sampler sampler = Sampler::exact;

  std::size_t lanes = 0;  // length of every column; any number, 0 included
  // If given, only these lanes are read and written, in any order, each at most once. Indices < lanes.
  std::optional<std::span<const std::uint32_t>> active{};

  Direction incident{};                // i
  Direction outgoing{};                // o, for queries
  Column<float> alpha_x{}, alpha_y{};  // roughness, [1e-4, 10]
  // Optional, where the model takes them (else 0). Mean slope of the normals (LEADR: Dupuy et al. 2013; Heitz &
  // d'Eon 2014, section 4), and the correlation rho in (-1, 1) that makes the slopes' covariance proportional to
  // [[ax^2, rho ax ay], [rho ax ay, ay^2]]. Smith masking with ggx, beckmann or table.
  Column<float> mean_slope_x{}, mean_slope_y{};  // [-100, 100]
  Column<float> slope_correlation{};
  Column<float> eta{};                   // eta_o / eta_i, i's side below; dielectric
  Column<float> f0{}, f90{};             // Schlick; f90 is optional, else 1
  Column<float> u1{}, u2{}, u3{};        // uniform in [0, 1); u3 only where uses_u3() and for sample_scattering
  std::optional<Generator> generator{};  // instead of u1, u2, u3

  struct Outputs {
    OutputDirection outgoing{};                 // o
    OutputDirection normal{};                   // m
    OutputColumn<float> incident_dot_normal{};  // i.m
    OutputColumn<float> pdf{};                  // 1/sr, of o (of m for sample_normal)
    OutputColumn<float> weight{};               // f |cos(theta_o)| / pdf
    OutputColumn<float> value{};                // f |cos(theta_o)|, 1/sr
    OutputColumn<float> masking{};              // G1(i), 0 for i_z <= 0
    OutputColumn<float> projected_area{};       // sigma(i)
    OutputColumn<float> share_unoccluded{};     // K/sigma: share of visible normals whose reflection is not
                                                // occluded, the share that `cap` keeps; GGX with Smith
    OutputColumn<float> branch_probability{};   // of the event that was chosen, or that o means
    OutputColumn<float> eta_scale{};            // 1 for a reflection; for a transmission eta^2 (radiance) or 1: what
                                                // a path divides its weight by to compare it with others'
    OutputColumn<float> albedo{};               // E(i)
    OutputColumn<float> mean_albedo{};          // average of E over the hemisphere, by the cosine
    OutputColumn<float> transmitted{};          // share of the light from i that goes through a dielectric
    OutputColumn<std::uint8_t> event{};         // Event
    OutputColumn<std::uint8_t> status{};        // LaneStatus
  } out{};
};

// What became of the lanes of a call, exact whatever the threads.
struct Statistics {
  std::uint64_t accepted = 0, occluded = 0, smooth = 0, invalid = 0;
  std::uint64_t lanes() const { return accepted + occluded + smooth + invalid; }
  Statistics& operator+=(const Statistics& other);
  bool operator==(const Statistics&) const = default;
};

// The batch's float columns as a table, for code that treats them alike (checks, messages, files).
// `operations` has bit (1 << Operation) set for the operations that know the field.
struct InputField {
  std::string_view name;  // "incident.x", "alpha_x", "u1", ...
  Column<float>& (*column)(Batch&);
  unsigned operations;
  std::optional<float> otherwise;  // what a missing column means; nothing where it may not be missing
  bool random;                     // u1, u2, u3, which a generator stands in for
};
struct OutputField {
  std::string_view name;  // "out.outgoing.x", "out.pdf", ...
  OutputColumn<float>& (*column)(Batch&);
  unsigned operations;
};

// The samplers that a model has for an operation's draws or pdf, whatever columns are given; empty where the model
// itself makes no sense, and for operations without one.
std::vector<Sampler> samplers_for(Operation, const Model&);
// `exact` where the batch's model and columns have it for the operation, else `visible`.
Sampler default_sampler(Operation, const Batch&);
// Every distribution with every masking that it has samplers for; tabulated ones if a table is given.
std::vector<Model> all_models(const std::shared_ptr<const SlopeTable>& table = nullptr);
// Whether a model takes mean slopes and correlated roughness.
bool takes_slopes(const Model&);

std::span<const InputField> input_fields();
std::span<const OutputField> output_fields();
// Byte columns, one value per lane: status and event.
struct ByteField {
  std::string_view name;  // "out.status", "out.event"
  OutputColumn<std::uint8_t>& (*column)(Batch&);
  unsigned operations;
};
std::span<const ByteField> byte_fields();
// Whether a call reads a field, if only where it is given (`otherwise`): those of the model's interface, u3 where the
// sampler or the choice of an event needs it. A generator stands in for u1, u2 and u3.
bool reads(Operation, const Model&, Sampler, const InputField&);
// Whether an operation computes a field for a model: share_unoccluded is known only for GGX with Smith, and
// V-cavity's masking depends on m.
bool computes(Operation, const Model&, const OutputField&);
bool computes(Operation, const ByteField&);
constexpr unsigned bit(Operation operation) { return 1u << static_cast<unsigned>(operation); }

}  // namespace facetwise
