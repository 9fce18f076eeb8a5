// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "absl/strings/str_cat.h"
#include "facetwise/v1/sampler.pb.h"
#include "src/gather.h"
#include "src/pieces.h"
#include "wire/message_reader.h"
#include "wire/message_writer.h"

namespace facetwise {
namespace {

using wire::MessageReader;
using wire::MessageWriter;
using Response = v1::CompactResponse;

absl::Status bad_answer(absl::string_view what) { return absl::InternalError(absl::StrCat("its answer ", what)); }

std::size_t most_lanes(const Compaction& compaction, const PieceLimits& limits) {
  std::size_t request = 1, response = sizeof(std::uint32_t);
  for (const auto& column : compaction.columns) {
    request += column.from.one_value() ? 0 : sizeof(float);
    response += sizeof(float);
  }
  return limits.lanes(request, response);
}

// Reads `count` values of a column of the message to a column's elements from `first` on.
template <class T, class Convert>
bool read_values(MessageReader& reader, const OutputColumn<T>& to, std::size_t first, std::size_t count,
                 const Convert& convert) {
  constexpr std::size_t kStaged = 1024;
  T staged[kStaged];
  for (std::size_t k = 0; k < count;) {
    const std::size_t part = std::min(kStaged, count - k);
    if (!reader.read(staged, part * sizeof(T))) return false;
    for (std::size_t j = 0; j < part; ++j, ++k)
      if (!convert(staged[j], to[first + k])) return false;
  }
  return true;
}

}  // namespace

CompactPieces::CompactPieces(const Compaction& compaction, const PieceLimits& limits)
    : compaction_(compaction),
      positions_(compaction.lanes, compaction.active),
      split_(positions_.count(), most_lanes(compaction, limits)),
      first_(split_.pieces() + 1) {}

Pieces CompactPieces::pieces() {
  return {"/facetwise.v1.Sampler/Compact", split_.pieces(), [this](std::size_t piece) { return encode(piece); },
          [this](std::size_t piece, grpc::ByteBuffer& response) { return decode(piece, response); }};
}

// Called in the pieces' order.
grpc::ByteBuffer CompactPieces::encode(std::size_t piece) {
  const Range range = split_.range(piece);
  v1::CompactRequest small;
  small.set_lanes(range.size());
  const std::size_t status_bytes = values_sent(compaction_.status, range);
  std::size_t bytes = status_bytes;
  for (const auto& column : compaction_.columns) bytes += values_sent(column.from, range) * sizeof(float);
  MessageWriter writer(1 + compaction_.columns.size(), bytes, small.ByteSizeLong(), false);
  writer.fields(small);
  char* status = writer.column(v1::CompactRequest::kStatusFieldNumber, status_bytes);
  gather(compaction_.status, positions_, range, status);
  const std::size_t accepted = std::count(status, status + status_bytes, static_cast<char>(LaneStatus::accepted));
  first_[piece + 1] = first_[piece] + (status_bytes == range.size() ? accepted : accepted * range.size());
  for (const auto& column : compaction_.columns)
    gather(column.from, positions_, range,
           writer.column(v1::CompactRequest::kColumnsFieldNumber, values_sent(column.from, range) * sizeof(float)));
  return std::move(writer).finish();
}

absl::Status CompactPieces::decode(std::size_t piece, grpc::ByteBuffer& response) const {
  const Range range = split_.range(piece);
  const std::size_t first = first_[piece], count = first_[piece + 1] - first;
  MessageReader reader(response);
  std::size_t columns = 0;
  std::uint64_t accepted = 0;
  bool good = true, has_index = false;
  while (good) {
    const auto field = reader.next();
    if (!field) break;
    std::size_t bytes = 0;
    switch (field->number) {
      case Response::kAcceptedFieldNumber: good = reader.varint(*field, accepted); break;
      case Response::kIndexFieldNumber:
        has_index = true;
        if (!compaction_.index.present()) {
          good = reader.skip(*field);
          break;
        }
        good = reader.length(*field, bytes) && bytes == count * sizeof(std::uint32_t) &&
               read_values(reader, compaction_.index, first, count, [&](std::uint32_t position, std::uint32_t& to) {
                 to = static_cast<std::uint32_t>(
                     positions_.lane(range.begin + std::min<std::size_t>(position, range.size() - 1)));
                 return position < range.size();
               });
        break;
      case Response::kColumnsFieldNumber:
        good = columns < compaction_.columns.size() && reader.length(*field, bytes) && bytes == count * sizeof(float) &&
               read_values(reader, compaction_.columns[columns].to, first, count, [](float value, float& to) {
                 to = value;
                 return true;
               });
        ++columns;
        break;
      default: good = reader.skip(*field);
    }
  }
  if (!good || !reader.finished()) return bad_answer("is damaged");
  if (accepted != count || columns != compaction_.columns.size() || (count > 0 && !has_index))
    return bad_answer("is not what was asked for");
  return absl::OkStatus();
}

}  // namespace facetwise
