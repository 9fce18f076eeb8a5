#include "app/table/table.h"

#include "app/errors.h"
#include "app/table/formats.h"

namespace facetwise::app {
namespace {

absl::Status unknown_format(const std::string& path) {
  return invalid("{}: a file is named .csv or .npy, or \"-\" for CSV through standard input or output", path);
}

}  // namespace

absl::StatusOr<std::unique_ptr<InputTable>> read_table(const std::string& path) {
  if (path.ends_with(".npy")) return read_npy(path);
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
