// The memory that benchmarks read and write: columns as a caller that cares lays them out, each aligned to a
// cache line and all at different offsets in their pages.
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
  // ResourceExhausted if that many lanes do not fit into the memory that is free.
  static absl::StatusOr<Columns> make(std::size_t lanes);

  std::size_t lanes() const { return lanes_; }
  // Roughness of the first `lanes` lanes.
  void set_roughness(float alpha_x, float alpha_y, std::size_t lanes);
  // The case's roughness and, for a query, outgoing directions drawn for it: by its model's visible normals,
  // occluded ones included.
  absl::Status prepare(const Case& which);
  // Roughness that differs from lane to lane, evenly spread over [0.05, 1]².
  void set_mixed_roughness(std::size_t lanes);

  // The batch of a case whose roughness is set.
  Batch batch(const Case& which) const;

  // Incident directions are spread evenly over the hemisphere i_z > 0; in the second z 10 % are mirrored to
  // i_z < 0.
  enum Index { kIx, kIy, kIz, kIzBackfacing, kAlphaX, kAlphaY, kU1, kU2, kU3, kOx, kOy, kOz, kInputs };
  static constexpr int kOutputs = 4;
  float* input(int index) const { return data_.get() + static_cast<std::size_t>(index) * stride_; }
  float* output(int index) const { return input(kInputs + index); }

 private:
  Columns() = default;

  struct Free {
    void operator()(float* p) const { ::operator delete[](p, std::align_val_t{64}); }
  };
  std::size_t lanes_ = 0, stride_ = 0;  // stride in floats
  std::unique_ptr<float[], Free> data_;
  // What set_roughness() has set: of how many lanes, and how many have queries' directions, drawn how.
  float alpha_x_ = 0, alpha_y_ = 0;
  std::size_t rough_lanes_ = 0, query_lanes_ = 0;
  Case query_{};
};

}  // namespace facetwise::bench
