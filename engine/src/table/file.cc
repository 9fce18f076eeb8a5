// SPDX-License-Identifier: Apache-2.0
// Tables as bytes and files, and slopes as text.
//
// The bytes (sealed.h): 8 of magic, the version and the six sizes of TableSizes as uint32, 4 bytes of 0, the values.
#include <charconv>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "facetwise/slope_table.h"
#include "src/table/layout.h"
#include "src/table/sealed.h"
#include "src/whole_file.h"

namespace facetwise {
namespace {

constexpr Seal kSeal = {{'f', 'w', 's', 'l', 'o', 'p', 'e', '\x1a'}, 1, "slopes", "SlopeTable"};
struct Header {
  char magic[8];
  std::uint32_t version;
  TableSizes sizes;
  std::uint32_t zero;
};
static_assert(sizeof(Header) == 40 && sizeof(TableSizes) == 24);
constexpr char kTextMagic[] = "facetwise-slopes";

template <class... Parts>
absl::Status invalid(const Parts&... parts) {
  return absl::InvalidArgumentError(absl::StrCat(parts...));
}

// Far more than a table's resolution allows; products of some of them are still floats.
constexpr float kLargestValue = 1e12f;

// What builders make: kernels need no more than sizes in order, but a sample needs rows that rise.
absl::Status check_values(const TableSizes& sizes, std::span<const float> values) {
  for (std::size_t k = 0; k < sizes.density() + sizes.area(); ++k)
    if (!(values[k] >= 0 && values[k] <= kLargestValue))
      return invalid("a density or area of ", values[k], "; rebuild it");
  const auto rows = values.subspan(sizes.density() + sizes.area());
  const std::size_t nodes = std::size_t{sizes.uniforms} + 1;
  for (std::size_t row = 0; row < rows.size(); row += nodes) {
    const float first = row < sizes.tilt() ? 0.0f : -1.0f;
    bool rises = rows[row] == first && rows[row + nodes - 1] == 1;
    for (std::size_t k = 1; k < nodes; ++k) rises = rises && rows[row + k] >= rows[row + k - 1];
    if (!rises) return invalid("a row of samples does not rise; rebuild it");
  }
  return absl::OkStatus();
}

// The next word of a text, empty at the end.
std::string_view next_word(std::string_view& text) {
  constexpr std::string_view kSpace = " \t\r\n";
  const std::size_t from = text.find_first_not_of(kSpace);
  text.remove_prefix(from == text.npos ? text.size() : from);
  const std::string_view word = text.substr(0, text.find_first_of(kSpace));
  text.remove_prefix(word.size());
  return word;
}
template <class T>
bool read_number(std::string_view& text, T& value) {
  const std::string_view word = next_word(text);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc{} && end == word.data() + word.size() && !word.empty();
}

absl::StatusOr<std::shared_ptr<const SlopeTable>> build_text(std::string_view text,
                                                             const SlopeTable::Options& options) {
  next_word(text);
  std::size_t version = 0, nx = 0, ny = 0;
  SlopeTable::Range x{}, y{};
  if (!read_number(text, version) || version != 1)
    return invalid("the first line is not \"facetwise-slopes 1 nx ny x_min x_max y_min y_max\"");
  if (!read_number(text, nx) || !read_number(text, ny) || !read_number(text, x.from) || !read_number(text, x.to) ||
      !read_number(text, y.from) || !read_number(text, y.to))
    return invalid("the first line needs \"nx ny x_min x_max y_min y_max\" after the version");
  // Each value is a digit and a space at least.
  if (nx == 0 || ny == 0 || nx > text.size() || ny > (text.size() / 2 + 1) / nx)
    return invalid("the first line announces ", nx, " times ", ny, " values, more than there are");
  std::vector<double> values(nx * ny);
  for (std::size_t k = 0; k < values.size(); ++k)
    if (!read_number(text, values[k])) return invalid("value ", k + 1, " of ", values.size(), " is not a number");
  if (!next_word(text).empty()) return invalid("more than ", values.size(), " values");
  return SlopeTable::from_grid(values, nx, ny, x, y, options);
}

}  // namespace

std::string SlopeTable::serialise() const {
  Header header{{}, kSeal.version, SlopeTableMaker::sizes(*this), 0};
  std::memcpy(header.magic, kSeal.magic, sizeof kSeal.magic);
  return seal(header, values_);
}

absl::StatusOr<std::shared_ptr<const SlopeTable>> SlopeTable::parse(std::string_view bytes) {
  auto unsealed = unseal<Header>(bytes, kSeal);
  if (!unsealed.ok()) return unsealed.status();
  auto& [header, values] = *unsealed;
  if (header.zero != 0) return corrupted_by_hash();
  if (auto status = check_values(header.sizes, values); !status.ok()) return status;
  return SlopeTableMaker::make(header.sizes, std::move(values));
}

absl::Status SlopeTable::save(const std::string& path) const { return replace_file(path, serialise()); }

absl::StatusOr<std::shared_ptr<const SlopeTable>> SlopeTable::load(const std::string& path) {
  return load_table<SlopeTable>(path);
}

absl::StatusOr<std::shared_ptr<const SlopeTable>> SlopeTable::load_any(const std::string& path,
                                                                       const Options& options) {
  const auto bytes = read_file(path);
  if (!bytes.ok()) return bytes.status();
  if (bytes->rfind(kSeal.magic, 0, sizeof kSeal.magic) != 0 && bytes->rfind(kTextMagic, 0) != 0)
    return invalid(path, ": neither a saved table nor text that begins with \"", kTextMagic, "\"");
  auto table = bytes->rfind(kTextMagic, 0) == 0 ? build_text(*bytes, options) : parse(*bytes);
  if (!table.ok()) return of_file(path, table.status());
  return table;
}

}  // namespace facetwise
