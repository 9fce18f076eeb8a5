// SPDX-License-Identifier: Apache-2.0
#include "facetwise/remote_tables.h"

#include <algorithm>

#include "facetwise/v1/sampler.grpc.pb.h"
#include "wire/status.h"

namespace facetwise {
namespace {

// A call's context and stub.
struct Call {
  Call(const Channel& channel, std::chrono::system_clock::time_point until)
      : stub(v1::Sampler::NewStub(channel.channel)) {
    channel.authorise(context);
    context.set_deadline(until);
  }
  grpc::ClientContext context;
  std::unique_ptr<v1::Sampler::Stub> stub;
};

}  // namespace

absl::Status upload_table(const Channel& channel, const SlopeTable& table, std::size_t piece_bytes,
                          std::chrono::system_clock::time_point until) {
  const std::string bytes = table.serialise();
  Call call(channel, until);
  v1::SlopeTableInfo info;
  const auto writer = call.stub->UploadTable(&call.context, &info);
  v1::TableChunk chunk;
  chunk.set_id(table.id());
  chunk.set_bytes(bytes.size());
  // The first is empty: a server that has the table needs no more. A write fails when the server has answered.
  bool goes_on = writer->Write(chunk);
  for (std::size_t at = 0; goes_on && at < bytes.size(); at += piece_bytes) {
    chunk.Clear();
    chunk.set_data(bytes.substr(at, piece_bytes));
    goes_on = writer->Write(chunk);
  }
  writer->WritesDone();
  const grpc::Status status = writer->Finish();
  return status.ok() ? absl::OkStatus() : wire::from_grpc(status, channel.address);
}

absl::StatusOr<std::vector<RemoteTable>> list_tables(const Channel& channel,
                                                     std::chrono::system_clock::time_point until) {
  Call call(channel, until);
  v1::ListTablesResponse response;
  if (const auto status = call.stub->ListTables(&call.context, {}, &response); !status.ok())
    return wire::from_grpc(status, channel.address);
  std::vector<RemoteTable> tables;
  for (const v1::SlopeTableInfo& info : response.tables())
    tables.push_back({info.id(), info.bytes(), info.radial(), std::chrono::duration<double>(info.idle_seconds())});
  return tables;
}

absl::Status delete_table(const Channel& channel, std::uint64_t id, std::chrono::system_clock::time_point until) {
  Call call(channel, until);
  v1::DeleteTableRequest request;
  request.set_id(id);
  v1::DeleteTableResponse response;
  const auto status = call.stub->DeleteTable(&call.context, request, &response);
  return status.ok() ? absl::OkStatus() : wire::from_grpc(status, channel.address);
}

}  // namespace facetwise
