// SPDX-License-Identifier: Apache-2.0
// Run and RunStream: the request's columns are read to where the engine reads them, and the engine writes
// the response's columns where gRPC sends them from.
#include <algorithm>
#include <cstdint>
#include <iterator>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "facetwise/engine.h"
#include "src/answer.h"
#include "wire/compact_columns.h"
#include "wire/fields.h"
#include "wire/message_reader.h"
#include "wire/message_writer.h"

namespace facetwise {
namespace {

using wire::MessageReader;
using Request = v1::BatchRequest;

constexpr std::size_t kAlignment = 64;

absl::string_view view(std::string_view text) { return {text.data(), text.size()}; }

// A column of the request: bytes in the decoder's block.
struct Bytes {
  const char* data = nullptr;
  std::size_t size = 0;
};

class Decoder {
 public:
  // Every column is in the message once, so its size and the alignment of each bound the memory.
  explicit Decoder(grpc::ByteBuffer& message)
      : reader_(message), block_(message.Length() + (input_fields().size() + 1) * kAlignment) {}

  absl::Status read();
  // `region`: what holds the batch's columns in shared memory, if any.
  absl::Status make_batch(const CallTools& tools, Batch& batch, std::shared_ptr<const SharedRegions::Region>& region);

  std::uint64_t lanes() const { return lanes_; }
  Operation operation() const { return *operation_; }
  unsigned outputs() const { return outputs_; }
  bool compact_answer() const { return compact_answer_; }

 private:
  absl::Status read_field(const MessageReader::Field& field);
  absl::Status read_model(std::size_t bytes);
  absl::Status read_direction(int field, std::size_t bytes);
  absl::Status read_generator(std::size_t bytes);
  absl::Status read_outputs(const MessageReader::Field& field);
  absl::Status read_shared(std::size_t bytes);
  absl::Status place_shared(const v1::SharedColumn& column, const SharedRegions::Region& region, Batch& batch) const;
  absl::Status read_column(absl::string_view name, std::size_t width, const MessageReader::Field& field, Bytes& column);
  absl::Status read_enum(const MessageReader::Field& field, int& value);
  absl::Status add_output(std::uint64_t value);
  // Calls read(field) for each field of the message, or of its next `bytes` bytes.
  template <class Read>
  absl::Status each_field(const Read& read);
  template <class Read>
  absl::Status each_field_inside(std::size_t bytes, const Read& read);

  MessageReader reader_;
  wire::Block block_;
  std::size_t at_ = 0;

  int operation_value_ = 0, sampler_ = 0;
  int distribution_ = 0, masking_ = 0, shadowing_ = 0, normalisation_ = 0, interface_ = 0, transport_ = 0,
      compensation_ = 0;
  bool retro_ = false;
  std::uint64_t slope_table_ = 0;
  std::optional<Operation> operation_;
  std::uint64_t lanes_ = 0;
  unsigned outputs_ = 0;
  std::vector<Bytes> inputs_{input_fields().size()};
  bool has_generator_ = false, compact_answer_ = false;
  Generator generator_;
  Bytes generator_id_;
  v1::SharedColumns shared_;
};

template <class Read>
absl::Status Decoder::each_field(const Read& read) {
  while (const auto field = reader_.next())
    if (auto status = read(*field); !status.ok()) return status;
  return reader_.finished() ? absl::OkStatus() : damaged_message();
}

template <class Read>
absl::Status Decoder::each_field_inside(std::size_t bytes, const Read& read) {
  absl::Status status;
  const bool good = reader_.inside(bytes, [&] {
    status = each_field(read);
    return status.ok();
  });
  if (!status.ok()) return status;
  return good ? absl::OkStatus() : damaged_message();
}

absl::Status Decoder::read() {
  return each_field([this](const MessageReader::Field& field) { return read_field(field); });
}

absl::Status Decoder::read_field(const MessageReader::Field& field) {
  std::size_t bytes = 0;
  switch (field.number) {
    case Request::kOperationFieldNumber: return read_enum(field, operation_value_);
    case Request::kSamplerFieldNumber: return read_enum(field, sampler_);
    case Request::kLanesFieldNumber: return reader_.varint(field, lanes_) ? absl::OkStatus() : damaged_message();
    case Request::kOutputsFieldNumber: return read_outputs(field);
    case Request::kModelFieldNumber: return reader_.length(field, bytes) ? read_model(bytes) : damaged_message();
    case Request::kGeneratorFieldNumber:
      return reader_.length(field, bytes) ? read_generator(bytes) : damaged_message();
    case Request::kCompactAnswerFieldNumber: {
      std::uint64_t value = 0;
      const bool good = reader_.varint(field, value);
      compact_answer_ = value != 0;
      return good ? absl::OkStatus() : damaged_message();
    }
    case Request::kSharedFieldNumber: return reader_.length(field, bytes) ? read_shared(bytes) : damaged_message();
    case Request::kIncidentFieldNumber:
    case Request::kOutgoingFieldNumber:
      return reader_.length(field, bytes) ? read_direction(field.number, bytes) : damaged_message();
    default: break;
  }
  const auto places = wire::input_places();
  for (std::size_t k = 0; k < places.size(); ++k)
    if (places[k].field == field.number) return read_column(view(places[k].name), 4, field, inputs_[k]);
  return reader_.skip(field) ? absl::OkStatus() : damaged_message();
}

absl::Status Decoder::read_enum(const MessageReader::Field& field, int& value) {
  std::uint64_t wide = 0;
  if (!reader_.varint(field, wide)) return damaged_message();
  // An enumeration is 32 bits, sign-extended on the wire.
  value = static_cast<int>(static_cast<std::uint32_t>(wide));
  return absl::OkStatus();
}

absl::Status Decoder::read_model(std::size_t bytes) {
  return each_field_inside(bytes, [this](const MessageReader::Field& field) {
    switch (field.number) {
      case v1::Model::kDistributionFieldNumber: return read_enum(field, distribution_);
      case v1::Model::kMaskingFieldNumber: return read_enum(field, masking_);
      case v1::Model::kShadowingFieldNumber: return read_enum(field, shadowing_);
      case v1::Model::kNormalisationFieldNumber: return read_enum(field, normalisation_);
      case v1::Model::kInterfaceFieldNumber: return read_enum(field, interface_);
      case v1::Model::kTransportFieldNumber: return read_enum(field, transport_);
      case v1::Model::kCompensationFieldNumber: return read_enum(field, compensation_);
      case v1::Model::kRetroFieldNumber: {
        std::uint64_t value = 0;
        const bool good = reader_.varint(field, value);
        retro_ = value != 0;
        return good ? absl::OkStatus() : damaged_message();
      }
      case v1::Model::kSlopeTableFieldNumber:
        return reader_.eight_bytes(field, slope_table_) ? absl::OkStatus() : damaged_message();
      default: return reader_.skip(field) ? absl::OkStatus() : damaged_message();
    }
  });
}

absl::Status Decoder::read_direction(int direction, std::size_t bytes) {
  return each_field_inside(bytes, [&](const MessageReader::Field& field) {
    const auto places = wire::input_places();
    for (std::size_t k = 0; k < places.size(); ++k)
      if (places[k].field == direction && places[k].part == field.number)
        return read_column(view(places[k].name), 4, field, inputs_[k]);
    return reader_.skip(field) ? absl::OkStatus() : damaged_message();
  });
}

absl::Status Decoder::read_generator(std::size_t bytes) {
  has_generator_ = true;
  return each_field_inside(bytes, [this](const MessageReader::Field& field) {
    std::uint64_t value = 0;
    bool good = true;
    switch (field.number) {
      case v1::Generator::kSeedFieldNumber: good = reader_.eight_bytes(field, generator_.seed); break;
      case v1::Generator::kFirstIdFieldNumber: good = reader_.varint(field, generator_.first_id); break;
      case v1::Generator::kDimensionFieldNumber:
        good = reader_.varint(field, value);
        generator_.dimension = static_cast<std::uint32_t>(value);
        break;
      case v1::Generator::kIdFieldNumber: return read_column("generator.id", 8, field, generator_id_);
      default: good = reader_.skip(field);
    }
    return good ? absl::OkStatus() : damaged_message();
  });
}

// Packed or one by one: protobuf allows both.
absl::Status Decoder::read_outputs(const MessageReader::Field& field) {
  std::uint64_t value = 0;
  if (reader_.varint(field, value)) return add_output(value);
  std::size_t bytes = 0;
  if (!reader_.length(field, bytes)) return damaged_message();
  absl::Status status;
  const bool good = reader_.inside(bytes, [&] {
    while (status.ok() && !reader_.at_end()) {
      if (!reader_.packed_varint(value)) return false;
      status = add_output(value);
    }
    return status.ok();
  });
  if (!status.ok()) return status;
  return good ? absl::OkStatus() : damaged_message();
}

absl::Status Decoder::read_shared(std::size_t bytes) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 14;
  if (bytes > kMostBytes) return invalid_field("shared", absl::StrCat(bytes, " bytes, at most ", kMostBytes));
  std::string text(bytes, '\0');
  return reader_.read(text.data(), bytes) && shared_.MergeFromString(text) ? absl::OkStatus() : damaged_message();
}

absl::Status Decoder::place_shared(const v1::SharedColumn& column, const SharedRegions::Region& region,
                                   Batch& batch) const {
  const absl::string_view name = column.name();
  const auto place = [&]<class T>(T& to, std::size_t width) {
    if (to.present()) return invalid_field(name, "given twice");
    const std::uint64_t offset = column.offset(), count = column.count(), stride = column.stride();
    if (offset % width != 0 || stride % width != 0 || stride == 0)
      return invalid_field(
          name, absl::StrCat("offset ", offset, " and stride ", stride, " are not whole values of ", width, " bytes"));
    if (count > 0 && (offset > region.bytes() || width > region.bytes() - offset ||
                      (count - 1) > (region.bytes() - offset - width) / stride))
      return invalid_field(name, absl::StrCat("goes beyond the shared memory of ", region.bytes(), " bytes"));
    using Value = std::remove_cvref_t<decltype(*to.data())>;
    to = T(reinterpret_cast<Value*>(region.data() + (count > 0 ? offset : 0)), count, stride);
    return absl::OkStatus();
  };
  for (const InputField& field : input_fields())
    if (view(field.name) == name) return place(field.column(batch), sizeof(float));
  if (name == "generator.id") {
    if (!batch.generator) return invalid_field(name, "without a generator");
    return place(batch.generator->id, sizeof(std::uint64_t));
  }
  const auto computed = [&](auto& field, v1::Output output, std::size_t width) {
    if ((wire::outputs_of(*operation_) & (1u << output)) == 0)
      return invalid_field(name, absl::StrCat("not computed by ", view(facetwise::name(*operation_))));
    if ((outputs_ & (1u << output)) != 0) return invalid_field(name, "wanted in the answer and in shared memory");
    return place(field.column(batch), width);
  };
  for (std::size_t k = 0; k < output_fields().size(); ++k)
    if (view(output_fields()[k].name) == name) return computed(output_fields()[k], wire::output_places()[k].output, 4);
  for (std::size_t k = 0; k < byte_fields().size(); ++k)
    if (view(byte_fields()[k].name) == name) return computed(byte_fields()[k], wire::byte_places()[k].output, 1);
  return invalid_field("shared.columns", absl::StrCat("no column \"", absl::CHexEscape(name), "\""));
}

absl::Status Decoder::add_output(std::uint64_t value) {
  if (value == v1::OUTPUT_UNSPECIFIED) return invalid_field("outputs", "holds OUTPUT_UNSPECIFIED");
  if (value > static_cast<std::uint64_t>(v1::Output_MAX))
    return invalid_field("outputs", absl::StrCat("unknown value ", static_cast<std::int64_t>(value)));
  outputs_ |= 1u << value;
  return absl::OkStatus();
}

absl::Status Decoder::read_column(absl::string_view name, std::size_t width, const MessageReader::Field& field,
                                  Bytes& column) {
  std::size_t bytes = 0;
  if (!reader_.length(field, bytes)) return damaged_message();
  if (column.data != nullptr) return invalid_field(name, "given twice");
  if (bytes % width != 0)
    return invalid_field(name, absl::StrCat(bytes, " bytes are not whole values of ", width, " bytes"));
  at_ = (at_ + kAlignment - 1) / kAlignment * kAlignment;
  char* data = block_.data() + at_;
  if (!reader_.read(data, bytes)) return damaged_message();
  at_ += bytes;
  column = {data, bytes};
  return absl::OkStatus();
}

// The wire's own checks; the rest is for the engine's.
absl::Status Decoder::make_batch(const CallTools& tools, Batch& batch,
                                 std::shared_ptr<const SharedRegions::Region>& region) {
  const auto unknown = [](absl::string_view field, int value) {
    return invalid_field(field, absl::StrCat("unknown value ", value));
  };
  if (operation_value_ == v1::OPERATION_UNSPECIFIED) return invalid_field("operation", "missing");
  operation_ = wire::operation_from(operation_value_);
  if (!operation_) return unknown("operation", operation_value_);
  const auto distribution = wire::distribution_from(distribution_);
  const auto masking = wire::masking_from(masking_);
  const auto shadowing = wire::shadowing_from(shadowing_);
  const auto normalisation = wire::normalisation_from(normalisation_);
  const auto interface = wire::interface_from(interface_);
  const auto transport = wire::transport_from(transport_);
  const auto compensation = wire::compensation_from(compensation_);
  if (!distribution) return unknown("model.distribution", distribution_);
  if (!masking) return unknown("model.masking", masking_);
  if (!shadowing) return unknown("model.shadowing", shadowing_);
  if (!normalisation) return unknown("model.normalisation", normalisation_);
  if (!interface) return unknown("model.interface", interface_);
  if (!transport) return unknown("model.transport", transport_);
  if (!compensation) return unknown("model.compensation", compensation_);
  batch.model = {.distribution = *distribution,
                 .masking = *masking,
                 .shadowing = *shadowing,
                 .normalisation = *normalisation,
                 .interface = *interface,
                 .transport = *transport,
                 .compensation = *compensation,
                 .retro = retro_};
  if (slope_table_ != 0) {
    batch.model.table = tools.tables.find(slope_table_);
    if (batch.model.table == nullptr)
      return absl::NotFoundError(
          absl::StrCat("model.slope_table: no table ", absl::Hex(slope_table_, absl::kZeroPad16), " here: upload it"));
  }
  // Until the columns are there, which decide what an unspecified one means.
  if (!wire::sampler_from(sampler_, Sampler::visible)) return unknown("sampler", sampler_);
  if (auto status = check_lanes(lanes_, tools.limits); !status.ok()) return status;
  if (const unsigned strange = outputs_ & ~wire::outputs_of(*operation_); strange != 0) {
    const auto output = static_cast<v1::Output>(std::countr_zero(strange));
    return invalid_field("outputs",
                         absl::StrCat(view(name(*operation_)), " does not compute ", v1::Output_Name(output)));
  }

  batch.lanes = lanes_;
  // An empty column is an absent one, except in an empty batch, whose columns are all empty: there it is absent
  // if the call can do without it.
  static constexpr std::uint64_t kNothing = 0;
  const auto fields = input_fields();
  for (std::size_t k = 0; k < fields.size(); ++k)
    if (inputs_[k].size > 0)
      fields[k].column(batch) = {reinterpret_cast<const float*>(inputs_[k].data), inputs_[k].size / 4};
  if (has_generator_) {
    if (generator_id_.size > 0)
      generator_.id = {reinterpret_cast<const std::uint64_t*>(generator_id_.data), generator_id_.size / 8};
    batch.generator = generator_;
  }
  if (shared_.columns_size() > 0) {
    region = tools.regions.find(shared_.region());
    if (region == nullptr)
      return absl::NotFoundError(
          absl::StrCat("shared.region: no memory ", absl::Hex(shared_.region(), absl::kZeroPad16), " is shared here"));
    for (const v1::SharedColumn& column : shared_.columns())
      if (auto status = place_shared(column, *region, batch); !status.ok()) return status;
  }
  batch.sampler = *wire::sampler_from(sampler_, default_sampler(*operation_, batch));
  for (std::size_t k = 0; k < fields.size(); ++k) {
    const bool expected = reads(*operation_, batch.model, batch.sampler, fields[k]) && !fields[k].otherwise &&
                          !(fields[k].random && has_generator_);
    if (!fields[k].column(batch).present() && lanes_ == 0 && expected)
      fields[k].column(batch) = {reinterpret_cast<const float*>(&kNothing), 0};
  }
  return absl::OkStatus();
}

// The response's columns, in the message that will be sent.
class Response {
 public:
  Response(unsigned outputs, std::size_t lanes, bool compact)
      : outputs_(outputs), lanes_(lanes), compact_(compact ? outputs & kCompacted : 0) {}

  // That are sent.
  std::size_t bytes() const {
    std::size_t bytes = 0;
    for (const auto& place : wire::output_places())
      if (is_whole(place.output)) bytes += lanes_ * 4;
    for (const auto& place : wire::byte_places())
      if (asks_for(place.output)) bytes += lanes_;
    for (const Packed& packed : kPacked)
      if (is_packed(packed.output)) bytes += lanes_ * packed.lane_bytes();
    return bytes;
  }
  // Of the columns that are packed, before they are.
  std::size_t loose_bytes() const {
    std::size_t bytes = 0;
    for (const auto& place : wire::output_places())
      if (is_packed(place.output)) bytes += lanes_ * 4 + kAlignment;
    return bytes;
  }

  wire::MessageWriter make(Batch& batch) {
    const auto places = wire::output_places();
    const auto byte_places = wire::byte_places();
    wire::MessageWriter writer(places.size() + byte_places.size(), bytes(), kStatisticsBytes, true);
    loose_ = wire::Block(loose_bytes());
    std::size_t at = 0;
    for (std::size_t k = 0; k < places.size(); ++k) {
      OutputColumn<float>& column = output_fields()[k].column(batch);
      if (is_packed(places[k].output)) {
        column = {reinterpret_cast<float*>(loose_.data() + at), lanes_};
        at += (lanes_ * 4 + kAlignment - 1) / kAlignment * kAlignment;
      } else if (is_whole(places[k].output)) {
        const int part = places[k].part;
        if (part == 1) writer.begin(places[k].field, 3 * wire::MessageWriter::field_bytes(lanes_ * 4));
        column = {reinterpret_cast<float*>(writer.column(part == 0 ? places[k].field : part, lanes_ * 4)), lanes_};
      }
    }
    for (std::size_t k = 0; k < byte_places.size(); ++k) {
      if (!asks_for(byte_places[k].output)) continue;
      char* column = writer.column(byte_places[k].field, lanes_);
      byte_fields()[k].column(batch) = {reinterpret_cast<std::uint8_t*>(column), lanes_};
    }
    for (std::size_t k = 0; k < std::size(kPacked); ++k)
      if (is_packed(kPacked[k].output)) packed_[k] = writer.column(kPacked[k].field, lanes_ * kPacked[k].lane_bytes());
    return writer;
  }

  // Lanes of the whole batch that are computed.
  void pack(const Batch& batch, std::size_t begin, std::size_t end) const {
    const Batch::Outputs& out = batch.out;
    for (std::size_t k = 0; k < std::size(kPacked); ++k) {
      if (packed_[k] == nullptr) continue;
      char* to = packed_[k] + begin * kPacked[k].lane_bytes();
      if (kPacked[k].output == v1::WEIGHT) {
        wire::pack_weights(&out.weight[begin], end - begin, to);
      } else {
        const OutputDirection& from = kPacked[k].output == v1::OUTGOING ? out.outgoing : out.normal;
        wire::pack_directions(&from.x[begin], &from.y[begin], &from.z[begin], end - begin, to);
      }
    }
  }

 private:
  static constexpr std::size_t kStatisticsBytes = 64;
  struct Packed {
    v1::Output output;
    int field;
    std::size_t lane_bytes() const { return output == v1::WEIGHT ? wire::kWeightBytes : wire::kDirectionBytes; }
  };
  static constexpr Packed kPacked[] = {{v1::OUTGOING, v1::BatchResponse::kCompactOutgoingFieldNumber},
                                       {v1::NORMAL, v1::BatchResponse::kCompactNormalFieldNumber},
                                       {v1::WEIGHT, v1::BatchResponse::kCompactWeightFieldNumber}};
  static constexpr unsigned kCompacted = 1u << v1::OUTGOING | 1u << v1::NORMAL | 1u << v1::WEIGHT;
  bool asks_for(v1::Output output) const { return outputs_ & (1u << output); }
  bool is_packed(v1::Output output) const { return compact_ & (1u << output); }
  bool is_whole(v1::Output output) const { return asks_for(output) && !is_packed(output); }

  const unsigned outputs_;
  const std::size_t lanes_;
  const unsigned compact_;  // of outputs_
  wire::Block loose_;
  char* packed_[std::size(kPacked)] = {};
};

// Some lanes of a batch.
Batch piece(const Batch& batch, std::size_t begin, std::size_t end) {
  if (end - begin == batch.lanes) return batch;
  Batch some = batch;
  some.lanes = end - begin;
  const auto cut = [&](auto& column) {
    if (column.present() && !column.one_value()) column = {&column[begin], some.lanes, column.stride()};
  };
  for (const InputField& field : input_fields()) cut(field.column(some));
  const auto cut_output = [&](auto& column) {
    if (column.present()) column = {&column[begin], some.lanes, column.stride()};
  };
  for (const OutputField& field : output_fields()) cut_output(field.column(some));
  for (const ByteField& field : byte_fields()) cut_output(field.column(some));
  if (some.generator) {
    some.generator->first_id += begin;
    cut(some.generator->id);
  }
  return some;
}

// Whether a lane takes less than a tenth of a microsecond: not where a table of albedo may have to be made first, nor Phong's
// behind the surface.
bool is_quick(Operation operation, const Model& model) {
  return operation != Operation::albedo && model.compensation == Compensation::none &&
         model.distribution != Distribution::phong;
}

}  // namespace

Task<absl::StatusOr<grpc::ByteBuffer>> answer_batch(grpc::ByteBuffer& request, const CallTools& tools) {
  const bool is_short = is_small(request);
  if (auto status = co_await begin_answer(request, tools); !status.ok()) co_return status;
  Decoder decoder(request);
  Batch batch;
  if (auto status = decoder.read(); !status.ok()) co_return status;
  request.Clear();
  std::shared_ptr<const SharedRegions::Region> region;
  if (auto status = decoder.make_batch(tools, batch, region); !status.ok()) co_return status;

  Response response(decoder.outputs(), decoder.lanes(), decoder.compact_answer());
  if (response.bytes() > tools.limits.message_bytes)
    co_return absl::InvalidArgumentError(absl::StrCat("outputs: ", response.bytes(), " bytes for ", decoder.lanes(),
                                                      " lanes are above the limit of ", tools.limits.message_bytes,
                                                      ": send fewer lanes"));
  // With its request a call may hold kMessagesHeld messages.
  if (const std::size_t made = response.bytes() + response.loose_bytes(); made > 2 * tools.limits.message_bytes)
    co_return absl::InvalidArgumentError(
        absl::StrCat("compact_answer: ", made, " bytes for ", decoder.lanes(),
                     " lanes, before they are packed and after, are above the limit of ",
                     2 * tools.limits.message_bytes, ": send fewer lanes"));
  if (auto status = tools.stay.hold(response.bytes() + response.loose_bytes()); !status.ok()) co_return status;
  wire::MessageWriter writer = response.make(batch);
  // As a whole: what is wrong with a piece would be told with the piece's sizes.
  if (auto status = check(decoder.operation(), batch); !status.ok()) co_return status;
  // A short call is quicker where it is than on another thread; but gRPC's threads must not be kept long.
  if (is_short && !(is_quick(decoder.operation(), batch.model) && tools.compute.idle())) {
    auto turn = tools.compute.turn(false);
    co_await turn;
  }
  absl::StatusOr<Statistics> statistics = Statistics{};
  auto computed = tools.compute.each(batch.lanes, [&](std::size_t begin, std::size_t end, Execution execution) {
    execution.stop = &tools.stop;
    const auto some = run(decoder.operation(), piece(batch, begin, end), execution);
    if (some.ok()) {
      *statistics += *some;
      response.pack(batch, begin, end);
    } else {
      statistics = some.status();
    }
    return some.ok();
  });
  co_await computed;
  if (!statistics.ok()) co_return statistics.status();
  tools.facts.operation = view(name(decoder.operation()));
  tools.facts.distribution = view(name(batch.model.distribution));
  tools.facts.masking = view(name(batch.model.masking));
  tools.facts.sampler = view(name(batch.sampler));
  tools.facts.lanes += batch.lanes;
  tools.metrics.computed(decoder.operation(), batch.model, batch.sampler, *statistics);

  v1::Statistics counts;
  counts.set_accepted(statistics->accepted);
  counts.set_occluded(statistics->occluded);
  counts.set_smooth(statistics->smooth);
  counts.set_invalid(statistics->invalid);
  writer.message(v1::BatchResponse::kStatisticsFieldNumber, counts);
  co_return std::move(writer).finish();
}

Task<absl::Status> begin_answer(const grpc::ByteBuffer& request, const CallTools& tools) {
  if (auto status = tools.stay.work(); !status.ok()) co_return status;
  if (auto status = tools.stay.hold(2 * request.Length()); !status.ok()) co_return status;
  if (!is_small(request)) co_await tools.compute.turn(true);
  co_return absl::OkStatus();
}

bool is_small(const grpc::ByteBuffer& request) { return request.Length() <= std::size_t{1} << 18; }

absl::Status invalid_field(absl::string_view field, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat(field, ": ", what));
}

absl::Status damaged_message() { return absl::InvalidArgumentError("message: truncated or damaged"); }

absl::Status check_lanes(std::uint64_t lanes, const Limits& limits) {
  if (lanes <= limits.lanes()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("lanes: ", lanes, " are above the limit of ", limits.lanes(), ": send them in several calls"));
}

}  // namespace facetwise
