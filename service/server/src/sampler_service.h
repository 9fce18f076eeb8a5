// SPDX-License-Identifier: Apache-2.0
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
#include "src/acceptor.h"
#include "src/admission.h"
#include "src/answer.h"
#include "src/call.h"
#include "src/compute.h"
#include "src/log.h"
#include "src/metrics.h"
#include "src/shared_regions.h"
#include "src/tables.h"
#include "src/task.h"
#include "src/tokens.h"

namespace facetwise {

// Every method is registered as a stream of bytes in both directions, whatever it is on the wire (which is the same): gRPC
// then reads nothing before it is asked to, so a message is counted before it comes, and columns are read and written in
// place.
class SamplerService final : public grpc::Service {
 public:
  // All that it is given but the options must outlive it.
  SamplerService(const ServerOptions& options, const Connections& connections, const SharedRegions& regions, Log& log);
  ~SamplerService() override;

  // Before the first call. Error: the file of tokens, and why.
  absl::Status read_tokens() { return tokens_.read(); }
  Admission& admission() { return admission_; }
  Metrics& metrics() { return metrics_; }
  // Tells from now on that it serves no more; calls are still taken.
  void begin_drain() { serving_ = false; }
  // What it is and may hold.
  const v1::InfoResponse& identity() const { return identity_; }

 private:
  using Answer = std::function<Task<absl::StatusOr<grpc::ByteBuffer>>(grpc::ByteBuffer& request, Call& call)>;
  using AnswerColumns = Task<absl::StatusOr<grpc::ByteBuffer>> (*)(grpc::ByteBuffer&, const CallTools&);

  // After the caller's token has been checked and the call is admitted. By the method's name.
  void add(const std::string& name, const Call::Course& course);
  Answer with_tools(const char* method, AnswerColumns answer);
  // Counts the call, and logs it.
  void tell_end(const std::string& method, Call& call, const grpc::Status& status, std::chrono::duration<double> time);
  // Of generated messages, one each way.
  template <class Request, class Response>
  void add_small(const std::string& name, absl::Status (SamplerService::*answer)(const Request&, Response&));

  // Of a call that takes one.
  Task<absl::StatusOr<grpc::ByteBuffer>> read_one(Call& call);
  Task<Call::End> answer_one(Answer answer, Call& call);
  Task<Call::End> answer_many(Answer answer, Call& call);
  Task<Call::End> upload_table(Call& call);
  Task<Call::End> benchmark(Call& call);
  absl::Status list_tables(const v1::ListTablesRequest& request, v1::ListTablesResponse& response);
  absl::Status delete_table(const v1::DeleteTableRequest& request, v1::DeleteTableResponse& response);
  absl::Status info(const v1::InfoRequest& request, v1::InfoResponse& response);
  v1::InfoResponse identify() const;
  v1::ServerLoad load() const;

  const ServerOptions options_;
  const Connections& connections_;
  const SharedRegions& regions_;
  Log& log_;
  const std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
  const std::string run_;  // names this run of the server, in request ids
  std::atomic<std::uint64_t> named_{0};
  const Limits limits_;
  Admission admission_;
  Compute compute_;
  Tables tables_;
  Tokens tokens_;
  const v1::InfoResponse identity_;
  Metrics metrics_;
  std::vector<std::unique_ptr<std::string>> methods_;  // their paths
  std::atomic<bool> serving_{true}, benchmark_runs_{false};
  std::mutex benchmark_mutex_;  // of the next
  std::thread benchmark_thread_;
};

}  // namespace facetwise
