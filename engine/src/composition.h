// Which models, samplers and operations fit together.
#pragma once

#include "absl/status/status.h"
#include "facetwise/batch.h"

namespace facetwise {

// An error that names the field, and what would fit instead.
absl::Status check_composition(Operation operation, const Batch& batch);

// Whether mean slopes or correlated roughness are given.
bool is_affine(const Batch& batch);
// Whether the operation draws random numbers, and a third one.
bool samples(Operation operation);
bool reads_u3(Operation operation, const Batch& batch);

}  // namespace facetwise
