// SPDX-License-Identifier: Apache-2.0
// Which models, samplers and operations fit together.
#pragma once

#include "absl/status/status.h"
#include "facetwise/batch.h"

namespace facetwise {

// An error that names the field, and what would fit instead.
absl::Status check_composition(Operation operation, const Batch& batch);

// Whether mean slopes or correlated roughness are given.
inline bool is_affine(const Batch& batch) {
  return batch.mean_slope_x.present() || batch.mean_slope_y.present() || batch.slope_correlation.present();
}
// The batch's sampler, or `visible`, which every model has, where the operation does not read it.
Sampler sampler_of(Operation operation, const Batch& batch);

}  // namespace facetwise
