// SPDX-License-Identifier: Apache-2.0
#include "wire/text_file.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace facetwise::wire {

absl::StatusOr<std::string> read_text_file(const std::string& path) {
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file.is_open() || file.bad())
    return absl::NotFoundError(absl::StrCat(path, ": cannot be read: ", std::strerror(errno)));
  return text;
}

absl::StatusOr<std::vector<std::string>> read_tokens(const std::string& path) {
  constexpr std::size_t kShortest = 16, kLongest = 1000;
  auto text = read_text_file(path);
  if (!text.ok()) return text.status();
  std::vector<std::string> tokens;
  std::size_t number = 0;
  for (absl::string_view line : absl::StrSplit(*text, '\n')) {
    ++number;
    line = absl::StripAsciiWhitespace(line);
    if (line.empty() || line.front() == '#') continue;
    for (const char c : line)
      if (!absl::ascii_isgraph(static_cast<unsigned char>(c)))
        return absl::InvalidArgumentError(
            absl::StrCat(path, ", line ", number, ": a token has visible characters only"));
    if (line.size() < kShortest || line.size() > kLongest)
      return absl::InvalidArgumentError(absl::StrCat(path, ", line ", number, ": a token of ", line.size(),
                                                     " characters, not ", kShortest, " to ", kLongest));
    tokens.emplace_back(line);
  }
  if (tokens.empty()) return absl::InvalidArgumentError(absl::StrCat(path, ": has no token"));
  return tokens;
}

absl::StatusOr<std::string> read_token(const std::string& path) {
  auto tokens = read_tokens(path);
  if (!tokens.ok()) return tokens.status();
  return tokens->front();
}

}  // namespace facetwise::wire
