// SPDX-License-Identifier: Apache-2.0
// The memory that benchmarks read and write: columns as a caller that cares places them (ColumnMemory), and others as
// malloc does.
#pragma once

#include <cstddef>
#include <memory>
#include <new>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "case.h"
#include "facetwise/batch.h"
#include "facetwise/column_memory.h"

namespace facetwise::bench {

class Columns {
 public:
  // `malloc_lanes` of those that are placed as malloc does, at most `lanes`. ResourceExhausted if that does not fit
  // into the memory that is free.
  static absl::StatusOr<Columns> make(std::size_t lanes, std::size_t malloc_lanes = 0);

  std::size_t lanes() const { return kind_.lanes(); }
  std::size_t malloc_lanes() const { return malloc_lanes_; }
  // Roughness of the first `lanes` lanes; mixed if it is 0 (Case).
  void set_roughness(float alpha_x, float alpha_y, std::size_t lanes);
  // The case's roughness and, for a query, outgoing directions drawn for it: by its model's visible normals,
  // occluded ones included.
  absl::Status prepare(const Case& which);

  // The batch of a case that is prepared, its lanes from `first` on.
  Batch batch(const Case& which, std::size_t first = 0) const;

  // Incident directions are spread evenly over the hemisphere i_z > 0; in the second z 10 % are mirrored to
  // i_z < 0.
  enum Index { kIx, kIy, kIz, kIzBackfacing, kAlphaX, kAlphaY, kU1, kU2, kU3, kOx, kOy, kOz, kInputs };
  static constexpr int kOutputs = 4;
  float* input(int index) const { return kind_[static_cast<std::size_t>(index)]; }
  float* output(int index) const { return input(kInputs + index); }

 private:
  Columns() = default;

  struct Free {
    void operator()(float* p) const { ::operator delete[](p, std::align_val_t{4096}); }
  };
  static constexpr std::size_t kMallocOffset = 4;
  float* malloc_column(int index) const {
    return malloc_.get() + kMallocOffset + static_cast<std::size_t>(index) * malloc_stride_;
  }
  ColumnMemory kind_;
  std::size_t malloc_lanes_ = 0, malloc_stride_ = 0;
  std::unique_ptr<float[], Free> malloc_;
  // What set_roughness() has set: of how many lanes, and how many have queries' directions, drawn how.
  float alpha_x_ = -1, alpha_y_ = -1;
  std::size_t rough_lanes_ = 0, query_lanes_ = 0;
  Case query_{};
};

}  // namespace facetwise::bench
