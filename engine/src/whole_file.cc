// SPDX-License-Identifier: Apache-2.0
#include "src/whole_file.h"

#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "absl/strings/str_cat.h"

namespace facetwise {

absl::Status of_file(const std::string& path, const absl::Status& status) {
  return absl::Status(status.code(), absl::StrCat(path, ": ", status.message()));
}

absl::StatusOr<std::string> read_file(const std::string& path) {
  std::FILE* file = std::fopen(path.c_str(), "rb");
  if (file == nullptr) return absl::NotFoundError(absl::StrCat(path, ": cannot open: ", std::strerror(errno)));
  std::string bytes;
  char block[1 << 16];
  for (std::size_t n; (n = std::fread(block, 1, sizeof block, file)) > 0;) bytes.append(block, n);
  const bool failed = std::ferror(file) != 0;
  const int error = errno;
  std::fclose(file);
  if (failed) return absl::InvalidArgumentError(absl::StrCat(path, ": cannot read: ", std::strerror(error)));
  return bytes;
}

absl::Status replace_file(const std::string& path, std::string_view bytes) {
  std::string temporary = absl::StrCat(path, ".XXXXXX");
  const int descriptor = ::mkstemp(temporary.data());
  if (descriptor < 0) return absl::InvalidArgumentError(absl::StrCat(path, ": cannot create: ", std::strerror(errno)));
  ::close(descriptor);
  std::FILE* file = std::fopen(temporary.c_str(), "wb");
  bool written = file != nullptr && std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
  if (file != nullptr) written = std::fclose(file) == 0 && written;
  if (written && std::rename(temporary.c_str(), path.c_str()) == 0) return absl::OkStatus();
  const int error = errno;
  ::unlink(temporary.c_str());
  return absl::InvalidArgumentError(absl::StrCat(path, ": cannot write: ", std::strerror(error)));
}

}  // namespace facetwise
