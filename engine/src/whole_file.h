// SPDX-License-Identifier: Apache-2.0
// Files read and written as a whole.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace facetwise {

absl::StatusOr<std::string> read_file(const std::string& path);
// Written beside its place, then renamed: a reader never sees half a file.
absl::Status replace_file(const std::string& path, std::string_view bytes);

// An error about a file's contents.
absl::Status of_file(const std::string& path, const absl::Status& status);

}  // namespace facetwise
