// SPDX-License-Identifier: Apache-2.0
// CSV tables.
#include <cstdint>
#include <string>

#include "app/table/formats.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto table = facetwise::app::parse_csv("t.csv", std::string(reinterpret_cast<const char*>(data), size));
  if (!table.ok()) return 0;
  for (std::size_t k = 0; k < (*table)->names().size(); ++k) {
    const auto column = (*table)->column(k);
    float sum = 0;
    if (column.ok())
      for (std::size_t row = 0; row < (*table)->rows(); ++row) sum += (*column)[row];
    if (const auto passed = (*table)->passed(k); passed.ok())
      for (std::size_t row = 0; row < (*table)->rows(); ++row) (void)facetwise::app::passed_text(*passed, row);
  }
  return 0;
}
