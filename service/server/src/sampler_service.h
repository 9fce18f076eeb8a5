// facetwise.v1.Sampler.
#pragma once

#include <atomic>

#include "facetwise/server.h"
#include "facetwise/v1/sampler.pb.h"
#include "grpcpp/impl/codegen/proto_utils.h"
#include "grpcpp/impl/service_type.h"
#include "grpcpp/server_context.h"
#include "grpcpp/support/byte_buffer.h"
#include "grpcpp/support/method_handler.h"
#include "grpcpp/support/sync_stream.h"
#include "src/admission.h"
#include "src/call.h"
#include "src/compute.h"
#include "src/tables.h"
#include "src/tokens.h"
#include "src/watch.h"

namespace facetwise {

// The calls that move columns are handled as bytes, so that columns are read and written in place; the rest
// are generated messages. Registers itself as generated code does, since that has no synchronous raw calls.
// Unary calls that move columns are registered as streams (the wire is the same): a call is then counted, or
// refused, when it begins, not when gRPC has read its request.
class SamplerService final : public grpc::Service {
 public:
  explicit SamplerService(const ServerOptions& options);

  // Before the first call. Error: the file of tokens, and why.
  absl::Status read_tokens() { return tokens_.read(); }
  Admission& admission() { return admission_; }

 private:
  using Stream = grpc::ServerReaderWriter<grpc::ByteBuffer, grpc::ByteBuffer>;
  using Answer = absl::StatusOr<grpc::ByteBuffer> (*)(grpc::ByteBuffer&, const CallTools&);

  enum class Messages { one, many };

  void add(const char* name, Answer answer, Messages messages);
  // Of generated messages, one each way; the caller's token is checked.
  template <class Request, class Response>
  void add_small(const char* name, grpc::Status (SamplerService::*answer)(const Request&, Response&));
  grpc::Status answer_one(Answer answer, grpc::ServerContext& context, Stream& stream);
  grpc::Status answer_many(Answer answer, grpc::ServerContext& context, Stream& stream);
  grpc::Status upload_table(grpc::ServerContext& context, grpc::ServerReader<v1::TableChunk>& reader,
                            v1::SlopeTableInfo& response);
  grpc::Status list_tables(const v1::ListTablesRequest& request, v1::ListTablesResponse& response);
  grpc::Status delete_table(const v1::DeleteTableRequest& request, v1::DeleteTableResponse& response);
  grpc::Status info(const v1::InfoRequest& request, v1::InfoResponse& response);
  grpc::Status benchmark(grpc::ServerContext& context, const v1::BenchmarkRequest& request,
                         grpc::ServerWriter<v1::BenchmarkProgress>& writer);

  const ServerOptions options_;
  const Limits limits_;
  Admission admission_;
  Compute compute_;
  Tables tables_;
  Watch watch_;
  Tokens tokens_;
  std::atomic<bool> benchmark_runs_{false};
};

}  // namespace facetwise
