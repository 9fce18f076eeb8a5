// SPDX-License-Identifier: Apache-2.0
// Lanes for the tests of the command, as files and as a batch.
#pragma once

#include <string>
#include <vector>

#include "facetwise/engine.h"
#include "tests/app/npy_file.h"

namespace facetwise::test {

// Directions, roughness and random numbers, among them backfacing and invalid lanes.
struct Lanes {
  // ix iy iz alpha_x alpha_y u1 u2 u3 ox oy oz
  static constexpr const char* kNames[] = {"ix", "iy", "iz", "alpha_x", "alpha_y", "u1", "u2", "u3", "ox", "oy", "oz"};
  static constexpr std::size_t kColumns = 11;
  std::vector<float> columns[kColumns];

  explicit Lanes(std::size_t count);
  std::size_t size() const { return columns[0].size(); }
  // The first `names` columns, from row `begin`.
  std::string csv(std::size_t names, std::size_t begin = 0) const;
  // All columns in another order, with padding between them.
  std::string npy() const;
  // The inputs that an operation reads; random numbers from the columns.
  Batch batch(Operation operation, Sampler sampler) const;
};

// Columns of a file that the command wrote, bit for bit.
struct Output {
  std::vector<std::string> names;
  std::vector<std::vector<float>> columns;  // status as numbers
  const std::vector<float>& operator[](const std::string& name) const;
};
Output read_output(const std::string& path);

}  // namespace facetwise::test
