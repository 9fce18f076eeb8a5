// What this machine is.
#pragma once

#include <cstdint>
#include <string>

namespace facetwise::app {

std::string cpu_model();        // as /proc/cpuinfo names it, or "unknown"
unsigned usable_cores();        // that this process may run on
std::uint64_t memory_bytes();   // installed

}  // namespace facetwise::app
