// SPDX-License-Identifier: Apache-2.0
#include "facetwise/shared_memory.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/random.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "absl/strings/str_cat.h"

namespace facetwise {

absl::StatusOr<std::shared_ptr<SharedMemory>> SharedMemory::make(std::size_t bytes) {
  if (bytes == 0) return absl::InvalidArgumentError("bytes: 0");
  const auto failed = [&](int file) {
    const int error = errno;
    if (file >= 0) close(file);
    return absl::ResourceExhaustedError(absl::StrCat("shared memory of ", bytes, " bytes: ", std::strerror(error)));
  };
  const int file = memfd_create("facetwise", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  if (file < 0) return failed(file);
  // Pages now, not at the first access, which could only fail by a signal; and none can be taken away later.
  if (const int error = posix_fallocate(file, 0, static_cast<off_t>(bytes)); error != 0) {
    errno = error;
    return failed(file);
  }
  if (fcntl(file, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0) return failed(file);
  void* const data = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  if (data == MAP_FAILED) return failed(file);
  (void)madvise(data, bytes, MADV_HUGEPAGE);
  std::uint64_t id = 0;
  while (id == 0)
    if (getrandom(&id, sizeof id, 0) != sizeof id) id = 0;
  return std::shared_ptr<SharedMemory>(new SharedMemory(file, data, bytes, id));
}

SharedMemory::~SharedMemory() {
  munmap(data_, bytes_);
  close(file_);
}

bool SharedMemory::holds(const void* begin, std::size_t bytes) const {
  const auto from = reinterpret_cast<std::uintptr_t>(begin), mine = reinterpret_cast<std::uintptr_t>(data_);
  return from >= mine && bytes <= bytes_ && from - mine <= bytes_ - bytes;
}

}  // namespace facetwise
