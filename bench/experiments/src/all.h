// SPDX-License-Identifier: Apache-2.0
// The experiments, one page each.
#pragma once

#include "absl/status/statusor.h"
#include "facetwise/experiments.h"

namespace facetwise::experiments {

absl::StatusOr<Page> backfacing_page(const Options& options);
absl::StatusOr<Page> bounded_page(const Options& options);
absl::StatusOr<Page> convergence_page(const Options& options);
absl::StatusOr<Page> relief_page(const Options& options);
absl::StatusOr<Page> renderer_page(const Options& options);
absl::StatusOr<Page> retro_page(const Options& options);
absl::StatusOr<Page> wasted_page(const Options& options);

}  // namespace facetwise::experiments
