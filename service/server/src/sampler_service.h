// facetwise.v1.Sampler.
#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <thread>

#include "facetwise/server.h"
#include "facetwise/v1/sampler.pb.h"
#include "grpcpp/impl/codegen/proto_utils.h"
#include "grpcpp/impl/service_type.h"
#include "grpcpp/support/byte_buffer.h"
#include "src/admission.h"
#include "src/answer.h"
#include "src/call.h"
#include "src/compute.h"
#include "src/tables.h"
#include "src/task.h"
#include "src/tokens.h"

namespace facetwise {

// Every method is registered as a stream of bytes in both directions, whatever it is on the wire (which is the same): gRPC
// then reads nothing before it is asked to, so a message is counted before it comes, and columns are read and written in
// place.
class SamplerService final : public grpc::Service {
 public:
  explicit SamplerService(const ServerOptions& options);
  ~SamplerService() override;

  // Before the first call. Error: the file of tokens, and why.
  absl::Status read_tokens() { return tokens_.read(); }
  Admission& admission() { return admission_; }

 private:
  using Answer = std::function<Task<absl::StatusOr<grpc::ByteBuffer>>(grpc::ByteBuffer& request, Call& call)>;
  using AnswerColumns = Task<absl::StatusOr<grpc::ByteBuffer>> (*)(grpc::ByteBuffer&, const CallTools&);

  // After the caller's token has been checked and the call is admitted.
  void add(const char* name, Call::Course course);
  Answer with_tools(AnswerColumns answer);
  // Of generated messages, one each way.
  template <class Request, class Response>
  void add_small(const char* name, absl::Status (SamplerService::*answer)(const Request&, Response&));

  // Of a call that takes one.
  Task<absl::StatusOr<grpc::ByteBuffer>> read_one(Call& call);
  Task<Call::End> answer_one(Answer answer, Call& call);
  Task<Call::End> answer_many(Answer answer, Call& call);
  Task<Call::End> upload_table(Call& call);
  Task<Call::End> benchmark(Call& call);
  absl::Status list_tables(const v1::ListTablesRequest& request, v1::ListTablesResponse& response);
  absl::Status delete_table(const v1::DeleteTableRequest& request, v1::DeleteTableResponse& response);
  absl::Status info(const v1::InfoRequest& request, v1::InfoResponse& response);

  const ServerOptions options_;
  const Limits limits_;
  Admission admission_;
  Compute compute_;
  Tables tables_;
  Tokens tokens_;
  int methods_ = 0;
  std::atomic<bool> benchmark_runs_{false};
  std::mutex benchmark_mutex_;  // of the next
  std::thread benchmark_thread_;
};

}  // namespace facetwise
