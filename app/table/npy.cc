// .npy tables: the file is mapped and its fields are columns with the record's length as their stride.
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <cstring>
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

class NpyInput final : public InputTable {
 public:
  NpyInput(std::string path, Mapping mapping, NpyHeader header)
      : path_(std::move(path)), mapping_(std::move(mapping)), header_(std::move(header)) {
    for (const NpyField& field : header_.fields) names_.push_back(field.name);
  }

  std::size_t rows() const override { return header_.rows; }
  std::span<const std::string> names() const override { return names_; }

  absl::StatusOr<Column<float>> column(std::size_t index) override {
    const NpyField& field = header_.fields[index];
    if (!field.scalar || field.type != "<f4")
      return invalid("{}: field {} is {}; it must be little-endian float32, '<f4' (numpy: array.astype)", path_,
                     field.name, field.type);
    const char* first = mapping_.data() + header_.data_offset + field.offset;
    const bool aligned =
        reinterpret_cast<std::uintptr_t>(first) % alignof(float) == 0 && header_.record_bytes % alignof(float) == 0;
    if (aligned) return Column<float>(reinterpret_cast<const float*>(first), header_.rows, header_.record_bytes);
    // A packed record of odd length: columns need 4-byte alignment.
    auto& copy = copies_.emplace_back(header_.rows);
    for (std::size_t row = 0; row < header_.rows; ++row)
      std::memcpy(&copy[row], first + row * header_.record_bytes, sizeof(float));
    return Column<float>(copy);
  }

 private:
  std::string path_;
  Mapping mapping_;
  NpyHeader header_;
  std::vector<std::string> names_;
  std::vector<std::vector<float>> copies_;
};

// Records are the float columns, then those of bytes, padded to four bytes.
class NpyOutput final : public OutputTable {
 public:
  NpyOutput(OutputFile file, Mapping mapping, std::size_t data_offset, std::size_t columns, std::size_t rows)
      : file_(std::move(file)),
        mapping_(std::move(mapping)),
        data_(mapping_.data() + data_offset),
        columns_(columns),
        rows_(rows) {}

  OutputColumn<float> column(std::size_t index) override {
    return {reinterpret_cast<float*>(data_) + index, rows_, record_bytes(columns_)};
  }
  OutputColumn<std::uint8_t> byte_column(std::size_t index) override {
    return {reinterpret_cast<std::uint8_t*>(data_) + columns_ * sizeof(float) + index, rows_, record_bytes(columns_)};
  }
  absl::Status commit() override {
    mapping_.unmap();
    return file_.commit();
  }

  static std::size_t record_bytes(std::size_t columns) { return columns * sizeof(float) + 4; }

 private:
  OutputFile file_;
  Mapping mapping_;
  char* data_;
  std::size_t columns_, rows_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<InputTable>> read_npy(const std::string& path) {
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
  auto header = parse_npy_header(mapping.bytes());
  if (!header.ok()) return invalid("{}: {}", path, message(header.status()));
  return std::make_unique<NpyInput>(path, std::move(mapping), *std::move(header));
}

absl::StatusOr<std::unique_ptr<OutputTable>> create_npy(const std::string& path, const TableColumns& columns,
                                                        std::size_t rows) {
  std::string header = "{'descr': [";
  for (const std::string& name : columns.floats) header += fmt::format("('{}', '<f4'), ", name);
  for (const std::string& name : columns.bytes) header += fmt::format("('{}', '|u1'), ", name);
  header += fmt::format("('', '|V{}')], 'fortran_order': False, 'shape': ({},), }}", 4 - columns.bytes.size(), rows);
  // As NumPy does it: spaces, so that the records begin at a multiple of 64, and a line end.
  constexpr std::size_t kPreamble = 10, kAlignment = 64;
  header.append(kAlignment - (kPreamble + header.size() + 1) % kAlignment, ' ').push_back('\n');
  const auto length = static_cast<std::uint16_t>(header.size());
  std::string preamble("\x93NUMPY\x01\x00", 8);
  preamble.push_back(static_cast<char>(length & 0xff));
  preamble.push_back(static_cast<char>(length >> 8));
  header.insert(0, preamble);

  auto file = OutputFile::create(path);
  if (!file.ok()) return file.status();
  if (auto status = file->write(header); !status.ok()) return status;
  // Space is reserved now: a full disk is an error here, not a fault while kernels write.
  const std::size_t size = header.size() + rows * NpyOutput::record_bytes(columns.floats.size());
  if (const int error = ::posix_fallocate(file->descriptor(), 0, static_cast<off_t>(size)); error != 0)
    return invalid("{}: cannot reserve {} bytes: {}", path, size, std::strerror(error));
  Mapping mapping;
  if (!mapping.map(file->descriptor(), size, true)) return invalid("{}: {}", path, std::strerror(errno));
  return std::make_unique<NpyOutput>(*std::move(file), std::move(mapping), header.size(), columns.floats.size(), rows);
}

}  // namespace facetwise::app
