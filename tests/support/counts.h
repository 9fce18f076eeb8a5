// How many samples tests take.
#pragma once

#include <cstdlib>
#include <string_view>

namespace facetwise::test {

#ifdef FACETWISE_QUICK
inline constexpr bool kQuick = true;  // in an emulator, or under a sanitizer
#else
inline constexpr bool kQuick = false;
#endif

// FACETWISE_LONG=1 in the environment: the runs that take minutes.
inline bool long_run() {
  const char* value = std::getenv("FACETWISE_LONG");
  return value != nullptr && !std::string_view(value).empty() && std::string_view(value) != "0";
}

}  // namespace facetwise::test
