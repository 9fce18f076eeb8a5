// SPDX-License-Identifier: Apache-2.0
// The two formats behind table.h.
#pragma once

#include <optional>

#include "app/table/table.h"

namespace facetwise::app {

// CSV: a header line, then one line a row, separated by commas or, where the header has none, by semicolons or tabs;
// spaces around values, quotes, CRLF line ends and a byte-order mark are accepted; no comments, no line ends within quotes.
// Numbers as C writes them, "nan" and "inf" too. Written so that reading gives the same floats again.
absl::StatusOr<std::unique_ptr<InputTable>> parse_csv(const std::string& path, std::string text);
absl::StatusOr<std::unique_ptr<InputTable>> read_csv(const std::string& path);
absl::StatusOr<std::unique_ptr<OutputTable>> create_csv(const std::string& path, const TableColumns& columns,
                                                        std::size_t rows);

// .npy (NumPy's format, versions 1 to 3): a one-dimensional structured array, or a plain one whose columns `names` name.
// Little-endian float32 columns are read where they lie in the mapped file, as members of an array of structures, and
// written the same way; float16, float64 and big-endian ones are converted.
absl::StatusOr<std::unique_ptr<InputTable>> read_npy(const std::string& path, std::span<const std::string> names);
// .npz: a zip file of one-dimensional .npy files, each a column of its name.
absl::StatusOr<std::unique_ptr<InputTable>> read_npz(const std::string& path);
// A value of a passed column as CSV has it: nothing for types that have no text.
std::optional<std::string> passed_text(const PassedColumn& column, std::size_t row);
absl::StatusOr<std::unique_ptr<OutputTable>> create_npy(const std::string& path, const TableColumns& columns,
                                                        std::size_t rows);

}  // namespace facetwise::app
