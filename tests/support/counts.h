// SPDX-License-Identifier: Apache-2.0
// How many samples tests take.
#pragma once

#include <cstdlib>
#include <string_view>

namespace facetwise::test {

inline bool set_in_environment(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr && !std::string_view(value).empty() && std::string_view(value) != "0";
}

// Few: in an emulator or under a sanitizer, and for ./test.sh --quick, which sets FACETWISE_QUICK=1.
#ifdef FACETWISE_QUICK
inline const bool kQuick = true;
#else
inline const bool kQuick = set_in_environment("FACETWISE_QUICK");
#endif

// FACETWISE_LONG=1: the runs that take minutes.
inline bool long_run() { return set_in_environment("FACETWISE_LONG"); }

}  // namespace facetwise::test
