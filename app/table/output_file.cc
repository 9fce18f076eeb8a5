// SPDX-License-Identifier: Apache-2.0
#include "app/table/output_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "app/errors.h"

namespace facetwise::app {

absl::Status write_all(int descriptor, std::string_view bytes, const std::string& what) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return invalid("{}: cannot write: {}", what, std::strerror(errno));
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return absl::OkStatus();
}

absl::StatusOr<OutputFile> OutputFile::create(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  OutputFile file;
  file.path_ = path;
  // Through links, so that a link stays a link.
  const fs::path target = fs::weakly_canonical(path, error);
  if (error) return invalid("{}: {}", path, error.message());
  const fs::file_status status = fs::status(target, error);
  if (fs::exists(status) && !fs::is_regular_file(status)) return invalid("{}: not a regular file", path);
  file.target_ = target.string();
  file.temporary_ = (target.parent_path() / fmt::format(".{}.XXXXXX", target.filename().string())).string();
  file.descriptor_ = ::mkostemp(file.temporary_.data(), O_CLOEXEC);
  if (file.descriptor_ < 0) {
    file.temporary_.clear();
    return invalid("{}: cannot create: {}", path, std::strerror(errno));
  }
  // mkostemp() makes a private file: give it the mode that an ordinary new file has, or the old one's.
  struct stat old;
  const mode_t mask = ::umask(0);
  ::umask(mask);
  const mode_t mode = ::stat(file.target_.c_str(), &old) == 0 ? old.st_mode & 0777 : 0666 & ~mask;
  ::fchmod(file.descriptor_, mode);
  return file;
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)),
      target_(std::move(other.target_)),
      temporary_(std::exchange(other.temporary_, {})),
      descriptor_(std::exchange(other.descriptor_, -1)) {}

OutputFile::~OutputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

absl::Status OutputFile::write(std::string_view bytes) { return write_all(descriptor_, bytes, path_); }

absl::Status OutputFile::commit() {
  // A full disk may show only when the file is closed.
  if (::close(std::exchange(descriptor_, -1)) != 0 || ::rename(temporary_.c_str(), target_.c_str()) != 0)
    return invalid("{}: cannot write: {}", path_, std::strerror(errno));
  temporary_.clear();
  return absl::OkStatus();
}

absl::Status write_file(const std::string& path, std::string_view bytes) {
  auto file = OutputFile::create(path);
  if (!file.ok()) return file.status();
  if (auto status = file->write(bytes); !status.ok()) return status;
  return file->commit();
}

}  // namespace facetwise::app
