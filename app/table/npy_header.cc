// SPDX-License-Identifier: Apache-2.0
// NumPy's format: "\x93NUMPY", version (2 bytes), length of the header (2 bytes in version 1, else 4), and
// a Python literal such as {'descr': [('ix', '<f4'), ('', '|V4')], 'fortran_order': False, 'shape': (10,)}.
#include "app/table/npy_header.h"

#include <charconv>
#include <cstdint>
#include <limits>
#include <optional>

#include "app/errors.h"

namespace facetwise::app {
namespace {

constexpr std::size_t kLargest = std::numeric_limits<std::size_t>::max();

// A Python literal: a string, a number, True or False, or a sequence (a dict is a sequence of its keys and
// values in turn).
struct Literal {
  enum class Kind { string, integer, boolean, list, tuple, dict } kind;
  std::string text;
  std::size_t integer = 0;
  std::vector<Literal> items;

  const Literal* find(std::string_view key) const {
    for (std::size_t k = 0; k + 1 < items.size(); k += 2)
      if (items[k].kind == Kind::string && items[k].text == key) return &items[k + 1];
    return nullptr;
  }
};

class LiteralParser {
 public:
  explicit LiteralParser(std::string_view text) : text_(text) {}

  std::optional<Literal> parse() {
    auto literal = value(0);
    skip_space();
    return text_.empty() ? literal : std::nullopt;
  }

 private:
  static constexpr int kDeepest = 16;

  void skip_space() {
    const auto first = text_.find_first_not_of(" \t\n\r");
    text_.remove_prefix(first == std::string_view::npos ? text_.size() : first);
  }
  bool take(char c) {
    skip_space();
    if (!text_.starts_with(c)) return false;
    text_.remove_prefix(1);
    return true;
  }

  std::optional<Literal> value(int depth) {
    if (depth > kDeepest) return std::nullopt;
    if (take('{')) return sequence(Literal::Kind::dict, '}', depth);
    if (take('[')) return sequence(Literal::Kind::list, ']', depth);
    if (take('(')) return sequence(Literal::Kind::tuple, ')', depth);
    if (take('\'')) return string('\'');
    if (take('"')) return string('"');
    for (const std::string_view word : {"True", "False"})
      if (text_.starts_with(word)) {
        text_.remove_prefix(word.size());
        return Literal{.kind = Literal::Kind::boolean, .text = {}, .integer = word == "True", .items = {}};
      }
    Literal number{.kind = Literal::Kind::integer, .text = {}, .items = {}};
    const auto [end, error] = std::from_chars(text_.data(), text_.data() + text_.size(), number.integer);
    if (error != std::errc{}) return std::nullopt;
    text_.remove_prefix(static_cast<std::size_t>(end - text_.data()));
    if (text_.starts_with('L')) text_.remove_prefix(1);  // Python 2 wrote 10L
    return number;
  }

  std::optional<Literal> string(char quote) {
    Literal literal{.kind = Literal::Kind::string, .text = {}, .items = {}};
    const auto end = text_.find(quote);
    if (end == std::string_view::npos) return std::nullopt;
    literal.text = text_.substr(0, end);
    if (literal.text.find('\\') != std::string::npos) return std::nullopt;  // no escapes in names we know
    text_.remove_prefix(end + 1);
    return literal;
  }

  std::optional<Literal> sequence(Literal::Kind kind, char close, int depth) {
    Literal literal{.kind = kind, .text = {}, .items = {}};
    while (!take(close)) {
      const bool key = kind == Literal::Kind::dict && literal.items.size() % 2 == 0;
      auto item = value(depth + 1);
      if (!item) return std::nullopt;
      literal.items.push_back(*std::move(item));
      if (key) {
        if (!take(':')) return std::nullopt;
        continue;
      }
      if (take(',')) continue;
      if (!take(close)) return std::nullopt;
      break;
    }
    if (kind == Literal::Kind::dict && literal.items.size() % 2 != 0) return std::nullopt;
    return literal;
  }

  std::string_view text_;
};

// a * b, or the largest value where that is too large.
std::size_t product(std::size_t a, std::size_t b) { return b != 0 && a > kLargest / b ? kLargest : a * b; }
std::size_t sum(std::size_t a, std::size_t b) { return a > kLargest - b ? kLargest : a + b; }

// Elements of a field's shape: a tuple, or one number.
std::size_t elements(const Literal& shape) {
  if (shape.kind == Literal::Kind::integer) return shape.integer;
  std::size_t count = 1;
  for (const Literal& extent : shape.items) count = product(count, extent.integer);
  return count;
}

// Bytes of a value of a type such as "<f4"; nothing for Python objects and for what is not a type.
std::optional<std::size_t> type_bytes(std::string_view type) {
  if (type.size() < 3 || std::string_view("<>|=").find(type[0]) == std::string_view::npos) return std::nullopt;
  if (std::string_view("?bhilqBHILQefdgFDGSaUVMmcfiu").find(type[1]) == std::string_view::npos) return std::nullopt;
  std::size_t count = 0;
  const auto [end, error] = std::from_chars(type.data() + 2, type.data() + type.size(), count);
  const std::string_view rest(end, static_cast<std::size_t>(type.data() + type.size() - end));
  if (error != std::errc{} || !(rest.empty() || rest.starts_with('['))) return std::nullopt;
  return type[1] == 'U' ? product(count, 4) : count;
}

absl::StatusOr<std::size_t> field_bytes(const Literal& type, const std::string& name) {
  if (type.kind == Literal::Kind::string) {
    const auto bytes = type_bytes(type.text);
    if (!bytes) return invalid("field {}: unknown type \"{}\"", name, type.text);
    return *bytes;
  }
  if (type.kind != Literal::Kind::list) return invalid("field {}: unknown type", name);
  std::size_t total = 0;
  for (const Literal& member : type.items) {
    if (member.kind != Literal::Kind::tuple || member.items.size() < 2) return invalid("field {}: unknown type", name);
    auto bytes = field_bytes(member.items[1], name);
    if (!bytes.ok()) return bytes;
    if (member.items.size() > 2) *bytes = product(*bytes, elements(member.items[2]));
    total = sum(total, *bytes);
  }
  return total;
}

absl::Status read_fields(const Literal& descr, NpyHeader& header) {
  for (const Literal& item : descr.items) {
    if (item.kind != Literal::Kind::tuple || item.items.size() < 2 || item.items.size() > 3)
      return invalid("malformed header: a field of descr is not (name, type)");
    // A name may be a pair of a title and the name.
    const Literal& name = item.items[0].items.size() == 2 ? item.items[0].items[1] : item.items[0];
    if (name.kind != Literal::Kind::string) return invalid("malformed header: a field's name is not a string");
    NpyField field{.name = name.text, .type = "a structure", .offset = header.record_bytes};
    auto bytes = field_bytes(item.items[1], field.name);
    if (!bytes.ok()) return bytes.status();
    field.scalar = item.items.size() == 2 && item.items[1].kind == Literal::Kind::string;
    if (item.items[1].kind == Literal::Kind::string) field.type = item.items[1].text;
    if (item.items.size() == 3) {
      *bytes = product(*bytes, elements(item.items[2]));
      field.type = "an array of " + field.type;
    }
    field.bytes = *bytes;
    header.record_bytes = sum(header.record_bytes, *bytes);
    if (field.name.empty()) continue;  // padding
    for (const NpyField& other : header.fields)
      if (other.name == field.name) return invalid("field {} twice", field.name);
    header.fields.push_back(std::move(field));
  }
  return absl::OkStatus();
}

// A plain array: rows of as many values as there are names, or columns one after another in Fortran's order.
absl::Status read_array(const Literal& type, const Literal& shape, bool fortran, std::span<const std::string> names,
                        NpyHeader& header, std::size_t& data_bytes) {
  const auto bytes = field_bytes(type, "of the array");
  if (!bytes.ok()) return bytes.status();
  if (names.empty())
    return invalid("a plain array, whose columns have no names: give them, as in --columns ix,iy,iz,alpha_x,alpha_y");
  if (shape.items.empty() || shape.items.size() > 2)
    return invalid("an array of {} dimensions; one or two are needed", shape.items.size());
  const std::size_t columns = shape.items.size() == 1 ? 1 : shape.items[1].integer;
  if (columns != names.size()) return invalid("{} columns, and {} names for them", columns, names.size());
  header.rows = shape.items[0].integer;
  header.record_bytes = fortran ? *bytes : product(columns, *bytes);
  data_bytes = product(header.rows, product(columns, *bytes));
  for (std::size_t k = 0; k < columns; ++k)
    header.fields.push_back({.name = names[k],
                             .type = type.text,
                             .offset = product(k, fortran ? product(header.rows, *bytes) : *bytes),
                             .bytes = *bytes});
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<NpyHeader> parse_npy_header(std::string_view file, std::span<const std::string> names) {
  if (!file.starts_with("\x93NUMPY")) return invalid("not a .npy file: it does not begin with \\x93NUMPY");
  const auto byte = [&](std::size_t k) { return std::size_t{static_cast<std::uint8_t>(file[k])}; };
  if (file.size() < 10) return invalid("truncated in the header");
  const std::size_t major = byte(6);
  if (major < 1 || major > 3) return invalid("version {} of the .npy format; known are 1, 2 and 3", major);
  const std::size_t begin = major == 1 ? 10 : 12;
  if (file.size() < begin) return invalid("truncated in the header");
  std::size_t length = byte(8) | byte(9) << 8;
  if (major > 1) length |= byte(10) << 16 | byte(11) << 24;
  if (file.size() - begin < length) return invalid("truncated in the header");

  const auto literal = LiteralParser(file.substr(begin, length)).parse();
  const bool dict = literal && literal->kind == Literal::Kind::dict;
  const Literal* descr = dict ? literal->find("descr") : nullptr;
  const Literal* shape = dict ? literal->find("shape") : nullptr;
  if (descr == nullptr || shape == nullptr || shape->kind != Literal::Kind::tuple)
    return invalid("malformed header: no descr and shape in it");

  NpyHeader header;
  header.data_offset = begin + length;
  std::size_t data_bytes = 0;
  if (descr->kind == Literal::Kind::string) {
    const Literal* order = literal->find("fortran_order");
    const bool fortran = order != nullptr && order->integer != 0;
    if (auto status = read_array(*descr, *shape, fortran, names, header, data_bytes); !status.ok()) return status;
  } else {
    if (descr->kind != Literal::Kind::list) return invalid("malformed header: descr is not a type");
    if (!names.empty()) return invalid("it names its columns itself; --columns is for plain arrays");
    if (auto status = read_fields(*descr, header); !status.ok()) return status;
    if (shape->items.size() != 1)
      return invalid("an array of {} dimensions; one is needed (numpy: array.ravel())", shape->items.size());
    header.rows = shape->items[0].integer;
    data_bytes = product(header.rows, header.record_bytes);
  }
  const std::size_t needed = sum(header.data_offset, data_bytes);
  if (needed > file.size())
    return invalid("truncated: {} records of {} bytes need {} bytes, the file has {}", header.rows, header.record_bytes,
                   needed, file.size());
  return header;
}

}  // namespace facetwise::app
