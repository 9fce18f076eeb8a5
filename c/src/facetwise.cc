// SPDX-License-Identifier: Apache-2.0
// The C interface (facetwise.h): names to the library's fields and values, errors to codes and text.
#include "facetwise.h"

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "facetwise/albedo_table.h"
#include "facetwise/client.h"
#include "facetwise/engine.h"
#include "facetwise/slope_table.h"

struct fw_batch {
  facetwise::Batch batch;
};
struct fw_engine {
  std::unique_ptr<facetwise::Engine> engine;
};
struct fw_table {
  std::shared_ptr<const facetwise::SlopeTable> table;
};

namespace {

static_assert(FW_INVALID_ARGUMENT == static_cast<int>(absl::StatusCode::kInvalidArgument));
static_assert(FW_UNAUTHENTICATED == static_cast<int>(absl::StatusCode::kUnauthenticated));

std::string& error_text() {
  thread_local std::string text;
  return text;
}

fw_status done(const absl::Status& status) {
  if (!status.ok()) error_text() = std::string(status.message());
  return static_cast<fw_status>(status.code());
}

absl::Status invalid(const char* field, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat(field == nullptr ? "field" : field, ": ", what));
}

// What throws inside (memory, a density) does not cross into C.
template <class Body>
fw_status guarded(const Body& body) {
  try {
    return done(body());
  } catch (const std::bad_alloc&) {
    return done(absl::ResourceExhaustedError("out of memory"));
  } catch (const std::exception& error) {
    return done(absl::InternalError(error.what()));
  }
}

// The field of that name, of a table of fields.
template <class Fields>
auto* find(const Fields& fields, const char* name) {
  decltype(fields.data()) found = nullptr;
  for (const auto& field : fields)
    if (name != nullptr && field.name == name) found = &field;
  return found;
}

template <class T>
bool set(T& to, const std::optional<T>& value) {
  if (value) to = *value;
  return value.has_value();
}

// False: the value is not known. Nothing: there is no such part of a model.
std::optional<bool> set_model(facetwise::Batch& batch, std::string_view what, std::string_view value) {
  facetwise::Model& model = batch.model;
  if (what == "distribution") return set(model.distribution, facetwise::parse_distribution(value));
  if (what == "masking") return set(model.masking, facetwise::parse_masking(value));
  if (what == "shadowing") return set(model.shadowing, facetwise::parse_shadowing(value));
  if (what == "normalisation") return set(model.normalisation, facetwise::parse_normalisation(value));
  if (what == "interface") return set(model.interface, facetwise::parse_interface(value));
  if (what == "transport") return set(model.transport, facetwise::parse_transport(value));
  if (what == "compensation") return set(model.compensation, facetwise::parse_compensation(value));
  if (what == "sampler") return set(batch.sampler, facetwise::parse_sampler(value));
  if (what != "retro") return std::nullopt;
  model.retro = value == "true";
  return value == "true" || value == "false";
}

template <class T>
facetwise::Column<T> column(const T* values, std::size_t count, std::size_t stride) {
  return {values, count, stride == 0 ? sizeof(T) : stride};
}

template <class T, class Fields>
absl::Status set_output(facetwise::Batch& batch, const Fields& fields, const char* name, T* values,
                        std::size_t stride) {
  const auto* field = find(fields, name);
  if (field == nullptr) return invalid(name, "no output of that name");
  field->column(batch) = {};
  if (values != nullptr) field->column(batch) = {values, batch.lanes, stride == 0 ? sizeof(T) : stride};
  return absl::OkStatus();
}

// An operation's outputs, like inputs, are counted when they are set; their number follows the batch's.
template <class Fields>
void follow_lanes(facetwise::Batch& batch, const Fields& fields) {
  for (const auto& field : fields)
    if (auto& column = field.column(batch); column.present()) column = {column.data(), batch.lanes, column.stride()};
}

const char* text(const char* value) { return value == nullptr ? "" : value; }

// A handle, or null and the error.
template <class Handle, class Result>
Handle* handle(Result result) {
  if (!result.ok()) {
    done(result.status());
    return nullptr;
  }
  return new Handle{*std::move(result)};
}
template <class Handle, class Make>
Handle* guarded_handle(const Make& make) {
  Handle* made = nullptr;
  guarded([&] {
    made = handle<Handle>(make());
    return made != nullptr ? absl::OkStatus() : absl::UnknownError(error_text());
  });
  return made;
}

}  // namespace

extern "C" {

const char* fw_version(void) {
  static const std::string version(facetwise::version());
  return version.c_str();
}
const char* fw_error(void) { return error_text().c_str(); }

fw_batch* fw_batch_create(size_t lanes) {
  auto* batch = new fw_batch;
  batch->batch.lanes = lanes;
  return batch;
}
void fw_batch_destroy(fw_batch* batch) { delete batch; }

fw_status fw_set_lanes(fw_batch* batch, size_t lanes) {
  batch->batch.lanes = lanes;
  follow_lanes(batch->batch, facetwise::output_fields());
  follow_lanes(batch->batch, facetwise::byte_fields());
  return FW_OK;
}

fw_status fw_set_model(fw_batch* batch, const char* what, const char* value) {
  return guarded([&] {
    const auto known = set_model(batch->batch, text(what), text(value));
    if (!known) return invalid(what, "no part of a model");
    return *known ? absl::OkStatus() : invalid(what, absl::StrCat("unknown value \"", text(value), "\""));
  });
}

fw_status fw_set_table(fw_batch* batch, const fw_table* table) {
  batch->batch.model.table = table != nullptr ? table->table : nullptr;
  batch->batch.model.distribution = table != nullptr ? facetwise::Distribution::table : facetwise::Distribution::ggx;
  return FW_OK;
}

fw_status fw_set_input(fw_batch* batch, const char* field, const float* values, size_t count, size_t stride) {
  return guarded([&] {
    const auto* found = find(facetwise::input_fields(), field);
    if (found == nullptr) return invalid(field, "no input of that name");
    found->column(batch->batch) = values != nullptr ? column(values, count, stride) : facetwise::Column<float>();
    return absl::OkStatus();
  });
}
fw_status fw_set_value(fw_batch* batch, const char* field, float value) {
  return guarded([&] {
    const auto* found = find(facetwise::input_fields(), field);
    if (found == nullptr) return invalid(field, "no input of that name");
    found->column(batch->batch) = value;
    return absl::OkStatus();
  });
}
fw_status fw_set_output(fw_batch* batch, const char* field, float* values, size_t stride) {
  return guarded([&] { return set_output(batch->batch, facetwise::output_fields(), field, values, stride); });
}
fw_status fw_set_byte_output(fw_batch* batch, const char* field, uint8_t* values, size_t stride) {
  return guarded([&] { return set_output(batch->batch, facetwise::byte_fields(), field, values, stride); });
}

fw_status fw_set_active(fw_batch* batch, const uint32_t* lanes, size_t count) {
  batch->batch.active.reset();
  if (lanes != nullptr) batch->batch.active.emplace(lanes, count);
  return FW_OK;
}

fw_status fw_set_generator(fw_batch* batch, uint64_t seed, uint32_t dimension, const uint64_t* ids, uint64_t first_id) {
  facetwise::Generator& generator = batch->batch.generator.emplace();
  generator.seed = seed;
  generator.dimension = dimension;
  generator.first_id = first_id;
  if (ids != nullptr) generator.id = {ids, batch->batch.lanes};
  return FW_OK;
}
fw_status fw_clear_generator(fw_batch* batch) {
  batch->batch.generator.reset();
  return FW_OK;
}

fw_engine* fw_local(const char* target) {
  return guarded_handle<fw_engine>([&]() -> absl::StatusOr<std::unique_ptr<facetwise::Engine>> {
    facetwise::Execution execution;
    if (target != nullptr) {
      const auto parsed = facetwise::parse_target(target);
      if (!parsed) return invalid("target", absl::StrCat("unknown value \"", target, "\""));
      if (!facetwise::resolve(*parsed))
        return absl::FailedPreconditionError(absl::StrCat("target: this CPU or build has no ", target));
      execution.target = *parsed;
    }
    return facetwise::local_engine(execution);
  });
}

fw_engine* fw_connect(const char* const* addresses, size_t count, const fw_connection* options) {
  return guarded_handle<fw_engine>([&] {
    facetwise::ConnectOptions connect;
    if (options != nullptr) {
      connect.tls_ca = text(options->tls_ca);
      connect.tls_certificate = text(options->tls_certificate);
      connect.tls_key = text(options->tls_key);
      connect.tls_name = text(options->tls_name);
      connect.token_file = text(options->token_file);
      connect.compact_answers = options->compact_answers != 0;
    }
    const std::vector<std::string> all(addresses, addresses + count);
    return facetwise::connect(all, connect);
  });
}
void fw_engine_destroy(fw_engine* engine) { delete engine; }

fw_status fw_run(fw_engine* engine, const char* operation, const fw_batch* batch, fw_statistics* statistics) {
  return guarded([&] {
    const auto parsed = facetwise::parse_operation(text(operation));
    if (!parsed) return invalid("operation", absl::StrCat("unknown value \"", text(operation), "\""));
    const auto counts = engine->engine->run(*parsed, batch->batch);
    if (counts.ok() && statistics != nullptr)
      *statistics = {counts->accepted, counts->occluded, counts->smooth, counts->invalid};
    return counts.status();
  });
}

fw_status fw_compact(fw_engine* engine, size_t lanes, const uint8_t* status, uint32_t* index, const float* const* from,
                     float* const* to, size_t columns, size_t* accepted) {
  return guarded([&] {
    std::vector<facetwise::Compaction::DenseColumn> dense;
    for (std::size_t c = 0; c < columns; ++c) dense.push_back({{from[c], lanes}, {to[c], lanes}});
    facetwise::Compaction compaction;
    compaction.lanes = lanes;
    compaction.status = {status, lanes};
    if (index != nullptr) compaction.index = {index, lanes};
    compaction.columns = dense;
    const auto kept = engine->engine->compact(compaction);
    if (kept.ok() && accepted != nullptr) *accepted = *kept;
    return kept.status();
  });
}

fw_table* fw_table_build(fw_density density, void* user, int radial) {
  return guarded_handle<fw_table>([&] {
    return facetwise::SlopeTable::build([&](double x, double y) { return density(x, y, user); },
                                        {.radial = radial != 0});
  });
}
fw_table* fw_table_load(const char* path) {
  return guarded_handle<fw_table>([&] { return facetwise::SlopeTable::load_any(text(path), {}); });
}
fw_status fw_table_save(const fw_table* table, const char* path) {
  return guarded([&] { return table->table->save(text(path)); });
}
void fw_table_destroy(fw_table* table) { delete table; }

fw_status fw_keep_albedo_table(const fw_batch* batch, const char* path) {
  return guarded([&] {
    if (std::filesystem::exists(text(path))) {
      auto table = facetwise::AlbedoTable::load(text(path));
      if (!table.ok()) return table.status();
      if (!(*table)->fits(batch->batch.model))
        return absl::InvalidArgumentError(
            absl::StrCat(text(path), ": a table of ", (*table)->description(), ", which is not the batch's model"));
      facetwise::use_albedo_table(*std::move(table));
      return absl::OkStatus();
    }
    const auto table = facetwise::albedo_table(batch->batch.model);
    return table.ok() ? (*table)->save(text(path)) : table.status();
  });
}

}  // extern "C"
