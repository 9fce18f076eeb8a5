// SPDX-License-Identifier: Apache-2.0
// Tables as bytes: a header, the values as float32 and the FNV-1a hash of all before as uint64, little-endian. A header
// begins with 8 bytes of magic and the version as uint32, and has `sizes` with a total().
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "src/table/layout.h"
#include "src/whole_file.h"

namespace facetwise {

static_assert(std::endian::native == std::endian::little, "values are written as they lie in memory");

// What a kind of table is recognised by, and called in errors.
struct Seal {
  char magic[8];
  std::uint32_t version;
  const char* of;     // "slopes"
  const char* maker;  // "SlopeTable"
};

template <class Header>
std::string seal(const Header& header, std::span<const float> values) {
  std::string bytes(reinterpret_cast<const char*>(&header), sizeof header);
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
  const std::uint64_t hash = fnv1a(bytes.data(), bytes.size());
  bytes.append(reinterpret_cast<const char*>(&hash), sizeof hash);
  return bytes;
}

inline absl::Status corrupted_by_hash() {
  return absl::InvalidArgumentError("corrupted: its hash is another; copy it again or rebuild it");
}

// The header and the values of what seal() made.
template <class Header>
absl::StatusOr<std::pair<Header, std::vector<float>>> unseal(std::string_view bytes, const Seal& kind) {
  const auto invalid = [](const auto&... parts) { return absl::InvalidArgumentError(absl::StrCat(parts...)); };
  Header header;
  std::uint64_t hash;
  if (bytes.size() < sizeof kind.magic || std::memcmp(bytes.data(), kind.magic, sizeof kind.magic) != 0)
    return invalid("not a table of ", kind.of, "; make one with ", kind.maker, "::save");
  if (bytes.size() < sizeof header + sizeof hash)
    return invalid("truncated: ", bytes.size(), " bytes; copy it again or rebuild it");
  std::memcpy(&header, bytes.data(), sizeof header);
  if (header.version != kind.version)
    return invalid("version ", header.version, "; this facetwise reads version ", kind.version, ": rebuild the table");
  if (auto status = check_sizes(header.sizes); !status.ok())
    return invalid("corrupted (", status.message(), "); copy it again or rebuild it");
  const std::size_t size = sizeof header + header.sizes.total() * sizeof(float) + sizeof hash;
  if (bytes.size() < size)
    return invalid("truncated: ", bytes.size(), " bytes of ", size, "; copy it again or rebuild it");
  if (bytes.size() > size)
    return invalid("corrupted: ", bytes.size(), " bytes instead of ", size, "; copy it again or rebuild it");
  std::memcpy(&hash, bytes.data() + size - sizeof hash, sizeof hash);
  if (hash != fnv1a(bytes.data(), size - sizeof hash)) return corrupted_by_hash();
  std::vector<float> values(header.sizes.total());
  std::memcpy(values.data(), bytes.data() + sizeof header, values.size() * sizeof(float));
  return std::pair(header, std::move(values));
}

template <class Table>
absl::StatusOr<std::shared_ptr<const Table>> load_table(const std::string& path) {
  const auto bytes = read_file(path);
  if (!bytes.ok()) return bytes.status();
  auto table = Table::parse(*bytes);
  if (!table.ok()) return of_file(path, table.status());
  return table;
}

}  // namespace facetwise
