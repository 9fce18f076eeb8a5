// Which models, samplers and operations fit together.
#pragma once

#include "absl/status/status.h"
#include "facetwise/batch.h"
#include "src/fields.h"

namespace facetwise {

// An error that names the field, and what would fit instead.
absl::Status check_composition(Operation operation, const Batch& batch);

// Whether mean slopes or correlated roughness are given.
bool is_affine(const Batch& batch);
// Whether the operation draws random numbers.
bool samples(Operation operation);
// batch.h's, by the fields' indices.
bool reads(Operation operation, const Model& model, Sampler sampler, InputIndex input);
bool computes(Operation operation, const Model& model, OutputIndex output);

}  // namespace facetwise
