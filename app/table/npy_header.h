// SPDX-License-Identifier: Apache-2.0
// The header of a .npy file: what a one-dimensional structured array consists of.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace facetwise::app {

struct NpyField {
  std::string name;
  std::string type;    // NumPy's type string, "<f4"
  std::size_t offset;  // in the record
  bool scalar = true;  // false for a field that is itself an array or a structure
  std::size_t bytes = 0;
};

struct NpyHeader {
  std::vector<NpyField> fields;  // without unnamed padding
  std::size_t record_bytes = 0;  // from row to row
  std::size_t rows = 0;
  std::size_t data_offset = 0;  // of the first record in the file
};

// Parses the header at the beginning of a file. `names` are the columns of a plain array, of one or two dimensions. Errors
// do not name the file.
absl::StatusOr<NpyHeader> parse_npy_header(std::string_view file, std::span<const std::string> names = {});

}  // namespace facetwise::app
