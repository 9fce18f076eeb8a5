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

// A table that was read. Columns point into its memory, so it must outlive them.
class InputTable {
 public:
  virtual ~InputTable() = default;
  virtual std::size_t rows() const = 0;
  virtual std::span<const std::string> names() const = 0;
  // The column as floats, or an error that says why it is not one. `index` < names().size().
  virtual absl::StatusOr<Column<float>> column(std::size_t index) = 0;
};

// A table to be written. Nothing of it is seen under its name before commit(), and nothing is left behind
// without it.
class OutputTable {
 public:
  virtual ~OutputTable() = default;
  // The columns, in the order in which they were named.
  virtual OutputColumn<float> column(std::size_t index) = 0;
  // The last column, `status`: one LaneStatus a row.
  virtual OutputColumn<std::uint8_t> status() = 0;
  virtual absl::Status commit() = 0;
};

// Reads PATH: .npy, .csv, or "-" for CSV from standard input. Errors begin with the path.
absl::StatusOr<std::unique_ptr<InputTable>> read_table(const std::string& path);

// Makes a table of `rows` rows with the named float columns and then `status`, to be written to PATH as
// read_table() would read it.
absl::StatusOr<std::unique_ptr<OutputTable>> create_table(const std::string& path,
                                                          std::span<const std::string> columns,
                                                          std::size_t rows);

}  // namespace facetwise::app
