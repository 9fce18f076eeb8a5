// SPDX-License-Identifier: Apache-2.0
#include "wire/message_reader.h"

#include "google/protobuf/wire_format_lite.h"

namespace facetwise::wire {

using google::protobuf::internal::WireFormatLite;

MessageReader::MessageReader(grpc::ByteBuffer& message) : slices_(&message), stream_(&slices_) {
  stream_.PushLimit(static_cast<int>(message.Length()));
}

std::optional<MessageReader::Field> MessageReader::next() {
  tag_ = stream_.ReadTag();
  if (tag_ == 0) return std::nullopt;
  return Field{WireFormatLite::GetTagFieldNumber(tag_), static_cast<int>(WireFormatLite::GetTagWireType(tag_))};
}

bool MessageReader::finished() {
  // The first is false where a tag was cut short, the second where one was damaged.
  return stream_.ConsumedEntireMessage() && stream_.BytesUntilLimit() == 0;
}

bool MessageReader::varint(const Field& field, std::uint64_t& value) {
  return field.wire_type == WireFormatLite::WIRETYPE_VARINT && stream_.ReadVarint64(&value);
}

bool MessageReader::eight_bytes(const Field& field, std::uint64_t& value) {
  return field.wire_type == WireFormatLite::WIRETYPE_FIXED64 && stream_.ReadLittleEndian64(&value);
}

bool MessageReader::length(const Field& field, std::size_t& bytes) {
  std::uint32_t value = 0;
  if (field.wire_type != WireFormatLite::WIRETYPE_LENGTH_DELIMITED || !stream_.ReadVarint32(&value)) return false;
  bytes = value;
  return value <= static_cast<std::uint32_t>(stream_.BytesUntilLimit());
}

bool MessageReader::read(void* to, std::size_t bytes) { return stream_.ReadRaw(to, static_cast<int>(bytes)); }

bool MessageReader::skip(const Field&) { return WireFormatLite::SkipField(&stream_, tag_); }

}  // namespace facetwise::wire
