// SPDX-License-Identifier: Apache-2.0
// .npy and .npz files.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <string>

#include "app/table/formats.h"

namespace {

void use(const absl::StatusOr<std::unique_ptr<facetwise::app::InputTable>>& table) {
  if (!table.ok()) return;
  for (std::size_t k = 0; k < (*table)->names().size() && k < 64; ++k) {
    const auto column = (*table)->column(k);
    float sum = 0;
    if (column.ok())
      for (std::size_t row = 0; row < (*table)->rows() && row < 4096; ++row) sum += (*column)[row];
    if (const auto passed = (*table)->passed(k); passed.ok())
      for (std::size_t row = 0; row < (*table)->rows() && row < 4096; ++row)
        (void)facetwise::app::passed_text(*passed, row);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const int file = memfd_create("fuzz", MFD_CLOEXEC);
  if (file < 0 || write(file, data, size) != static_cast<ssize_t>(size)) std::abort();
  const std::string path = "/proc/self/fd/" + std::to_string(file);
  const std::string names[] = {"ix", "iy", "iz"};
  use(facetwise::app::read_npy(path, {}));
  use(facetwise::app::read_npy(path, names));
  use(facetwise::app::read_npz(path));
  close(file);
  return 0;
}
