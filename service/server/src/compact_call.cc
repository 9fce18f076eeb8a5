// SPDX-License-Identifier: Apache-2.0
// Compact and CompactStream.
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

#include "absl/strings/str_cat.h"
#include "facetwise/engine.h"
#include "facetwise/v1/sampler.pb.h"
#include "src/answer.h"
#include "wire/message_reader.h"
#include "wire/message_writer.h"

namespace facetwise {
namespace {

using wire::MessageReader;
using Request = v1::CompactRequest;

constexpr std::size_t kAlignment = 64;

std::size_t round_up(std::size_t bytes) { return (bytes + kAlignment - 1) / kAlignment * kAlignment; }

struct Decoded {
  std::uint64_t lanes = 0;
  wire::Block block;
  Column<std::uint8_t> status;
  std::vector<Column<float>> columns;
};

class Decoder {
 public:
  explicit Decoder(grpc::ByteBuffer& message)
      : reader_(message), block_(message.Length() + (kMostCompactColumns + 2) * kAlignment) {}

  absl::Status read(Decoded& decoded) {
    while (const auto field = reader_.next())
      if (auto status = read_field(*field, decoded); !status.ok()) return status;
    if (!reader_.finished()) return damaged_message();
    decoded.block = std::move(block_);
    return absl::OkStatus();
  }

 private:
  absl::Status read_field(const MessageReader::Field& field, Decoded& decoded) {
    std::size_t bytes = 0;
    switch (field.number) {
      case Request::kLanesFieldNumber:
        return reader_.varint(field, decoded.lanes) ? absl::OkStatus() : damaged_message();
      case Request::kStatusFieldNumber: {
        if (!reader_.length(field, bytes)) return damaged_message();
        if (decoded.status.present()) return invalid_field("status", "given twice");
        const char* data = read_bytes(bytes);
        if (data == nullptr) return damaged_message();
        decoded.status = {reinterpret_cast<const std::uint8_t*>(data), bytes};
        return absl::OkStatus();
      }
      case Request::kColumnsFieldNumber: {
        const std::size_t k = decoded.columns.size();
        if (!reader_.length(field, bytes)) return damaged_message();
        if (k == kMostCompactColumns)
          return absl::InvalidArgumentError(absl::StrCat("columns: more than the limit of ", kMostCompactColumns));
        if (bytes % 4 != 0)
          return invalid_field(absl::StrCat("columns[", k, "]"),
                               absl::StrCat(bytes, " bytes are not whole values of 4 bytes"));
        const char* data = read_bytes(bytes);
        if (data == nullptr) return damaged_message();
        decoded.columns.push_back({reinterpret_cast<const float*>(data), bytes / 4});
        return absl::OkStatus();
      }
      default: return reader_.skip(field) ? absl::OkStatus() : damaged_message();
    }
  }

  const char* read_bytes(std::size_t bytes) {
    at_ = round_up(at_);
    char* data = block_.data() + at_;
    if (!reader_.read(data, bytes)) return nullptr;
    at_ += bytes;
    return data;
  }

  MessageReader reader_;
  wire::Block block_;
  std::size_t at_ = 0;
};

absl::Status check_request(const Decoded& decoded, const Limits& limits) {
  const std::size_t lanes = decoded.lanes;
  if (auto status = check_lanes(lanes, limits); !status.ok()) return status;
  for (std::size_t k = 0; k < decoded.columns.size(); ++k) {
    const Column<float>& column = decoded.columns[k];
    if (column.count() != lanes && !column.one_value())
      return invalid_field(absl::StrCat("columns[", k, "]"),
                           absl::StrCat(column.count(), " values for ", lanes, lanes == 1 ? " lane" : " lanes"));
  }
  if (const std::size_t most = lanes * 4 * (1 + decoded.columns.size()); most > limits.message_bytes)
    return absl::InvalidArgumentError(absl::StrCat("columns: ", most, " bytes for ", lanes,
                                                   " lanes are above the limit of ", limits.message_bytes,
                                                   ": send fewer lanes"));
  return absl::OkStatus();
}

}  // namespace

Task<absl::StatusOr<grpc::ByteBuffer>> answer_compact(grpc::ByteBuffer& request, const CallTools& tools) {
  const bool is_short = is_small(request);
  if (auto status = co_await begin_answer(request, tools); !status.ok()) co_return status;
  Decoded decoded;
  if (auto status = Decoder(request).read(decoded); !status.ok()) co_return status;
  request.Clear();
  static constexpr std::uint8_t kNothing = 0;
  if (decoded.lanes == 0 && !decoded.status.present()) decoded.status = {&kNothing, 0};
  if (auto status = check_request(decoded, tools.limits); !status.ok()) co_return status;

  // How many are accepted is known afterwards: compacts into a block, then copies what there is.
  const std::size_t columns = 1 + decoded.columns.size();
  const std::size_t room = round_up(decoded.lanes * 4);
  if (auto status = tools.stay.hold(2 * columns * room); !status.ok()) co_return status;
  const wire::Block compacted(columns * room);
  const auto values = [&](std::size_t k) { return compacted.data() + k * room; };
  Compaction compaction;
  compaction.lanes = decoded.lanes;
  compaction.status = decoded.status;
  compaction.index = {reinterpret_cast<std::uint32_t*>(values(0)), decoded.lanes};
  std::vector<Compaction::DenseColumn> dense;
  for (std::size_t k = 1; k < columns; ++k)
    dense.push_back({decoded.columns[k - 1], {reinterpret_cast<float*>(values(k)), decoded.lanes}});
  compaction.columns = dense;
  if (is_short && !tools.compute.idle()) {
    auto turn = tools.compute.turn(false);
    co_await turn;
  }
  absl::StatusOr<std::size_t> accepted;
  auto computed = tools.compute.each(0, [&](std::size_t, std::size_t, const Execution& execution) {
    accepted = compact(compaction, execution);
    return true;
  });
  co_await computed;
  if (!accepted.ok()) co_return accepted.status();
  tools.facts.lanes += decoded.lanes;

  v1::CompactResponse small;
  small.set_accepted(*accepted);
  wire::MessageWriter writer(columns, columns * *accepted * 4, 64, false);
  writer.fields(small);
  for (std::size_t k = 0; k < columns; ++k) {
    const int field = k == 0 ? v1::CompactResponse::kIndexFieldNumber : v1::CompactResponse::kColumnsFieldNumber;
    std::memcpy(writer.column(field, *accepted * 4), values(k), *accepted * 4);
  }
  co_return std::move(writer).finish();
}

}  // namespace facetwise
