// SPDX-License-Identifier: Apache-2.0
// A client of grpc.health.v1, whose .proto Debian does not package: two messages of one field each, written
// and read by hand (a request is string service = 1, a response enum status = 1).
#pragma once

#include <memory>
#include <string>

#include "grpcpp/generic/generic_stub.h"
#include "grpcpp/grpcpp.h"

namespace facetwise::testing {

class Health {
 public:
  enum Status { unknown = 0, serving = 1, not_serving = 2, service_unknown = 3 };

  explicit Health(std::shared_ptr<grpc::Channel> channel) : stub_(std::move(channel)) {}

  // `unknown` if the call fails.
  Status check(const std::string& service) {
    grpc::ClientContext context;
    grpc::CompletionQueue queue;
    const auto call = stub_.PrepareUnaryCall(&context, "/grpc.health.v1.Health/Check", request(service), &queue);
    grpc::ByteBuffer response;
    grpc::Status status;
    call->StartCall();
    call->Finish(&response, &status, this);
    next_event(queue);
    return status.ok() ? parse(response) : unknown;
  }

  // A Watch call: what the service's status is, and becomes.
  class Watch {
   public:
    Watch(std::shared_ptr<grpc::Channel> channel, const std::string& service) : stub_(std::move(channel)) {
      call_ = stub_.PrepareCall(&context_, "/grpc.health.v1.Health/Watch", &queue_);
      call_->StartCall(this);
      next_event(queue_);
      call_->WriteLast(request(service), {}, this);
      next_event(queue_);
    }
    ~Watch() {
      context_.TryCancel();
      grpc::Status status;
      call_->Finish(&status, this);
      next_event(queue_);
    }
    // Waits for the next; `unknown` when the call has ended.
    Status next() {
      grpc::ByteBuffer response;
      call_->Read(&response, this);
      return next_event(queue_) ? parse(response) : unknown;
    }

   private:
    grpc::GenericStub stub_;
    grpc::ClientContext context_;
    grpc::CompletionQueue queue_;
    std::unique_ptr<grpc::GenericClientAsyncReaderWriter> call_;
  };

 private:
  static bool next_event(grpc::CompletionQueue& queue) {
    void* tag = nullptr;
    bool good = false;
    return queue.Next(&tag, &good) && good;
  }
  static grpc::ByteBuffer request(const std::string& service) {
    std::string bytes = {0x0a, static_cast<char>(service.size())};
    bytes.append(service);
    const grpc::Slice slice(bytes);
    return grpc::ByteBuffer(&slice, 1);
  }
  static Status parse(const grpc::ByteBuffer& response) {
    grpc::Slice slice;
    if (!response.DumpToSingleSlice(&slice).ok() || slice.size() != 2 || slice.begin()[0] != 0x08) return unknown;
    return static_cast<Status>(slice.begin()[1]);
  }

  grpc::GenericStub stub_;
};

}  // namespace facetwise::testing
