// The two formats behind table.h.
#pragma once

#include "app/table/table.h"

namespace facetwise::app {

// CSV: a header line, then one line a row; comma-separated; spaces around values, CRLF line ends and a
// byte-order mark are accepted; no quotes, no comments. Numbers as C writes them, "nan" and "inf" too.
// Written so that reading gives the same floats again.
absl::StatusOr<std::unique_ptr<InputTable>> parse_csv(const std::string& path, std::string text);
absl::StatusOr<std::unique_ptr<InputTable>> read_csv(const std::string& path);
absl::StatusOr<std::unique_ptr<OutputTable>> create_csv(const std::string& path, const TableColumns& columns,
                                                        std::size_t rows);

// .npy (NumPy's format, versions 1 to 3): a one-dimensional structured array. Columns are read where they
// lie in the mapped file, as members of an array of structures, and written the same way.
absl::StatusOr<std::unique_ptr<InputTable>> read_npy(const std::string& path);
absl::StatusOr<std::unique_ptr<OutputTable>> create_npy(const std::string& path, const TableColumns& columns,
                                                        std::size_t rows);

}  // namespace facetwise::app
