#include "app/file_call.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "app/errors.h"

namespace facetwise::app {
namespace {

struct FileColumn {
  std::string_view name;   // in files
  std::string_view field;  // in the batch: input_fields() and output_fields()
};

constexpr FileColumn kInputColumns[] = {
    {"ix", "incident.x"},   {"iy", "incident.y"}, {"iz", "incident.z"}, {"alpha_x", "alpha_x"},
    {"alpha_y", "alpha_y"}, {"ox", "outgoing.x"}, {"oy", "outgoing.y"}, {"oz", "outgoing.z"},
    {"u1", "u1"},           {"u2", "u2"},         {"u3", "u3"}};
constexpr FileColumn kOutputColumns[] = {
    {"ox", "out.outgoing.x"}, {"oy", "out.outgoing.y"}, {"oz", "out.outgoing.z"},
    {"mx", "out.normal.x"},   {"my", "out.normal.y"},   {"mz", "out.normal.z"},
    {"pdf", "out.pdf"},       {"weight", "out.weight"}, {"value", "out.value"}};

template <class Fields>
const auto& field_named(const Fields& fields, std::string_view name) {
  return *std::find_if(fields.begin(), fields.end(), [&](const auto& field) { return field.name == name; });
}

bool known_column(std::string_view name) {
  const auto is_it = [&](const FileColumn& column) { return column.name == name; };
  return std::any_of(std::begin(kInputColumns), std::end(kInputColumns), is_it) ||
         std::any_of(std::begin(kOutputColumns), std::end(kOutputColumns), is_it) || name == "status";
}

// Turns a table's columns into a batch's inputs.
class Inputs {
 public:
  Inputs(const FileCall& call, InputTable& table)
      : call_(call), table_(table), used_(table.names().size(), false) {}

  absl::Status fill(Batch& batch) {
    for (const std::string& name : table_.names())
      if (!known_column(name))
        return invalid("{}: unknown column {}; known are ix iy iz alpha_x alpha_y u1 u2 u3 ox oy oz", shown(),
                       name);
    for (const FileColumn& column : kInputColumns) {
      const InputField& field = field_named(input_fields(), column.field);
      if (!(field.operations & bit(call_.operation))) continue;
      if (column.field.starts_with("alpha") && !call_.alpha.empty()) {
        if (find(column.name) >= 0) return invalid("--alpha: {} has a column {} too", shown(), column.name);
        field.column(batch) = column.field == "alpha_x" ? call_.alpha.front() : call_.alpha.back();
        continue;
      }
      const bool random = column.name.starts_with("u");
      if (random && call_.seed) {
        if (find(column.name) >= 0) return invalid("--seed: {} has a column {} too", shown(), column.name);
        continue;
      }
      if (column.name == "u3" && !uses_u3(call_.sampler)) continue;
      if (auto status = take(column.name, random, field.column(batch)); !status.ok()) return status;
    }
    batch.lanes = table_.rows();
    if (call_.seed) batch.generator = {.seed = *call_.seed, .id = {}, .first_id = call_.first_id};
    return absl::OkStatus();
  }

  std::vector<std::string> ignored() const {
    std::vector<std::string> names;
    for (std::size_t k = 0; k < used_.size(); ++k)
      if (!used_[k]) names.push_back(table_.names()[k]);
    return names;
  }

 private:
  std::string shown() const { return call_.input == "-" ? "standard input" : call_.input; }

  int find(std::string_view name) const {
    const auto names = table_.names();
    const auto found = std::find(names.begin(), names.end(), name);
    return found == names.end() ? -1 : static_cast<int>(found - names.begin());
  }

  absl::Status take(std::string_view name, bool random, Column<float>& column) {
    const int index = find(name);
    if (index < 0) {
      const std::string_view instead = random ? " (or give --seed instead of columns u1 u2 u3)"
                                       : name.starts_with("alpha") ? " (or give --alpha)"
                                                                   : "";
      return invalid("{}: no column {}{}", shown(), name, instead);
    }
    auto values = table_.column(static_cast<std::size_t>(index));
    if (!values.ok()) return values.status();
    used_[static_cast<std::size_t>(index)] = true;
    column = *values;
    return absl::OkStatus();
  }

  const FileCall& call_;
  InputTable& table_;
  std::vector<bool> used_;
};

}  // namespace

absl::StatusOr<FileCallResult> run_on_files(const FileCall& call, Engine& engine) {
  auto input = read_table(call.input);
  if (!input.ok()) return input.status();
  Batch batch;
  batch.model = call.model;
  batch.sampler = call.sampler;
  Inputs inputs(call, **input);
  if (auto status = inputs.fill(batch); !status.ok()) return status;

  std::vector<std::string> names;
  for (const FileColumn& column : kOutputColumns)
    if (field_named(output_fields(), column.field).operations & bit(call.operation))
      names.emplace_back(column.name);
  auto output = create_table(call.output, names, batch.lanes);
  if (!output.ok()) return output.status();
  std::size_t index = 0;
  for (const FileColumn& column : kOutputColumns) {
    const OutputField& field = field_named(output_fields(), column.field);
    if (field.operations & bit(call.operation)) field.column(batch) = (*output)->column(index++);
  }
  batch.out.status = (*output)->status();

  const auto start = std::chrono::steady_clock::now();
  auto statistics = engine.run(call.operation, batch);
  if (!statistics.ok()) return statistics.status();
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  if (auto status = (*output)->commit(); !status.ok()) return status;
  return FileCallResult{.statistics = *statistics, .ignored = inputs.ignored(), .seconds = seconds.count()};
}

}  // namespace facetwise::app
