// SPDX-License-Identifier: Apache-2.0
// Tables: named float columns read from and written to CSV and .npy files.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "facetwise/column.h"

namespace facetwise::app {

// A column that is handed on as it is: values of a NumPy type such as "<i8" or "|S12" (text, filled up with zeros).
struct PassedColumn {
  std::string name, type;
  const char* data = nullptr;
  std::size_t bytes = 0, stride = 0;  // of a value, and from row to row
};

// A table that was read. Columns point into its memory, so it must outlive them.
class InputTable {
 public:
  virtual ~InputTable() = default;
  virtual std::size_t rows() const = 0;
  virtual std::span<const std::string> names() const = 0;
  // The column as floats, or an error that says why it is not one. `index` < names().size().
  virtual absl::StatusOr<Column<float>> column(std::size_t index) = 0;
  // The column to be handed on; an error where it is an array or a structure itself.
  virtual absl::StatusOr<PassedColumn> passed(std::size_t index) = 0;
};

// A table to be written. Nothing of it is seen under its name before commit(), and nothing is left behind
// without it.
class OutputTable {
 public:
  virtual ~OutputTable() = default;
  // The columns, in the order in which they were named.
  virtual OutputColumn<float> column(std::size_t index) = 0;
  // The columns of bytes, which come after the others.
  virtual OutputColumn<std::uint8_t> byte_column(std::size_t index) = 0;
  virtual absl::Status commit() = 0;
};

// Reads PATH: .npy, .npz, .csv, or "-" for CSV from standard input. `names` are the columns of a .npy file without names
// of its own, a plain array; else empty. Errors begin with the path.
absl::StatusOr<std::unique_ptr<InputTable>> read_table(const std::string& path,
                                                       std::span<const std::string> names = {});

// The columns of a table that is to be written.
struct TableColumns {
  std::vector<std::string> floats;
  std::vector<std::string> bytes = {"status"};  // one to three
  std::vector<PassedColumn> passed{};           // written at once, so they may go; CSV has them first
};

// Makes a table of `rows` rows, to be written to PATH as read_table() would read it.
absl::StatusOr<std::unique_ptr<OutputTable>> create_table(const std::string& path, const TableColumns& columns,
                                                          std::size_t rows);

}  // namespace facetwise::app
