// SPDX-License-Identifier: Apache-2.0
// One message in, one message out: what Run, RunStream, Compact and CompactStream do with each.
#pragma once

#include <atomic>
#include <cstddef>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "grpcpp/support/byte_buffer.h"
#include "src/admission.h"
#include "src/call.h"
#include "src/compute.h"
#include "src/metrics.h"
#include "src/shared_regions.h"
#include "src/tables.h"
#include "src/task.h"

namespace facetwise {

struct Limits {
  std::size_t message_bytes;
  // So that a small request (columns of one value, no outputs) cannot ask for unbounded work.
  std::size_t lanes() const { return message_bytes / 4; }
};

// Most columns of one CompactRequest.
inline constexpr std::size_t kMostCompactColumns = 64;

struct CallTools {
  Limits limits;
  Compute& compute;
  Tables& tables;
  const SharedRegions& regions;
  Admission::Stay& stay;
  const std::atomic<bool>& stop;  // the call is cancelled
  Metrics& metrics;
  CallFacts& facts;
};

// Both empty `request` once it is read. Errors begin with the field's name.
Task<absl::StatusOr<grpc::ByteBuffer>> answer_batch(grpc::ByteBuffer& request, const CallTools& tools);
Task<absl::StatusOr<grpc::ByteBuffer>> answer_compact(grpc::ByteBuffer& request, const CallTools& tools);

// Awaited first by both: counts the call, and its request as received and decoded. A request that is not small waits for its
// turn before it is decoded, the others after that.
Task<absl::Status> begin_answer(const grpc::ByteBuffer& request, const CallTools& tools);
bool is_small(const grpc::ByteBuffer& request);

// Errors that both make.
absl::Status invalid_field(absl::string_view field, absl::string_view what);
absl::Status damaged_message();
absl::Status check_lanes(std::uint64_t lanes, const Limits& limits);

}  // namespace facetwise
