// SPDX-License-Identifier: Apache-2.0
// Reads a protobuf message as gRPC received it, in slices: large fields go straight to where they belong.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "google/protobuf/io/coded_stream.h"
#include "grpcpp/support/byte_buffer.h"
#include "grpcpp/support/proto_buffer_reader.h"

namespace facetwise::wire {

// Every function returns false, or nothing, where the message is truncated or damaged.
class MessageReader {
 public:
  // Reads `message`, which must stay.
  explicit MessageReader(grpc::ByteBuffer& message);

  struct Field {
    int number;
    int wire_type;  // as in the encoding: 0 varint, 1 eight bytes, 2 bytes, 5 four bytes
  };
  // The next field of the message, or of the part that inside() reads. Nothing at its end: then finished().
  std::optional<Field> next();
  // The message, or part, was read to its end.
  bool finished();

  // A field's value. A field of another wire type than expected is damage.
  bool varint(const Field& field, std::uint64_t& value);
  bool eight_bytes(const Field& field, std::uint64_t& value);
  // A bytes field's length, at most what is left of the message; read() or inside() must follow.
  bool length(const Field& field, std::size_t& bytes);
  bool read(void* to, std::size_t bytes);
  // Calls body() to read the next `bytes` bytes as a part: a message, or packed values.
  template <class Body>
  bool inside(std::size_t bytes, const Body& body) {
    const auto limit = stream_.PushLimit(static_cast<int>(bytes));
    const bool good = body() && stream_.BytesUntilLimit() == 0;
    stream_.PopLimit(limit);
    return good;
  }
  // A packed value inside().
  bool packed_varint(std::uint64_t& value) { return stream_.ReadVarint64(&value); }
  bool at_end() const { return stream_.BytesUntilLimit() == 0; }
  // Passes over a field that is not known.
  bool skip(const Field& field);

 private:
  grpc::ProtoBufferReader slices_;
  google::protobuf::io::CodedInputStream stream_;
  std::uint32_t tag_ = 0;
};

}  // namespace facetwise::wire
