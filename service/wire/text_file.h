// SPDX-License-Identifier: Apache-2.0
// Small text files: certificates, keys and tokens.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace facetwise::wire {

// Errors name the file.
absl::StatusOr<std::string> read_text_file(const std::string& path);

// One token a line; empty lines and those that begin with # are no tokens. A token has 16 to 1,000 visible characters.
// InvalidArgument if there is none.
absl::StatusOr<std::vector<std::string>> read_tokens(const std::string& path);
// The first of them.
absl::StatusOr<std::string> read_token(const std::string& path);

}  // namespace facetwise::wire
