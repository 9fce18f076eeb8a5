// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace facetwise {

// The processor's name as the kernel tells it, or "unknown".
std::string cpu_name();

}  // namespace facetwise
