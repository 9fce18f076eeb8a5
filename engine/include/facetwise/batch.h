// The batch: what every operation, local or remote, takes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "facetwise/column.h"
#include "facetwise/model.h"

namespace facetwise {

//   operation            reads                            writes on request (Batch::out)
//   sample_normal        incident alpha random            normal incident_dot_normal pdf [1/sr of m] status
//   sample_reflection    incident alpha random            outgoing normal incident_dot_normal pdf weight status
//   pdf_reflection       incident alpha outgoing          pdf status
//   evaluate_reflection  incident alpha outgoing          value status
//   evaluate_and_pdf     incident alpha outgoing          value pdf status
//   masking              incident alpha                   masking projected_area share_unoccluded status
enum class Operation : std::uint8_t {
  sample_normal = 0,
  sample_reflection = 1,
  pdf_reflection = 2,
  evaluate_reflection = 3,
  evaluate_and_pdf = 4,
  masking = 5,
};

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

  Direction incident{};                  // i
  Direction outgoing{};                  // o, for queries
  Column<float> alpha_x{}, alpha_y{};    // roughness, [1e-4, 10]
  Column<float> u1{}, u2{}, u3{};        // uniform in [0, 1); u3 only for samplers that use it
  std::optional<Generator> generator{};  // instead of u1, u2, u3

  struct Outputs {
    OutputDirection outgoing{};                 // o
    OutputDirection normal{};                   // m
    OutputColumn<float> incident_dot_normal{};  // i.m
    OutputColumn<float> pdf{};                  // 1/sr, of o (of m for sample_normal)
    OutputColumn<float> weight{};               // f cos(theta_o) / pdf with F = 1
    OutputColumn<float> value{};                // f cos(theta_o) with F = 1, 1/sr
    OutputColumn<float> masking{};              // G1(i), 0 for i_z <= 0
    OutputColumn<float> projected_area{};       // sigma(i)
    OutputColumn<float> share_unoccluded{};     // K/sigma: share of visible normals whose reflection is not
                                                // occluded, the share that `cap` keeps
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
};
struct OutputField {
  std::string_view name;  // "out.outgoing.x", "out.pdf", ...
  OutputColumn<float>& (*column)(Batch&);
  unsigned operations;
};
std::span<const InputField> input_fields();
std::span<const OutputField> output_fields();
constexpr unsigned bit(Operation operation) { return 1u << static_cast<unsigned>(operation); }

}  // namespace facetwise
