// SPDX-License-Identifier: Apache-2.0
// .npy files for tests, written byte by byte rather than by the code under test.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace facetwise::test {

// A .npy file: `header` is the Python literal, `records` what follows it.
inline std::string npy_file(std::string header, const std::string& records, int version = 1) {
  const std::size_t preamble = version == 1 ? 10 : 12;
  while ((preamble + header.size() + 1) % 64 != 0) header += ' ';
  header += '\n';
  std::string file = "\x93NUMPY";
  file += static_cast<char>(version);
  file += '\0';
  for (std::size_t k = 0; k < preamble - 8; ++k) file += static_cast<char>(header.size() >> 8 * k & 0xff);
  return file + header + records;
}

inline void append(std::string& bytes, float value) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  bytes.append(raw, sizeof value);
}

}  // namespace facetwise::test
