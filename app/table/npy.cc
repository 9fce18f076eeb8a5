// SPDX-License-Identifier: Apache-2.0
// .npy tables: the file is mapped and its fields are columns with the record's length as their stride.
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zip.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <deque>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "app/errors.h"
#include "app/table/formats.h"
#include "app/table/npy_header.h"
#include "app/table/output_file.h"

namespace facetwise::app {
namespace {

static_assert(std::endian::native == std::endian::little, "columns are used as they lie in the file");

// A file's bytes in memory.
class Mapping {
 public:
  Mapping() = default;
  Mapping(Mapping&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  Mapping& operator=(Mapping&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }
  ~Mapping() { unmap(); }

  // False, with errno set, if it cannot be mapped.
  bool map(int descriptor, std::size_t size, bool writable) {
    void* data = ::mmap(nullptr, size, writable ? PROT_READ | PROT_WRITE : PROT_READ,
                        writable ? MAP_SHARED : MAP_PRIVATE, descriptor, 0);
    if (data == MAP_FAILED) return false;
    data_ = static_cast<char*>(data);
    size_ = size;
    return true;
  }
  void unmap() {
    if (data_ != nullptr) ::munmap(data_, size_);
    data_ = nullptr;
  }
  char* data() const { return data_; }
  std::string_view bytes() const { return {data_, size_}; }

 private:
  char* data_ = nullptr;
  std::size_t size_ = 0;
};

// The value at `from` of a type's size, its bytes in this machine's order.
template <class T>
T value_at(const char* from, bool big_endian) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, from, sizeof(T));
  if (big_endian) std::reverse(std::begin(bytes), std::end(bytes));
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

// IEEE half precision: every value is a float.
float from_half(std::uint16_t half) {
  const std::uint32_t sign = static_cast<std::uint32_t>(half & 0x8000u) << 16, rest = half & 0x7fffu;
  if (rest >= 0x7c00u) return std::bit_cast<float>(sign | 0x7f800000u | (rest & 0x3ffu) << 13);
  const float scaled = std::bit_cast<float>(rest << 13) * 0x1p112f;  // denormals too
  return std::bit_cast<float>(sign | std::bit_cast<std::uint32_t>(scaled));
}

std::optional<float> float_at(const char* from, std::string_view type) {
  const bool big = type[0] == '>';
  if (type.substr(1) == "f2") return from_half(value_at<std::uint16_t>(from, big));
  if (type.substr(1) == "f4") return value_at<float>(from, big);
  if (type.substr(1) == "f8") return static_cast<float>(value_at<double>(from, big));
  return std::nullopt;
}

// Columns of an array whose bytes are in memory.
class NpyColumns {
 public:
  // `path` is for errors.
  static absl::StatusOr<NpyColumns> read(const std::string& path, std::string_view bytes,
                                         std::span<const std::string> names) {
    auto header = parse_npy_header(bytes, names);
    if (!header.ok()) return invalid("{}: {}", path, message(header.status()));
    return NpyColumns(path, bytes, *std::move(header));
  }

  const NpyHeader& header() const { return header_; }

  absl::StatusOr<Column<float>> column(std::size_t index) {
    const NpyField& field = header_.fields[index];
    const char* first = bytes_.data() + header_.data_offset + field.offset;
    const bool aligned =
        reinterpret_cast<std::uintptr_t>(first) % alignof(float) == 0 && header_.record_bytes % alignof(float) == 0;
    if (field.scalar && field.type == "<f4" && aligned)
      return Column<float>(reinterpret_cast<const float*>(first), header_.rows, header_.record_bytes);
    const char zeros[8] = {};
    if (!field.scalar || !float_at(zeros, field.type))
      return invalid("{}: field {} is {}; it must be float32, float64 or float16 (numpy: array.astype)", path_,
                     field.name, field.type);
    auto& copy = copies_.emplace_back(header_.rows);
    for (std::size_t row = 0; row < header_.rows; ++row)
      copy[row] = *float_at(first + row * header_.record_bytes, field.type);
    return Column<float>(copy);
  }

  absl::StatusOr<PassedColumn> passed(std::size_t index) const {
    const NpyField& field = header_.fields[index];
    if (!field.scalar) return invalid("{}: field {} is {}", path_, field.name, field.type);
    return PassedColumn{field.name, field.type, bytes_.data() + header_.data_offset + field.offset, field.bytes,
                        header_.record_bytes};
  }

 private:
  NpyColumns(std::string path, std::string_view bytes, NpyHeader header)
      : path_(std::move(path)), bytes_(bytes), header_(std::move(header)) {}

  std::string path_;
  std::string_view bytes_;
  NpyHeader header_;
  std::deque<std::vector<float>> copies_;
};

class NpyInput final : public InputTable {
 public:
  NpyInput(Mapping mapping, NpyColumns columns) : mapping_(std::move(mapping)), columns_(std::move(columns)) {
    for (const NpyField& field : columns_.header().fields) names_.push_back(field.name);
  }

  std::size_t rows() const override { return columns_.header().rows; }
  std::span<const std::string> names() const override { return names_; }
  absl::StatusOr<Column<float>> column(std::size_t index) override { return columns_.column(index); }
  absl::StatusOr<PassedColumn> passed(std::size_t index) override { return columns_.passed(index); }

 private:
  Mapping mapping_;
  NpyColumns columns_;
  std::vector<std::string> names_;
};

class NpzInput final : public InputTable {
 public:
  absl::Status read(const std::string& path) {
    int error = 0;
    const std::unique_ptr<zip_t, decltype(&zip_discard)> zip(zip_open(path.c_str(), ZIP_RDONLY, &error), zip_discard);
    if (!zip) {
      zip_error_t what;
      zip_error_init_with_code(&what, error);
      const std::string text = zip_error_strerror(&what);
      zip_error_fini(&what);
      return invalid("{}: {}", path, text);
    }
    std::error_code unknown;
    const zip_uint64_t file_bytes = std::filesystem::file_size(path, unknown);  // the largest number where unknown
    const zip_int64_t entries = zip_get_num_entries(zip.get(), 0);
    for (zip_int64_t k = 0; k < entries; ++k) {
      zip_stat_t stat;
      const auto index = static_cast<zip_uint64_t>(k);
      if (zip_stat_index(zip.get(), index, 0, &stat) != 0) return invalid("{}: {}", path, zip_strerror(zip.get()));
      std::string name = stat.name;
      if (!name.ends_with(".npy")) return invalid("{}: {} in it is not a .npy file", path, name);
      constexpr zip_uint64_t kLargestArray = zip_uint64_t{1} << 34;
      if (stat.size > kLargestArray) return invalid("{}: {} in it has {} bytes, too many", path, name, stat.size);
      // Before memory is taken for it: a file that lies about a size is small, and deflate cannot do better than this.
      constexpr zip_uint64_t kMostExpansion = 1040;
      if (stat.size / kMostExpansion > std::min(stat.comp_size, file_bytes))
        return invalid("{}: {} in it announces {} bytes, more than can be in the file", path, name, stat.size);
      std::string& bytes = bytes_.emplace_back(stat.size, '\0');
      const std::unique_ptr<zip_file_t, decltype(&zip_fclose)> file(zip_fopen_index(zip.get(), index, 0), zip_fclose);
      if (!file || zip_fread(file.get(), bytes.data(), bytes.size()) != static_cast<zip_int64_t>(bytes.size()))
        return invalid("{}: {} in it cannot be read: {}", path, name, zip_strerror(zip.get()));
      name.resize(name.size() - 4);
      auto columns = NpyColumns::read(fmt::format("{}, {}", path, name), bytes, std::span(&name, 1));
      if (!columns.ok()) return columns.status();
      if (!arrays_.empty() && columns->header().rows != rows())
        return invalid("{}: {} has {} values, {} has {}", path, name, columns->header().rows, names_.front(), rows());
      arrays_.push_back(*std::move(columns));
      names_.push_back(std::move(name));
    }
    return arrays_.empty() ? invalid("{}: no arrays in it", path) : absl::OkStatus();
  }

  std::size_t rows() const override { return arrays_.front().header().rows; }
  std::span<const std::string> names() const override { return names_; }
  absl::StatusOr<Column<float>> column(std::size_t index) override { return arrays_[index].column(0); }
  absl::StatusOr<PassedColumn> passed(std::size_t index) override { return arrays_[index].passed(0); }

 private:
  std::deque<std::string> bytes_;
  std::vector<NpyColumns> arrays_;
  std::vector<std::string> names_;
};

// Records are the float columns, those of bytes, padded to four bytes, and what is passed on, padded too.
class NpyOutput final : public OutputTable {
 public:
  NpyOutput(OutputFile file, Mapping mapping, std::size_t data_offset, const TableColumns& columns, std::size_t rows)
      : file_(std::move(file)),
        mapping_(std::move(mapping)),
        data_(mapping_.data() + data_offset),
        floats_(columns.floats.size()),
        record_(record_bytes(columns)),
        rows_(rows) {
    std::size_t at = own_bytes(columns);
    for (const PassedColumn& column : columns.passed) {
      for (std::size_t row = 0; row < rows; ++row)
        std::memcpy(data_ + row * record_ + at, column.data + row * column.stride, column.bytes);
      at += column.bytes;
    }
  }

  OutputColumn<float> column(std::size_t index) override {
    return {reinterpret_cast<float*>(data_) + index, rows_, record_};
  }
  OutputColumn<std::uint8_t> byte_column(std::size_t index) override {
    return {reinterpret_cast<std::uint8_t*>(data_) + floats_ * sizeof(float) + index, rows_, record_};
  }
  absl::Status commit() override {
    mapping_.unmap();
    return file_.commit();
  }

  static std::size_t own_bytes(const TableColumns& columns) { return columns.floats.size() * sizeof(float) + 4; }
  static std::size_t passed_bytes(const TableColumns& columns) {
    std::size_t bytes = 0;
    for (const PassedColumn& column : columns.passed) bytes += column.bytes;
    return bytes;
  }
  static std::size_t record_bytes(const TableColumns& columns) {
    return (own_bytes(columns) + passed_bytes(columns) + 3) / 4 * 4;
  }

 private:
  OutputFile file_;
  Mapping mapping_;
  char* data_;
  std::size_t floats_, record_, rows_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<InputTable>> read_npy(const std::string& path, std::span<const std::string> names) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return invalid("{}: {}", path, std::strerror(errno));
  struct stat file;
  Mapping mapping;
  std::string failure;
  if (::fstat(descriptor, &file) != 0)
    failure = std::strerror(errno);
  else if (!S_ISREG(file.st_mode))
    failure = "not a regular file; .npy is read from regular files only";
  else if (file.st_size == 0)
    failure = "empty";
  else if (!mapping.map(descriptor, static_cast<std::size_t>(file.st_size), false))
    failure = std::strerror(errno);
  ::close(descriptor);
  if (!failure.empty()) return invalid("{}: {}", path, failure);
  auto columns = NpyColumns::read(path, mapping.bytes(), names);
  if (!columns.ok()) return columns.status();
  return std::make_unique<NpyInput>(std::move(mapping), *std::move(columns));
}

absl::StatusOr<std::unique_ptr<InputTable>> read_npz(const std::string& path) {
  auto table = std::make_unique<NpzInput>();
  if (auto status = table->read(path); !status.ok()) return status;
  return table;
}

std::optional<std::string> passed_text(const PassedColumn& column, std::size_t row) {
  const char* from = column.data + row * column.stride;
  const bool big = column.type[0] == '>';
  const char kind = column.type[1];
  if (const auto value = float_at(from, column.type); value && column.bytes != 8) return fmt::format("{}", *value);
  if (kind == 'f' && column.bytes == 8) return fmt::format("{}", value_at<double>(from, big));
  if (kind == 'b') return *from ? "True" : "False";
  if (kind == 'i') {
    switch (column.bytes) {
      case 1: return fmt::format("{}", static_cast<int>(value_at<std::int8_t>(from, big)));
      case 2: return fmt::format("{}", value_at<std::int16_t>(from, big));
      case 4: return fmt::format("{}", value_at<std::int32_t>(from, big));
      case 8: return fmt::format("{}", value_at<std::int64_t>(from, big));
      default: return std::nullopt;
    }
  }
  if (kind == 'u') {
    switch (column.bytes) {
      case 1: return fmt::format("{}", static_cast<unsigned>(value_at<std::uint8_t>(from, big)));
      case 2: return fmt::format("{}", value_at<std::uint16_t>(from, big));
      case 4: return fmt::format("{}", value_at<std::uint32_t>(from, big));
      case 8: return fmt::format("{}", value_at<std::uint64_t>(from, big));
      default: return std::nullopt;
    }
  }
  if (kind == 'S') {
    std::string text(from, column.bytes);
    text.resize(text.find_last_not_of('\0') + 1);
    return text;
  }
  if (kind == 'U') {  // UTF-32
    std::string text;
    for (std::size_t at = 0; at < column.bytes; at += 4) {
      const auto c = value_at<std::uint32_t>(from + at, big);
      if (c == 0) break;
      const auto tail = [&](int shift) { text.push_back(static_cast<char>(0x80 | (c >> shift & 0x3f))); };
      if (c < 0x80) {
        text.push_back(static_cast<char>(c));
      } else if (c < 0x800) {
        text.push_back(static_cast<char>(0xc0 | c >> 6)), tail(0);
      } else if (c < 0x10000) {
        text.push_back(static_cast<char>(0xe0 | c >> 12)), tail(6), tail(0);
      } else {
        text.push_back(static_cast<char>(0xf0 | (c >> 18 & 7))), tail(12), tail(6), tail(0);
      }
    }
    return text;
  }
  return std::nullopt;
}

absl::StatusOr<std::unique_ptr<OutputTable>> create_npy(const std::string& path, const TableColumns& columns,
                                                        std::size_t rows) {
  std::string header = "{'descr': [";
  for (const std::string& name : columns.floats) header += fmt::format("('{}', '<f4'), ", name);
  for (const std::string& name : columns.bytes) header += fmt::format("('{}', '|u1'), ", name);
  header += fmt::format("('', '|V{}'), ", 4 - columns.bytes.size());
  // A name may hold what a Python string cannot as it is.
  const auto quoted = [](const std::string& name) {
    std::string text;
    for (const char c : name) text += c == '\'' || c == '\\' ? fmt::format("\\{}", c) : std::string(1, c);
    return text;
  };
  for (const PassedColumn& column : columns.passed)
    header += fmt::format("('{}', '{}'), ", quoted(column.name), column.type);
  if (const std::size_t odd = NpyOutput::passed_bytes(columns) % 4; odd != 0)
    header += fmt::format("('', '|V{}'), ", 4 - odd);
  header.resize(header.size() - 2);
  header += fmt::format("], 'fortran_order': False, 'shape': ({},), }}", rows);
  // Version 1 where it can be, else 3, whose names are UTF-8 and whose length has four bytes.
  const bool ascii =
      std::all_of(header.begin(), header.end(), [](char c) { return static_cast<unsigned char>(c) < 128; });
  const bool old = ascii && header.size() < 65000;
  // As NumPy does it: spaces, so that the records begin at a multiple of 64, and a line end.
  constexpr std::size_t kAlignment = 64;
  const std::size_t preamble_bytes = old ? 10 : 12;
  header.append(kAlignment - (preamble_bytes + header.size() + 1) % kAlignment, ' ').push_back('\n');
  std::string preamble("\x93NUMPY\x01\x00", 8);
  if (!old) preamble[6] = 3;
  for (std::size_t k = 0; k < preamble_bytes - 8; ++k)
    preamble.push_back(static_cast<char>(header.size() >> 8 * k & 0xff));
  header.insert(0, preamble);

  auto file = OutputFile::create(path);
  if (!file.ok()) return file.status();
  if (auto status = file->write(header); !status.ok()) return status;
  // Space is reserved now: a full disk is an error here, not a fault while kernels write.
  const std::size_t size = header.size() + rows * NpyOutput::record_bytes(columns);
  if (const int error = ::posix_fallocate(file->descriptor(), 0, static_cast<off_t>(size)); error != 0)
    return invalid("{}: cannot reserve {} bytes: {}", path, size, std::strerror(error));
  Mapping mapping;
  if (!mapping.map(file->descriptor(), size, true)) return invalid("{}: {}", path, std::strerror(errno));
  return std::make_unique<NpyOutput>(*std::move(file), std::move(mapping), header.size(), columns, rows);
}

}  // namespace facetwise::app
