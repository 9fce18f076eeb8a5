// SPDX-License-Identifier: Apache-2.0
// The command's manual and its completion in bash, made of its own help.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace facetwise::app {

// For man(1), in troff.
std::string manual_page(const CLI::App& app);
// To be sourced by bash.
std::string bash_completion(const CLI::App& app);

}  // namespace facetwise::app
