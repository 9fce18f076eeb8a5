// SPDX-License-Identifier: Apache-2.0
// The library's calls. A program that may run remotely holds an Engine; one that never will may call the
// free functions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "facetwise/batch.h"
#include "facetwise/target.h"

namespace facetwise {

// Library version, "major.minor.patch".
std::string_view version();

// Runs one operation on a batch (see Operation for what it reads and writes). Errors are InvalidArgument
// and name the field; then nothing was written. Bad lanes are no error: they get a status.
// Execution::target not available here is FailedPrecondition; a call that Execution::stop ends is Cancelled.
absl::StatusOr<Statistics> run(Operation operation, const Batch& batch, const Execution& execution = {});

inline absl::StatusOr<Statistics> sample_normal(const Batch& batch, const Execution& execution = {}) {
  return run(Operation::sample_normal, batch, execution);
}
inline absl::StatusOr<Statistics> sample_reflection(const Batch& batch, const Execution& execution = {}) {
  return run(Operation::sample_reflection, batch, execution);
}
inline absl::StatusOr<Statistics> pdf_reflection(const Batch& batch, const Execution& execution = {}) {
  return run(Operation::pdf_reflection, batch, execution);
}
inline absl::StatusOr<Statistics> evaluate_reflection(const Batch& batch, const Execution& execution = {}) {
  return run(Operation::evaluate_reflection, batch, execution);
}
inline absl::StatusOr<Statistics> masking(const Batch& batch, const Execution& execution = {}) {
  return run(Operation::masking, batch, execution);
}
inline absl::StatusOr<Statistics> sample_transmission(const Batch& batch, const Execution& execution = {}) {
  return run(Operation::sample_transmission, batch, execution);
}
inline absl::StatusOr<Statistics> evaluate_transmission(const Batch& batch, const Execution& execution = {}) {
  return run(Operation::evaluate_transmission, batch, execution);
}
inline absl::StatusOr<Statistics> sample_scattering(const Batch& batch, const Execution& execution = {}) {
  return run(Operation::sample_scattering, batch, execution);
}
inline absl::StatusOr<Statistics> evaluate_scattering(const Batch& batch, const Execution& execution = {}) {
  return run(Operation::evaluate_scattering, batch, execution);
}
inline absl::StatusOr<Statistics> albedo(const Batch& batch, const Execution& execution = {}) {
  return run(Operation::albedo, batch, execution);
}

// Compaction of accepted lanes, stable in order: what a wavefront queue keeps after sampling.
struct Compaction {
  std::size_t lanes = 0;
  std::optional<std::span<const std::uint32_t>> active{};  // as in Batch; the order is this list's
  Column<std::uint8_t> status{};                           // LaneStatus per lane

  // Where the k-th accepted lane's index goes. Room for as many lanes as there are (all or active).
  OutputColumn<std::uint32_t> index{};
  // Dense columns: to[k] = from[k-th accepted lane]. `to` has room as `index` has, and is separate memory.
  struct DenseColumn {
    Column<float> from{};
    OutputColumn<float> to{};
  };
  std::span<const DenseColumn> columns{};
};

// Returns the number of accepted lanes. Values past it are left as they were.
absl::StatusOr<std::size_t> compact(const Compaction& compaction, const Execution& execution = {});

// The same calls behind an interface: local_engine() here, connect() in facetwise/client.h. Results are
// the same to the last bit.
class Engine {
 public:
  virtual ~Engine() = default;
  virtual absl::StatusOr<Statistics> run(Operation operation, const Batch& batch) = 0;
  virtual absl::StatusOr<std::size_t> compact(const Compaction& compaction) = 0;

  auto sample_normal(const Batch& batch) { return run(Operation::sample_normal, batch); }
  auto sample_reflection(const Batch& batch) { return run(Operation::sample_reflection, batch); }
  auto pdf_reflection(const Batch& batch) { return run(Operation::pdf_reflection, batch); }
  auto evaluate_reflection(const Batch& batch) { return run(Operation::evaluate_reflection, batch); }
  auto masking(const Batch& batch) { return run(Operation::masking, batch); }
  auto sample_transmission(const Batch& batch) { return run(Operation::sample_transmission, batch); }
  auto evaluate_transmission(const Batch& batch) { return run(Operation::evaluate_transmission, batch); }
  auto sample_scattering(const Batch& batch) { return run(Operation::sample_scattering, batch); }
  auto evaluate_scattering(const Batch& batch) { return run(Operation::evaluate_scattering, batch); }
  auto albedo(const Batch& batch) { return run(Operation::albedo, batch); }
};

std::unique_ptr<Engine> local_engine(const Execution& execution = {});

// The checks of run() and compact(), without running: OK or the error that they would return.
absl::Status check(Operation operation, const Batch& batch);
absl::Status check(const Compaction& compaction);

}  // namespace facetwise
