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
    {"u1", "u1"},           {"u2", "u2"},         {"u3", "u3"},
    {"mean_slope_x", "mean_slope_x"},
    {"mean_slope_y", "mean_slope_y"},
    {"slope_correlation", "slope_correlation"},
    {"eta", "eta"},         {"f0", "f0"},         {"f90", "f90"}};
constexpr FileColumn kOutputColumns[] = {
    {"ox", "out.outgoing.x"}, {"oy", "out.outgoing.y"}, {"oz", "out.outgoing.z"},
    {"mx", "out.normal.x"},   {"my", "out.normal.y"},   {"mz", "out.normal.z"},
    {"pdf", "out.pdf"},       {"weight", "out.weight"}, {"value", "out.value"},
    {"branch_probability", "out.branch_probability"},
    {"eta_scale", "out.eta_scale"}};
constexpr FileColumn kByteColumns[] = {{"event", "out.event"}, {"status", "out.status"}};

template <class Fields>
const auto& field_named(const Fields& fields, std::string_view name) {
  return *std::find_if(fields.begin(), fields.end(), [&](const auto& field) { return field.name == name; });
}

bool known_column(std::string_view name) {
  const auto is_it = [&](const FileColumn& column) { return column.name == name; };
  return std::any_of(std::begin(kInputColumns), std::end(kInputColumns), is_it) ||
         std::any_of(std::begin(kOutputColumns), std::end(kOutputColumns), is_it) ||
         std::any_of(std::begin(kByteColumns), std::end(kByteColumns), is_it);
}

std::string known_inputs() {
  std::string names;
  for (const FileColumn& column : kInputColumns) names += fmt::format(" {}", column.name);
  return names;
}

// A value that an option gives for all lanes.
struct Constant {
  float value;
  std::string_view option;
};

std::optional<Constant> constant(const FileCall& call, std::string_view column) {
  const auto given = [](const std::optional<float>& value, std::string_view option) -> std::optional<Constant> {
    if (!value) return std::nullopt;
    return Constant{*value, option};
  };
  if (column == "eta") return given(call.eta, "--eta");
  if (column == "f0") return given(call.f0, "--f0");
  if (column == "f90") return given(call.f90, "--f90");
  if (call.alpha.empty()) return std::nullopt;
  if (column == "alpha_x") return Constant{call.alpha.front(), "--alpha"};
  if (column == "alpha_y") return Constant{call.alpha.back(), "--alpha"};
  return std::nullopt;
}

// Whether the call reads a column that its operation knows.
bool reads(const FileCall& call, std::string_view column) {
  if (column == "u3") return call.operation == Operation::sample_scattering || uses_u3(call.model, call.sampler);
  if (column == "eta") return call.model.interface == Interface::dielectric;
  if (column == "f0" || column == "f90") return call.model.interface == Interface::schlick;
  return true;
}

// Turns a table's columns into a batch's inputs.
class Inputs {
 public:
  Inputs(const FileCall& call, InputTable& table)
      : call_(call), table_(table), used_(table.names().size(), false) {}

  absl::Status fill(Batch& batch) {
    for (const std::string& name : table_.names())
      if (!known_column(name))
        return invalid("{}: unknown column {}; known are{}", shown(), name, known_inputs());
    for (const FileColumn& column : kInputColumns) {
      const InputField& field = field_named(input_fields(), column.field);
      if (const auto given = constant(call_, column.name)) {
        if (find(column.name) >= 0)
          return invalid("{}: {} has a column {} too", given->option, shown(), column.name);
        field.column(batch) = given->value;
        continue;
      }
      if (!(field.operations & bit(call_.operation))) continue;
      const bool random = column.name.starts_with("u");
      if (random && call_.seed) {
        if (find(column.name) >= 0) return invalid("--seed: {} has a column {} too", shown(), column.name);
        continue;
      }
      if (!reads(call_, column.name) || (field.otherwise && find(column.name) < 0)) continue;
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
                                       : name == "eta"             ? " (or give --eta)"
                                       : name == "f0"              ? " (or give --f0)"
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

  TableColumns names{.floats = {}, .bytes = {}};
  for (const FileColumn& column : kOutputColumns)
    if (computes(call.operation, call.model, field_named(output_fields(), column.field)))
      names.floats.emplace_back(column.name);
  for (const FileColumn& column : kByteColumns)
    if (field_named(byte_fields(), column.field).operations & bit(call.operation))
      names.bytes.emplace_back(column.name);
  auto output = create_table(call.output, names, batch.lanes);
  if (!output.ok()) return output.status();
  std::size_t index = 0;
  for (const FileColumn& column : kOutputColumns) {
    const OutputField& field = field_named(output_fields(), column.field);
    if (computes(call.operation, call.model, field)) field.column(batch) = (*output)->column(index++);
  }
  index = 0;
  for (const FileColumn& column : kByteColumns) {
    const ByteField& field = field_named(byte_fields(), column.field);
    if (field.operations & bit(call.operation)) field.column(batch) = (*output)->byte_column(index++);
  }

  const auto start = std::chrono::steady_clock::now();
  auto statistics = engine.run(call.operation, batch);
  if (!statistics.ok()) return statistics.status();
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  if (auto status = (*output)->commit(); !status.ok()) return status;
  return FileCallResult{.statistics = *statistics, .ignored = inputs.ignored(), .seconds = seconds.count()};
}

}  // namespace facetwise::app
