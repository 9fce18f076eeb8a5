#include <array>
#include <string>

#include "absl/strings/str_cat.h"
#include "facetwise/slope_table.h"
#include "facetwise/v1/sampler.pb.h"
#include "src/gather.h"
#include "src/pieces.h"
#include "wire/fields.h"
#include "wire/message_reader.h"
#include "wire/message_writer.h"

namespace facetwise {
namespace {

using wire::MessageReader;
using wire::MessageWriter;

absl::Status bad_answer(absl::string_view what) { return absl::InternalError(absl::StrCat("its answer ", what)); }

unsigned wanted_outputs(Batch& batch) {
  unsigned outputs = 0;
  for (std::size_t k = 0; k < wire::output_places().size(); ++k)
    if (output_fields()[k].column(batch).present()) outputs |= 1u << wire::output_places()[k].output;
  for (std::size_t k = 0; k < wire::byte_places().size(); ++k)
    if (byte_fields()[k].column(batch).present()) outputs |= 1u << wire::byte_places()[k].output;
  return outputs;
}

std::size_t most_lanes(Batch& batch, bool sends_ids, unsigned outputs, const PieceLimits& limits) {
  std::size_t request = sends_ids ? sizeof(std::uint64_t) : 0, response = 0;
  for (const InputField& field : input_fields())
    if (const auto& column = field.column(batch); column.present() && !column.one_value()) request += sizeof(float);
  for (const auto& place : wire::output_places())
    if (outputs & (1u << place.output)) response += sizeof(float);
  for (const auto& place : wire::byte_places())
    if (outputs & (1u << place.output)) ++response;
  return limits.lanes(request, response);
}

}  // namespace

BatchPieces::BatchPieces(Operation operation, const Batch& batch, const PieceLimits& limits)
    : operation_(operation),
      batch_(batch),
      positions_(batch.lanes, batch.active),
      // Without ids of their own, lanes that are not neighbours need them: first_id + index. One id for all
      // stays one value.
      sends_ids_(batch.generator && ((batch.generator->id.present() && !batch.generator->id.one_value()) ||
                                     (!batch.generator->id.present() && batch.active))),
      outputs_(wanted_outputs(batch_)),
      split_(positions_.count(), most_lanes(batch_, sends_ids_, outputs_, limits)) {}

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
  for (int output = v1::Output_MIN; output <= v1::Output_MAX; ++output)
    if (outputs_ & (1u << output)) small.add_outputs(static_cast<v1::Output>(output));
  if (batch.generator) {
    v1::Generator& generator = *small.mutable_generator();
    generator.set_seed(batch.generator->seed);
    generator.set_dimension(batch.generator->dimension);
    if (!batch.generator->id.present() && !sends_ids_) generator.set_first_id(batch.generator->first_id + range.begin);
  }

  const auto places = wire::input_places();
  const auto fields = input_fields();
  const auto bytes_of = [&](std::size_t k) -> std::size_t {
    const Column<float>& column = fields[k].column(batch);
    return column.present() ? values_sent(column, range) * sizeof(float) : 0;
  };
  const std::size_t id_bytes = !batch.generator                ? 0
                               : sends_ids_                    ? range.size() * 8
                               : batch.generator->id.present() ? 8
                                                               : 0;
  std::size_t bytes = id_bytes;
  for (std::size_t k = 0; k < fields.size(); ++k) bytes += bytes_of(k);

  MessageWriter writer(fields.size() + 1, bytes, small.ByteSizeLong(), false);
  writer.fields(small);
  for (std::size_t k = 0; k < fields.size(); ++k) {
    if (bytes_of(k) == 0) continue;
    if (places[k].part == 1)  // x: y and z follow
      writer.begin(places[k].field, MessageWriter::field_bytes(bytes_of(k)) +
                                        MessageWriter::field_bytes(bytes_of(k + 1)) +
                                        MessageWriter::field_bytes(bytes_of(k + 2)));
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
    if (fields[k].column(batch_).present()) missing |= 1u << k;
  for (std::size_t k = 0; k < byte_places.size(); ++k)
    if (byte_fields()[k].column(batch_).present()) missing |= 1u << (places.size() + k);

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
