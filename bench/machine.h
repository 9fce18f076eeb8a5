// SPDX-License-Identifier: Apache-2.0
// What this machine is.
#pragma once

#include <string>

namespace facetwise::bench {

std::string cpu_model();  // as the system names it, or "unknown"
unsigned usable_cores();  // that this process may run on

}  // namespace facetwise::bench
