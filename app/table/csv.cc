// SPDX-License-Identifier: Apache-2.0
// CSV tables.
#include <fcntl.h>
#include <fmt/compile.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <deque>
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

// Takes the first value from the line, and says whether another follows. `quoted` keeps what had quotes within quotes.
struct Cell {
  std::string_view text;
  bool more = false, broken = false;
};
Cell next_cell(std::string_view& line, char separator, std::deque<std::string>& quoted) {
  Cell cell;
  const std::string_view rest =
      line.substr(std::min(line.find_first_not_of(separator == '\t' ? " " : " \t"), line.size()));
  if (rest.starts_with('"')) {
    std::string text;
    std::size_t at = 1;
    for (; at < rest.size(); ++at) {
      if (rest[at] == '"' && !(at + 1 < rest.size() && rest[at + 1] == '"')) break;
      if (rest[at] == '"') ++at;
      text.push_back(rest[at]);
    }
    line = rest.substr(std::min(at + 1, rest.size()));
    const auto end = line.find(separator);
    cell.broken = at >= rest.size() || !trim(line.substr(0, end)).empty();
    cell.text = quoted.emplace_back(std::move(text));
    cell.more = end != std::string_view::npos;
    line.remove_prefix(cell.more ? end + 1 : line.size());
    return cell;
  }
  const auto end = line.find(separator);
  cell.text = trim(line.substr(0, end));
  cell.more = end != std::string_view::npos;
  line.remove_prefix(cell.more ? end + 1 : line.size());
  return cell;
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

// Values are kept as text, since only some columns are read as numbers.
class CsvInput final : public InputTable {
 public:
  absl::Status parse(const std::string& path, std::string whole) {
    path_ = path;
    text_ = std::move(whole);
    std::string_view text = text_;
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    if (blank(text)) return invalid("{}: empty; the first line names the columns", path);
    std::string_view header = next_line(text);
    for (const char separator : {',', ';', '\t'})
      if (header.find(separator_ = separator) != std::string_view::npos) break;
    if (header.find(separator_) == std::string_view::npos) separator_ = ',';
    for (bool more = true; more;) {
      const Cell cell = next_cell(header, separator_, quoted_);
      more = cell.more;
      if (cell.broken) return invalid("{}, line 1: a quote without its end, or text behind it", path);
      if (cell.text.empty()) return invalid("{}, line 1: a column without a name", path);
      if (std::find(names_.begin(), names_.end(), cell.text) != names_.end())
        return invalid("{}, line 1: column {} twice", path, cell.text);
      names_.emplace_back(cell.text);
    }
    cells_.reserve(names_.size() * (static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')) + 1));
    for (std::size_t number = 2; !text.empty(); ++number) {
      const std::string_view line = next_line(text);
      if (blank(line) && blank(text)) break;
      if (auto status = parse_row(number, line); !status.ok()) return status;
    }
    return absl::OkStatus();
  }

  std::size_t rows() const override { return cells_.size() / names_.size(); }
  std::span<const std::string> names() const override { return names_; }

  absl::StatusOr<Column<float>> column(std::size_t index) override {
    auto& values = columns_.emplace_back();
    values.reserve(rows());
    for (std::size_t row = 0; row < rows(); ++row) {
      const std::string_view text = cell(row, index);
      const std::optional<float> value = parse_float(text);
      if (!value) return invalid("{}, line {}, column {}: \"{}\" is not a number", path_, row + 2, names_[index], text);
      values.push_back(*value);
    }
    return Column<float>(values);
  }

  absl::StatusOr<PassedColumn> passed(std::size_t index) override {
    std::size_t longest = 1;
    for (std::size_t row = 0; row < rows(); ++row) longest = std::max(longest, cell(row, index).size());
    std::string& block = blocks_.emplace_back(longest * rows(), '\0');
    for (std::size_t row = 0; row < rows(); ++row) cell(row, index).copy(&block[longest * row], longest);
    return PassedColumn{names_[index], fmt::format("|S{}", longest), block.data(), longest, longest};
  }

 private:
  std::string_view cell(std::size_t row, std::size_t column) const { return cells_[row * names_.size() + column]; }

  absl::Status parse_row(std::size_t number, std::string_view line) {
    std::size_t column = 0;
    for (bool more = true; more; ++column) {
      const Cell cell = next_cell(line, separator_, quoted_);
      more = cell.more;
      if (cell.broken) return invalid("{}, line {}: a quote without its end, or text behind it", path_, number);
      if (column < names_.size()) cells_.push_back(cell.text);
    }
    if (column != names_.size())
      return invalid("{}, line {}: {} values for {} columns", path_, number, column, names_.size());
    return absl::OkStatus();
  }

  std::string path_, text_;
  char separator_ = ',';
  std::deque<std::string> quoted_, blocks_;
  std::vector<std::string> names_;
  std::vector<std::string_view> cells_;  // row by row
  std::deque<std::vector<float>> columns_;
};

// Within quotes where it would not be one value without.
std::string in_quotes(std::string text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos && trim(text) == text) return text;
  std::string result = "\"";
  for (const char c : text) result.append(c == '"' ? 2 : 1, c);
  return result + "\"";
}

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
    for (const auto& column : names_.passed) append(in_quotes(column.name)), append(",");
    for (const auto& name : names_.floats) append(name), append(",");
    for (const auto& name : names_.bytes) append(name), append(",");
    end_line();
    for (std::size_t row = 0; row < rows_; ++row) {
      for (const auto& column : names_.passed) append(in_quotes(passed_text(column, row).value_or(""))), append(",");
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
  if (auto status = table->parse(shown(path), std::move(text)); !status.ok()) return status;
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
  for (const PassedColumn& column : columns.passed)
    if (rows > 0 && !passed_text(column, 0))
      return invalid("{}: column {} has the type {}, which CSV has no text for", path, column.name, column.type);
  std::optional<OutputFile> file;
  if (path != "-") {
    auto created = OutputFile::create(path);
    if (!created.ok()) return created.status();
    file.emplace(*std::move(created));
  }
  return std::make_unique<CsvOutput>(columns, rows, std::move(file));
}

}  // namespace facetwise::app
