// SPDX-License-Identifier: Apache-2.0
// A file that appears under its name only when it is complete.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace facetwise::app {

class OutputFile {
 public:
  // Creates a temporary file beside `path`; an existing `path` must be a regular file (or a link to one).
  static absl::StatusOr<OutputFile> create(const std::string& path);
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;
  ~OutputFile();  // removes the temporary file unless commit() moved it into place

  int descriptor() const { return descriptor_; }
  absl::Status write(std::string_view bytes);
  absl::Status commit();

 private:
  OutputFile() = default;

  std::string path_, target_, temporary_;
  int descriptor_ = -1;
};

// A file of these bytes, complete or not at all.
absl::Status write_file(const std::string& path, std::string_view bytes);

// Writes all of `bytes` to a descriptor. `what` begins the error.
absl::Status write_all(int descriptor, std::string_view bytes, const std::string& what);

}  // namespace facetwise::app
