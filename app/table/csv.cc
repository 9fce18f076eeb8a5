// CSV tables.
#include <fcntl.h>
#include <fmt/compile.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <optional>
#include <utility>

#include "app/errors.h"
#include "app/table/formats.h"
#include "app/table/output_file.h"

namespace facetwise::app {
namespace {

std::string shown(const std::string& path) { return path == "-" ? "standard input" : path; }

std::string_view trim(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

bool blank(std::string_view text) { return text.find_first_not_of(" \t\r\n") == std::string_view::npos; }

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> values;
  for (;;) {
    const auto comma = line.find(',');
    values.push_back(trim(line.substr(0, comma)));
    if (comma == std::string_view::npos) return values;
    line.remove_prefix(comma + 1);
  }
}

// Takes the first line, without its end, from the text.
std::string_view next_line(std::string_view& text) {
  const auto end = text.find('\n');
  std::string_view line = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

std::optional<float> parse_float(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  const char* end = text.data() + text.size();
  float value = 0;
  auto result = std::from_chars(text.data(), end, value);
  if (result.ec == std::errc::result_out_of_range) {
    // Beyond float's range: what conversion from double gives, 0 or infinity.
    double wide = 0;
    result = std::from_chars(text.data(), end, wide);
    value = static_cast<float>(wide);
  }
  if (result.ec != std::errc{} || result.ptr != end) return std::nullopt;
  return value;
}

class CsvInput final : public InputTable {
 public:
  absl::Status parse(const std::string& path, std::string_view text) {
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    if (blank(text)) return invalid("{}: empty; the first line names the columns", path);
    for (const std::string_view name : split(next_line(text))) {
      if (name.empty()) return invalid("{}, line 1: a column without a name", path);
      if (std::find(names_.begin(), names_.end(), name) != names_.end())
        return invalid("{}, line 1: column {} twice", path, name);
      names_.emplace_back(name);
    }
    columns_.resize(names_.size());
    const auto expected = static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')) + 1;
    for (auto& column : columns_) column.reserve(expected);
    for (std::size_t number = 2; !text.empty(); ++number) {
      const std::string_view line = next_line(text);
      if (blank(line) && blank(text)) break;
      if (auto status = parse_row(path, number, line); !status.ok()) return status;
    }
    return absl::OkStatus();
  }

  std::size_t rows() const override { return columns_.front().size(); }
  std::span<const std::string> names() const override { return names_; }
  absl::StatusOr<Column<float>> column(std::size_t index) override { return Column<float>(columns_[index]); }

 private:
  absl::Status parse_row(const std::string& path, std::size_t number, std::string_view line) {
    std::size_t column = 0;
    for (bool more = true; more; ++column) {
      const auto comma = line.find(',');
      more = comma != std::string_view::npos;
      if (column < columns_.size()) {
        const std::string_view text = trim(line.substr(0, comma));
        const std::optional<float> value = parse_float(text);
        if (!value)
          return invalid("{}, line {}, column {}: \"{}\" is not a number", path, number, names_[column], text);
        columns_[column].push_back(*value);
      }
      line.remove_prefix(more ? comma + 1 : line.size());
    }
    if (column != columns_.size())
      return invalid("{}, line {}: {} values for {} columns", path, number, column, columns_.size());
    return absl::OkStatus();
  }

  std::vector<std::string> names_;
  std::vector<std::vector<float>> columns_;
};

class CsvOutput final : public OutputTable {
 public:
  CsvOutput(TableColumns names, std::size_t rows, std::optional<OutputFile> file)
      : names_(std::move(names)),
        rows_(rows),
        columns_(names_.floats.size(), std::vector<float>(rows)),
        bytes_(names_.bytes.size(), std::vector<std::uint8_t>(rows)),
        file_(std::move(file)) {}

  OutputColumn<float> column(std::size_t index) override { return OutputColumn<float>(columns_[index]); }
  OutputColumn<std::uint8_t> byte_column(std::size_t index) override {
    return OutputColumn<std::uint8_t>(bytes_[index]);
  }

  absl::Status commit() override {
    fmt::memory_buffer text;
    const auto append = [&](std::string_view piece) { text.append(piece.data(), piece.data() + piece.size()); };
    const auto end_line = [&] { text[text.size() - 1] = '\n'; };  // instead of the last comma
    for (const auto& name : names_.floats) append(name), append(",");
    for (const auto& name : names_.bytes) append(name), append(",");
    end_line();
    for (std::size_t row = 0; row < rows_; ++row) {
      for (const auto& column : columns_) fmt::format_to(fmt::appender(text), FMT_COMPILE("{},"), column[row]);
      for (const auto& column : bytes_) fmt::format_to(fmt::appender(text), FMT_COMPILE("{},"), column[row]);
      end_line();
      if (text.size() < kPiece) continue;
      if (auto status = write({text.data(), text.size()}); !status.ok()) return status;
      text.clear();
    }
    if (auto status = write({text.data(), text.size()}); !status.ok()) return status;
    return file_ ? file_->commit() : absl::OkStatus();
  }

 private:
  static constexpr std::size_t kPiece = std::size_t{1} << 20;

  absl::Status write(std::string_view text) {
    return file_ ? file_->write(text) : write_all(STDOUT_FILENO, text, "standard output");
  }

  TableColumns names_;
  std::size_t rows_;
  std::vector<std::vector<float>> columns_;
  std::vector<std::vector<std::uint8_t>> bytes_;
  std::optional<OutputFile> file_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<InputTable>> parse_csv(const std::string& path, std::string text) {
  auto table = std::make_unique<CsvInput>();
  if (auto status = table->parse(shown(path), text); !status.ok()) return status;
  return table;
}

absl::StatusOr<std::unique_ptr<InputTable>> read_csv(const std::string& path) {
  const int descriptor = path == "-" ? STDIN_FILENO : ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  std::string text;
  int failure = descriptor < 0 ? errno : 0;
  while (failure == 0) {
    constexpr std::size_t kChunk = std::size_t{1} << 20;
    const std::size_t size = text.size();
    text.resize(size + kChunk);
    const ssize_t got = ::read(descriptor, text.data() + size, kChunk);
    if (got < 0 && errno != EINTR) failure = errno;
    text.resize(size + static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    if (got == 0) break;
  }
  if (descriptor >= 0 && path != "-") ::close(descriptor);
  if (failure != 0) return invalid("{}: {}", shown(path), std::strerror(failure));
  return parse_csv(path, std::move(text));
}

absl::StatusOr<std::unique_ptr<OutputTable>> create_csv(const std::string& path, const TableColumns& columns,
                                                        std::size_t rows) {
  std::optional<OutputFile> file;
  if (path != "-") {
    auto created = OutputFile::create(path);
    if (!created.ok()) return created.status();
    file.emplace(*std::move(created));
  }
  return std::make_unique<CsvOutput>(columns, rows, std::move(file));
}

}  // namespace facetwise::app
