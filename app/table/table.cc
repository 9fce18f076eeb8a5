// SPDX-License-Identifier: Apache-2.0
#include "app/table/table.h"

#include "app/errors.h"
#include "app/table/formats.h"

namespace facetwise::app {
namespace {

absl::Status unknown_format(const std::string& path) {
  return invalid(
      "{}: a file is named .csv, .npy or (to be read) .npz, or \"-\" for CSV through standard input or output", path);
}

}  // namespace

absl::StatusOr<std::unique_ptr<InputTable>> read_table(const std::string& path, std::span<const std::string> names) {
  if (path.ends_with(".npy")) return read_npy(path, names);
  if (!names.empty())
    return invalid("--columns: {} names its columns itself; the option is for plain .npy arrays", path);
  if (path.ends_with(".npz")) return read_npz(path);
  if (path == "-" || path.ends_with(".csv")) return read_csv(path);
  return unknown_format(path);
}

absl::StatusOr<std::unique_ptr<OutputTable>> create_table(const std::string& path, const TableColumns& columns,
                                                          std::size_t rows) {
  if (path.ends_with(".npy")) return create_npy(path, columns, rows);
  if (path == "-" || path.ends_with(".csv")) return create_csv(path, columns, rows);
  return unknown_format(path);
}

}  // namespace facetwise::app
