// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <string>

#include "absl/strings/str_cat.h"
#include "facetwise/slope_table.h"
#include "facetwise/v1/sampler.pb.h"
#include "src/gather.h"
#include "src/pieces.h"
#include "wire/compact_columns.h"
#include "wire/fields.h"
#include "wire/message_reader.h"
#include "wire/message_writer.h"

namespace facetwise {
namespace {

using wire::MessageReader;
using wire::MessageWriter;

absl::Status bad_answer(absl::string_view what) { return absl::InternalError(absl::StrCat("its answer ", what)); }

}  // namespace

BatchPieces::BatchPieces(Operation operation, const Batch& batch, const PieceLimits& limits, const SharedMemory* shared,
                         bool compact)
    : operation_(operation),
      batch_(batch),
      positions_(batch.lanes, batch.active),
      shared_(positions_.all() ? shared : nullptr),
      compact_(compact),
      // Without ids of their own, lanes that are not neighbours need them: first_id + index. One id for all
      // stays one value.
      sends_ids_(batch.generator && ((batch.generator->id.present() && !batch.generator->id.one_value()) ||
                                     (!batch.generator->id.present() && batch.active))),
      split_(positions_.count(), most_lanes(limits)) {}

template <class AnyColumn>
bool BatchPieces::is_shared(const AnyColumn& column) const {
  if (shared_ == nullptr || column.count() <= 1) return false;
  using Value = std::remove_reference_t<decltype(*column.data())>;
  const bool aligned =
      reinterpret_cast<std::uintptr_t>(column.data()) % sizeof(Value) == 0 && column.stride() % sizeof(Value) == 0;
  return aligned && shared_->holds(column.data(), (column.count() - 1) * column.stride() + sizeof(Value));
}

// Also finds out which outputs are wanted where.
std::size_t BatchPieces::most_lanes(const PieceLimits& limits) {
  std::size_t request = sends_ids_ && !is_shared(batch_.generator->id) ? sizeof(std::uint64_t) : 0, response = 0;
  for (const InputField& field : input_fields())
    if (const auto& column = field.column(batch_); column.present() && !column.one_value() && !is_shared(column))
      request += sizeof(float);
  // An output of several columns is in shared memory if all that are wanted of it are.
  unsigned wanted = 0, elsewhere = 0;
  const auto look = [&](const auto& column, v1::Output output) {
    if (!column.present()) return;
    wanted |= 1u << output;
    if (!is_shared(column)) elsewhere |= 1u << output;
  };
  for (std::size_t k = 0; k < wire::output_places().size(); ++k)
    look(output_fields()[k].column(batch_), wire::output_places()[k].output);
  for (std::size_t k = 0; k < wire::byte_places().size(); ++k)
    look(byte_fields()[k].column(batch_), wire::byte_places()[k].output);
  outputs_ = elsewhere;
  shared_outputs_ = wanted & ~elsewhere;
  for (const auto& place : wire::output_places())
    if (outputs_ & (1u << place.output)) response += sizeof(float);
  for (const auto& place : wire::byte_places())
    if (outputs_ & (1u << place.output)) ++response;
  return limits.lanes(request, response);
}

Pieces BatchPieces::pieces() {
  return {"/facetwise.v1.Sampler/Run", split_.pieces(), [this](std::size_t piece) { return encode(piece); },
          [this](std::size_t piece, grpc::ByteBuffer& response) { return decode(piece, response); }};
}

grpc::ByteBuffer BatchPieces::encode(std::size_t piece) const {
  const Range range = split_.range(piece);
  Batch batch = batch_;
  v1::BatchRequest small;
  small.set_operation(wire::to_proto(operation_));
  v1::Model& model = *small.mutable_model();
  model.set_distribution(wire::to_proto(batch.model.distribution));
  model.set_masking(wire::to_proto(batch.model.masking));
  model.set_shadowing(wire::to_proto(batch.model.shadowing));
  model.set_normalisation(wire::to_proto(batch.model.normalisation));
  model.set_interface(wire::to_proto(batch.model.interface));
  model.set_transport(wire::to_proto(batch.model.transport));
  model.set_retro(batch.model.retro);
  model.set_compensation(wire::to_proto(batch.model.compensation));
  if (batch.model.table != nullptr) model.set_slope_table(batch.model.table->id());
  small.set_sampler(wire::to_proto(batch.sampler));
  small.set_lanes(range.size());
  small.set_compact_answer(compact_);
  for (int output = v1::Output_MIN; output <= v1::Output_MAX; ++output)
    if (outputs_ & (1u << output)) small.add_outputs(static_cast<v1::Output>(output));
  if (batch.generator) {
    v1::Generator& generator = *small.mutable_generator();
    generator.set_seed(batch.generator->seed);
    generator.set_dimension(batch.generator->dimension);
    if (!batch.generator->id.present() && !sends_ids_) generator.set_first_id(batch.generator->first_id + range.begin);
  }

  const auto share = [&](std::string_view name, const auto& column) {
    v1::SharedColumns& shared = *small.mutable_shared();
    shared.set_region(shared_->id());
    v1::SharedColumn& place = *shared.add_columns();
    place.set_name(std::string(name));
    place.set_offset(reinterpret_cast<std::uintptr_t>(&column[range.begin]) -
                     reinterpret_cast<std::uintptr_t>(shared_->data()));
    place.set_count(range.size());
    place.set_stride(column.stride());
  };
  const auto places = wire::input_places();
  const auto fields = input_fields();
  for (const InputField& field : fields)
    if (const auto& column = field.column(batch); is_shared(column)) share(field.name, column);
  const bool shares_ids = batch.generator && is_shared(batch.generator->id);
  if (shares_ids) share("generator.id", batch.generator->id);
  const auto share_outputs = [&](const auto& all, const auto& all_places) {
    for (std::size_t k = 0; k < all.size(); ++k)
      if (const auto& column = all[k].column(batch);
          column.present() && (shared_outputs_ & (1u << all_places[k].output)) != 0)
        share(all[k].name, column);
  };
  share_outputs(output_fields(), wire::output_places());
  share_outputs(byte_fields(), wire::byte_places());

  const auto bytes_of = [&](std::size_t k) -> std::size_t {
    const Column<float>& column = fields[k].column(batch);
    return column.present() && !is_shared(column) ? values_sent(column, range) * sizeof(float) : 0;
  };
  const auto part_bytes = [&](std::size_t k) { return bytes_of(k) == 0 ? 0 : MessageWriter::field_bytes(bytes_of(k)); };
  const std::size_t id_bytes = !batch.generator || shares_ids  ? 0
                               : sends_ids_                    ? range.size() * 8
                               : batch.generator->id.present() ? 8
                                                               : 0;
  std::size_t bytes = id_bytes;
  for (std::size_t k = 0; k < fields.size(); ++k) bytes += bytes_of(k);

  MessageWriter writer(fields.size() + 1, bytes, small.ByteSizeLong(), false);
  writer.fields(small);
  for (std::size_t k = 0; k < fields.size(); ++k) {
    // x, y and z of a direction are one message, of the parts that are sent.
    if (places[k].part == 1)
      if (const std::size_t parts = part_bytes(k) + part_bytes(k + 1) + part_bytes(k + 2); parts > 0)
        writer.begin(places[k].field, parts);
    if (bytes_of(k) == 0) continue;
    gather(fields[k].column(batch), positions_, range,
           writer.column(places[k].part == 0 ? places[k].field : places[k].part, bytes_of(k)));
  }
  if (id_bytes > 0) {
    writer.begin(v1::BatchRequest::kGeneratorFieldNumber, MessageWriter::field_bytes(id_bytes));
    char* ids = writer.column(v1::Generator::kIdFieldNumber, id_bytes);
    if (batch.generator->id.present()) {
      gather(batch.generator->id, positions_, range, ids);
    } else {
      for (std::size_t k = range.begin; k < range.end; ++k, ids += 8) {
        const std::uint64_t id = batch.generator->first_id + positions_.lane(k);
        std::memcpy(ids, &id, 8);
      }
    }
  }
  return std::move(writer).finish();
}

absl::Status BatchPieces::decode(std::size_t piece, grpc::ByteBuffer& response) {
  using Response = v1::BatchResponse;
  const Range range = split_.range(piece);
  MessageReader reader(response);
  unsigned missing = 0;  // bits of output_places(), and above them of byte_places()
  const auto places = wire::output_places();
  const auto fields = output_fields();
  const auto byte_places = wire::byte_places();
  for (std::size_t k = 0; k < places.size(); ++k)
    if (fields[k].column(batch_).present() && (outputs_ & (1u << places[k].output)) != 0) missing |= 1u << k;
  for (std::size_t k = 0; k < byte_places.size(); ++k)
    if (byte_fields()[k].column(batch_).present() && (outputs_ & (1u << byte_places[k].output)) != 0)
      missing |= 1u << (places.size() + k);

  // Reads a column, or passes over one that was not asked for (y of a direction of which only x was).
  const auto read_column = [&](const MessageReader::Field& field, int number, int part) {
    for (std::size_t k = 0; k < places.size(); ++k) {
      if (places[k].field != number || places[k].part != part) continue;
      const OutputColumn<float>& column = fields[k].column(batch_);
      if (!(missing & (1u << k))) break;
      missing &= ~(1u << k);
      std::size_t bytes = 0;
      return reader.length(field, bytes) && bytes == range.size() * sizeof(float) &&
             scatter(reader, column, positions_, range);
    }
    for (std::size_t k = 0; k < byte_places.size(); ++k) {
      if (byte_places[k].field != number || byte_places[k].part != part) continue;
      const unsigned wanted = 1u << (places.size() + k);
      if (!(missing & wanted)) break;
      missing &= ~wanted;
      std::size_t bytes = 0;
      return reader.length(field, bytes) && bytes == range.size() &&
             scatter(reader, byte_fields()[k].column(batch_), positions_, range);
    }
    return reader.skip(field);
  };
  // A direction or a weight in half its bytes.
  const auto read_packed = [&](const MessageReader::Field& field, v1::Output output) {
    OutputColumn<float> columns[3];
    std::size_t parts = 0;
    bool wanted = false;
    for (std::size_t k = 0; k < places.size(); ++k) {
      if (places[k].output != output) continue;
      wanted = wanted || (missing & (1u << k)) != 0;
      if (missing & (1u << k)) columns[parts] = fields[k].column(batch_);
      ++parts;
      missing &= ~(1u << k);
    }
    if (!wanted) return reader.skip(field);
    constexpr std::size_t kStaged = 1024;
    const std::size_t lane_bytes = parts == 1 ? wire::kWeightBytes : wire::kDirectionBytes;
    char packed[kStaged * wire::kDirectionBytes];
    float values[3][kStaged];
    std::size_t bytes = 0;
    if (!reader.length(field, bytes) || bytes != range.size() * lane_bytes) return false;
    for (std::size_t k = range.begin; k < range.end;) {
      const std::size_t count = std::min(kStaged, range.end - k);
      if (!reader.read(packed, count * lane_bytes)) return false;
      if (parts == 1)
        wire::unpack_weights(packed, count, values[0]);
      else
        wire::unpack_directions(packed, count, values[0], values[1], values[2]);
      for (std::size_t part = 0; part < parts; ++part)
        if (columns[part].present())
          for (std::size_t j = 0; j < count; ++j) columns[part][positions_.lane(k + j)] = values[part][j];
      k += count;
    }
    return true;
  };
  bool good = true;
  while (good) {
    const auto field = reader.next();
    if (!field) break;
    std::size_t bytes = 0;
    switch (field->number) {
      case Response::kStatisticsFieldNumber: {
        std::string text;
        v1::Statistics counts;
        good = reader.length(*field, bytes) && bytes < 1024;
        if (!good) break;
        text.resize(bytes);
        good = reader.read(text.data(), bytes) && counts.ParseFromString(text);
        statistics_ += {counts.accepted(), counts.occluded(), counts.smooth(), counts.invalid()};
        break;
      }
      case Response::kCompactOutgoingFieldNumber: good = read_packed(*field, v1::OUTGOING); break;
      case Response::kCompactNormalFieldNumber: good = read_packed(*field, v1::NORMAL); break;
      case Response::kCompactWeightFieldNumber: good = read_packed(*field, v1::WEIGHT); break;
      case Response::kOutgoingFieldNumber:
      case Response::kNormalFieldNumber:
        good = reader.length(*field, bytes) && reader.inside(bytes, [&] {
          while (const auto part = reader.next())
            if (!read_column(*part, field->number, part->number)) return false;
          return true;
        });
        break;
      default: good = read_column(*field, field->number, 0);
    }
  }
  if (!good || !reader.finished()) return bad_answer("is damaged");
  if (missing != 0) return bad_answer("lacks an output that was asked for");
  return absl::OkStatus();
}

}  // namespace facetwise
