// SPDX-License-Identifier: Apache-2.0
#include "wire/message_writer.h"

#include <cstdint>
#include <cstring>
#include <utility>

#include "google/protobuf/io/coded_stream.h"
#include "google/protobuf/wire_format_lite.h"

namespace facetwise::wire {
namespace {

using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedOutputStream;

// Bytes that begin(), column() and message() put before a column: two tags and two lengths.
constexpr std::size_t kLargestHeader = 32;
constexpr std::size_t kAlignment = 64;

}  // namespace

MessageWriter::MessageWriter(std::size_t columns, std::size_t column_bytes, std::size_t other_bytes, bool aligned)
    : block_(column_bytes + other_bytes + (columns + 2) * (kLargestHeader + kAlignment)), aligned_(aligned) {
  parts_.reserve(columns + 1);
  parts_.push_back({0, 0});
}

void MessageWriter::tag(int field) {
  varint(WireFormatLite::MakeTag(field, WireFormatLite::WIRETYPE_LENGTH_DELIMITED));
}

void MessageWriter::varint(std::size_t value) {
  auto* to = reinterpret_cast<std::uint8_t*>(block_.data() + at_);
  at_ += CodedOutputStream::WriteVarint64ToArray(value, to) - to;
}

void MessageWriter::fields(const google::protobuf::MessageLite& message) {
  const std::size_t bytes = message.ByteSizeLong();
  message.SerializeWithCachedSizesToArray(reinterpret_cast<std::uint8_t*>(block_.data() + at_));
  at_ += bytes;
}

void MessageWriter::message(int field, const google::protobuf::MessageLite& message) {
  begin(field, message.ByteSizeLong());
  fields(message);
}

void MessageWriter::begin(int field, std::size_t bytes) {
  tag(field);
  varint(bytes);
}

char* MessageWriter::column(int field, std::size_t bytes) {
  tag(field);
  varint(bytes);
  if (aligned_) {
    // Moves what was written since the last column, so that this column begins at a multiple.
    const std::size_t alignment = bytes >= 1024 ? kAlignment : 4;
    const std::size_t gap = (alignment - at_ % alignment) % alignment;
    if (gap > 0) {
      Part& last = parts_.back();
      std::memmove(block_.data() + last.begin + gap, block_.data() + last.begin, at_ - last.begin);
      last.begin += gap;
      at_ += gap;
    }
    at_ += bytes;
    parts_.back().end = at_;
    parts_.push_back({at_, at_});
  } else {
    at_ += bytes;
  }
  return block_.data() + at_ - bytes;
}

std::size_t MessageWriter::field_bytes(std::size_t bytes) { return 1 + CodedOutputStream::VarintSize64(bytes) + bytes; }

grpc::ByteBuffer MessageWriter::finish() && {
  parts_.back().end = at_;
  const grpc::Slice whole = std::move(block_).into_slice();
  std::vector<grpc::Slice> slices;
  slices.reserve(parts_.size());
  for (const Part& part : parts_)
    if (part.end > part.begin) slices.push_back(whole.sub(part.begin, part.end));
  return grpc::ByteBuffer(slices.data(), slices.size());
}

}  // namespace facetwise::wire
