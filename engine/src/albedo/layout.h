// SPDX-License-Identifier: Apache-2.0
// How a table of albedo lies in memory.
#pragma once

#include <memory>
#include <vector>

#include "facetwise/albedo_table.h"

namespace facetwise {

// Error: sizes that no table has.
absl::Status check_sizes(const AlbedoSizes& sizes);

// alpha / (1 + alpha) of the largest roughness.
constexpr double albedo_range(Distribution distribution) {
  const double largest = distribution == Distribution::phong ? kLargestPhongAlpha : kLargestAlpha;
  return largest / (1 + largest);
}

struct AlbedoTableMaker {
  // `values`: isotropic, ratio, mean.
  static std::shared_ptr<const AlbedoTable> make(const AlbedoSizes& sizes, const AlbedoTable::Key& key,
                                                 std::vector<float> values);
};

}  // namespace facetwise
