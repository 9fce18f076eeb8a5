// SPDX-License-Identifier: Apache-2.0
// Writes a protobuf message into one block of memory: small fields as bytes, columns as room that the caller
// (or the engine) fills, so that no value is copied on its way out.
#pragma once

#include <cstddef>
#include <vector>

#include "google/protobuf/message_lite.h"
#include "grpcpp/support/byte_buffer.h"
#include "wire/buffer_pool.h"

namespace facetwise::wire {

class MessageWriter {
 public:
  // Room for `columns` columns of together `column_bytes`, and `other_bytes` of whole messages. `aligned`:
  // columns begin at multiples of 4 bytes (long ones of 64), so that they can be used as float columns.
  MessageWriter(std::size_t columns, std::size_t column_bytes, std::size_t other_bytes, bool aligned);

  // Adds the fields of a message (protobuf merges what is written one after the other).
  void fields(const google::protobuf::MessageLite& message);
  // Adds a message as a field.
  void message(int field, const google::protobuf::MessageLite& message);
  // Begins a message of `bytes` bytes as a field: the column_bytes() of its columns, which follow.
  void begin(int field, std::size_t bytes);
  // Adds a bytes field and returns its memory, to be filled before the message is sent.
  char* column(int field, std::size_t bytes);
  // What column() adds to the message. Field numbers below 16 only.
  static std::size_t field_bytes(std::size_t bytes);

  grpc::ByteBuffer finish() &&;

 private:
  void tag(int field);
  void varint(std::size_t value);

  Block block_;
  bool aligned_;
  std::size_t at_ = 0;
  // Parts of the block that make up the message: aligning leaves gaps.
  struct Part {
    std::size_t begin, end;
  };
  std::vector<Part> parts_;
};

}  // namespace facetwise::wire
