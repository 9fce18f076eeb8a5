// SPDX-License-Identifier: Apache-2.0
#include "src/machine.h"

#include <fstream>

namespace facetwise {

std::string cpu_name() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with("model name")) continue;
    const auto value = line.find_first_not_of(": \t", line.find(':'));
    if (value != std::string::npos) return line.substr(value);
  }
  return "unknown";
}

}  // namespace facetwise
