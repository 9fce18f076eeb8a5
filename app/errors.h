// SPDX-License-Identifier: Apache-2.0
// Statuses with formatted messages. Messages start with the file, flag or column that is wrong.
#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>

#include "absl/status/status.h"

namespace facetwise::app {

template <class... Arguments>
absl::Status invalid(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  return absl::InvalidArgumentError(fmt::format(format, std::forward<Arguments>(arguments)...));
}

inline std::string message(const absl::Status& status) {
  return std::string(status.message().data(), status.message().size());
}

}  // namespace facetwise::app
