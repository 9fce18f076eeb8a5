// SPDX-License-Identifier: Apache-2.0
#include "app/file_call.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "app/errors.h"

namespace facetwise::app {
namespace {

// A field's name in files: "incident.x" is ix, "out.outgoing.x" ox, "out.normal.x" mx; the others are called as they
// are.
std::string file_name(std::string_view field) {
  if (field.starts_with("out.")) field.remove_prefix(4);
  constexpr std::pair<std::string_view, char> kDirections[] = {
      {"incident.", 'i'}, {"outgoing.", 'o'}, {"normal.", 'm'}};
  for (const auto& [prefix, letter] : kDirections)
    if (field.starts_with(prefix)) return {letter, field.back()};
  return std::string(field);
}

// What a call writes to files: all that it computes but i.m, which m says.
std::vector<const OutputField*> written_fields(const FileCall& call) {
  std::vector<const OutputField*> fields;
  for (const OutputField& field : output_fields())
    if (computes(call.operation, call.model, field) && field.name != "out.incident_dot_normal")
      fields.push_back(&field);
  return fields;
}
std::vector<const ByteField*> written_bytes(const FileCall& call) {
  std::vector<const ByteField*> fields;
  for (const ByteField& field : byte_fields())
    if (computes(call.operation, field)) fields.push_back(&field);
  // The status is the last column of a file.
  std::reverse(fields.begin(), fields.end());
  return fields;
}

bool known_column(std::string_view name) {
  const auto any_of = [&](const auto& fields) {
    return std::any_of(fields.begin(), fields.end(), [&](const auto& field) { return file_name(field.name) == name; });
  };
  return any_of(input_fields()) || any_of(output_fields()) || any_of(byte_fields());
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

// Turns a table's columns into a batch's inputs.
class Inputs {
 public:
  Inputs(const FileCall& call, InputTable& table) : call_(call), table_(table), used_(table.names().size(), false) {}

  absl::Status fill(Batch& batch) {
    // u3 comes last: by then it is known which sampler the other columns make the default.
    for (const InputField& field : input_fields()) {
      const std::string column = file_name(field.name);
      batch.sampler = call_.sampler.value_or(default_sampler(call_.operation, batch));
      if (const auto given = constant(call_, column)) {
        if (find(column) >= 0) return invalid("{}: {} has a column {} too", given->option, shown(), column);
        field.column(batch) = given->value;
        continue;
      }
      if (field.random && call_.seed && (field.operations & bit(call_.operation))) {
        if (find(column) >= 0) return invalid("--seed: {} has a column {} too", shown(), column);
        continue;
      }
      if (!reads(call_.operation, call_.model, batch.sampler, field) || (field.otherwise && find(column) < 0)) continue;
      if (auto status = take(column, field.random, field.column(batch)); !status.ok()) return status;
    }
    batch.lanes = table_.rows();
    if (call_.normalise)
      for (Direction* direction : {&batch.incident, &batch.outgoing}) normalise(*direction);
    if (call_.seed) batch.generator = {.seed = *call_.seed, .id = {}, .first_id = call_.first_id};
    return absl::OkStatus();
  }

  // Columns that facetwise knows and the call does not read.
  std::vector<std::string> ignored() const {
    std::vector<std::string> names;
    for (std::size_t k = 0; k < used_.size(); ++k)
      if (!used_[k] && known_column(table_.names()[k])) names.push_back(table_.names()[k]);
    return names;
  }
  // Those that it does not know.
  absl::StatusOr<std::vector<PassedColumn>> passed() {
    std::vector<PassedColumn> columns;
    for (std::size_t k = 0; k < used_.size(); ++k) {
      if (known_column(table_.names()[k])) continue;
      auto column = table_.passed(k);
      if (!column.ok()) return column.status();
      columns.push_back(*std::move(column));
    }
    return columns;
  }

 private:
  std::string shown() const { return call_.input == "-" ? "standard input" : call_.input; }

  // To unit length, in double; what has no length stays as it is.
  void normalise(Direction& direction) {
    if (!direction.x.present()) return;
    std::vector<float> unit[3];
    for (std::size_t lane = 0; lane < table_.rows(); ++lane) {
      const double x = direction.x[lane], y = direction.y[lane], z = direction.z[lane];
      const double length = std::sqrt(x * x + y * y + z * z);
      const double scale = length > 0 && std::isfinite(length) ? 1 / length : 1;
      unit[0].push_back(static_cast<float>(scale * x));
      unit[1].push_back(static_cast<float>(scale * y));
      unit[2].push_back(static_cast<float>(scale * z));
    }
    std::size_t k = 0;
    for (Column<float>* column : {&direction.x, &direction.y, &direction.z})
      *column = normalised_.emplace_back(std::move(unit[k++]));
  }

  int find(std::string_view name) const {
    const auto names = table_.names();
    const auto found = std::find(names.begin(), names.end(), name);
    return found == names.end() ? -1 : static_cast<int>(found - names.begin());
  }

  absl::Status take(std::string_view name, bool random, Column<float>& column) {
    const int index = find(name);
    if (index < 0) {
      const std::string_view instead = random                      ? " (or give --seed instead of columns u1 u2 u3)"
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
  std::deque<std::vector<float>> normalised_;
};

}  // namespace

absl::StatusOr<FileCallResult> run_on_files(const FileCall& call, Engine& engine) {
  auto input = read_table(call.input, call.columns);
  if (!input.ok()) return input.status();
  Batch batch;
  batch.model = call.model;
  Inputs inputs(call, **input);
  if (auto status = inputs.fill(batch); !status.ok()) return status;

  const auto fields = written_fields(call);
  const auto bytes = written_bytes(call);
  TableColumns names{.floats = {}, .bytes = {}};
  for (const OutputField* field : fields) names.floats.push_back(file_name(field->name));
  for (const ByteField* field : bytes) names.bytes.push_back(file_name(field->name));
  auto passed = inputs.passed();
  if (!passed.ok()) return passed.status();
  names.passed = *std::move(passed);
  auto output = create_table(call.output, names, batch.lanes);
  if (!output.ok()) return output.status();
  for (std::size_t k = 0; k < fields.size(); ++k) fields[k]->column(batch) = (*output)->column(k);
  for (std::size_t k = 0; k < bytes.size(); ++k) bytes[k]->column(batch) = (*output)->byte_column(k);

  std::vector<std::string> passed_names;
  for (const PassedColumn& column : names.passed) passed_names.push_back(column.name);
  const auto start = std::chrono::steady_clock::now();
  auto statistics = engine.run(call.operation, batch);
  if (!statistics.ok()) return statistics.status();
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  if (auto status = (*output)->commit(); !status.ok()) return status;
  std::size_t backfacing = 0;
  for (std::size_t lane = 0; lane < batch.lanes; ++lane) backfacing += batch.incident.z[lane] <= 0;
  return FileCallResult{.statistics = *statistics,
                        .sampler = batch.sampler,
                        .ignored = inputs.ignored(),
                        .passed = std::move(passed_names),
                        .backfacing = backfacing,
                        .seconds = seconds.count()};
}

}  // namespace facetwise::app
