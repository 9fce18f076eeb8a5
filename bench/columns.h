// The memory that benchmarks read and write: columns as a caller that cares lays them out, each aligned to a
// cache line and all at different offsets in their pages, and others as malloc does.
#pragma once

#include <cstddef>
#include <memory>
#include <new>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "case.h"
#include "facetwise/batch.h"

namespace facetwise::bench {

class Columns {
 public:
  // `malloc_lanes` of those that are placed as malloc does, at most `lanes`. ResourceExhausted if that does not fit into
  // the memory that is free.
  static absl::StatusOr<Columns> make(std::size_t lanes, std::size_t malloc_lanes = 0);

  std::size_t lanes() const { return kind_.lanes; }
  std::size_t malloc_lanes() const { return malloc_.lanes; }
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
  float* input(int index) const { return kind_.column(index); }
  float* output(int index) const { return kind_.column(kInputs + index); }

 private:
  Columns() = default;

  struct Free {
    void operator()(float* p) const { ::operator delete[](p, std::align_val_t{4096}); }
  };
  // All columns in one piece of memory, `stride` floats apart.
  struct Memory {
    std::size_t lanes = 0, stride = 0, offset = 0;
    std::unique_ptr<float[], Free> data;
    void allocate();
    float* column(int index) const { return data.get() + offset + static_cast<std::size_t>(index) * stride; }
  };
  Memory kind_, malloc_;
  // What set_roughness() has set: of how many lanes, and how many have queries' directions, drawn how.
  float alpha_x_ = -1, alpha_y_ = -1;
  std::size_t rough_lanes_ = 0, query_lanes_ = 0;
  Case query_{};
};

}  // namespace facetwise::bench
