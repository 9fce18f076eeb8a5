// SPDX-License-Identifier: Apache-2.0
// The report: one page that needs no network, made of the results' JSON.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace facetwise::report {

// Paths of what the page shows. Files that do not exist are left out where the path is a default.
struct Inputs {
  std::string bench, verification;  // JSON of `bench` and `verify`; may be empty
  std::vector<std::string> pages;   // JSON of `experiment`
  std::vector<std::string> commands;
};

// Errors name the file.
absl::StatusOr<std::string> page(const Inputs& inputs);
// What changed from one run of `bench` to another.
absl::StatusOr<std::string> comparison(const std::string& first, const std::string& second);

}  // namespace facetwise::report
