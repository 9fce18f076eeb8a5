// SPDX-License-Identifier: Apache-2.0
// Requests that mean nothing: each gets a status that names the field, and the server answers the next call.
#include <cmath>
#include <functional>
#include <random>

#include "calls.h"
#include "facetwise/engine.h"
#include "facetwise/v1/error_details.pb.h"
#include "grpcpp/generic/generic_stub.h"
#include "gtest/gtest.h"
#include "server_process.h"

namespace facetwise {
namespace {

using grpc::StatusCode;
using testing::floats;
using testing::good_request;

constexpr std::size_t kLanes = 12;
constexpr std::size_t kMessageBytes = 1 << 20;  // the server's limit

class MalformedCall : public ::testing::Test {
 protected:
  MalformedCall() {
    channel_ = testing::open_channel(server_.addresses().at(0));
    stub_ = v1::Sampler::NewStub(channel_);
  }

  grpc::Status run(const v1::BatchRequest& request, v1::BatchResponse* response = nullptr) {
    grpc::ClientContext context;
    v1::BatchResponse unused;
    return stub_->Run(&context, request, response ? response : &unused);
  }
  grpc::Status compact(const v1::CompactRequest& request) {
    grpc::ClientContext context;
    v1::CompactResponse response;
    return stub_->Compact(&context, request, &response);
  }

  // Any bytes as a request.
  grpc::Status run_bytes(const std::string& method, const std::string& bytes, std::string* answer = nullptr) {
    grpc::GenericStub stub(channel_);
    grpc::ClientContext context;
    grpc::CompletionQueue queue;
    const grpc::Slice slice(bytes);
    const grpc::ByteBuffer request(&slice, 1);
    grpc::ByteBuffer response;
    grpc::Status status;
    const auto call = stub.PrepareUnaryCall(&context, "/facetwise.v1.Sampler/" + method, request, &queue);
    call->StartCall();
    call->Finish(&response, &status, this);
    void* tag = nullptr;
    bool good = false;
    EXPECT_TRUE(queue.Next(&tag, &good));
    std::vector<grpc::Slice> slices;
    if (answer != nullptr && status.ok() && response.Dump(&slices).ok())
      for (const grpc::Slice& part : slices) answer->append(reinterpret_cast<const char*>(part.begin()), part.size());
    return status;
  }

  void expect_alive() {
    v1::BatchResponse response;
    const grpc::Status status = run(good_request(kLanes), &response);
    ASSERT_TRUE(status.ok()) << status.error_message();
    ASSERT_EQ(response.statistics().accepted(), kLanes);
    ASSERT_EQ(response.outgoing().z().size(), kLanes * 4);
    ASSERT_EQ(response.status().size(), kLanes);
  }

  // The field is in the details too, as a google.rpc.BadRequest.
  void expect_field(const grpc::Status& status) {
    v1::ErrorStatus details;
    v1::BadRequest request;
    ASSERT_TRUE(details.ParseFromString(status.error_details()));
    EXPECT_EQ(details.code(), status.error_code());
    EXPECT_EQ(details.message(), status.error_message());
    ASSERT_EQ(details.details_size(), 1);
    EXPECT_EQ(details.details(0).type_url(), "type.googleapis.com/google.rpc.BadRequest");
    ASSERT_TRUE(request.ParseFromString(details.details(0).value()));
    ASSERT_EQ(request.field_violations_size(), 1);
    const auto& violation = request.field_violations(0);
    EXPECT_EQ(violation.field() + ": " + violation.description(), status.error_message());
  }

  void expect_error(const grpc::Status& status, StatusCode code, const std::string& message) {
    EXPECT_EQ(status.error_code(), code) << status.error_message();
    EXPECT_TRUE(status.error_message().starts_with(message))
        << "got \"" << status.error_message() << "\", expected \"" << message << "...\"";
    if (code == StatusCode::INVALID_ARGUMENT) expect_field(status);
    expect_alive();
  }

  // A good request, changed.
  void expect_run_error(const std::string& message, const std::function<void(v1::BatchRequest&)>& change,
                        StatusCode code = StatusCode::INVALID_ARGUMENT) {
    SCOPED_TRACE(message);
    v1::BatchRequest request = good_request(kLanes);
    change(request);
    expect_error(run(request), code, message);
  }

  testing::TemporaryFolder folder_;
  testing::ServerProcess server_{
      {"--listen", "unix:" + folder_.path("s"), "--max-message-bytes", std::to_string(kMessageBytes)}};
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::Sampler::Stub> stub_;
};

struct ColumnField {
  const char* name;
  std::string* (*bytes)(v1::BatchRequest&);
};
const ColumnField kColumns[] = {
    {"incident.x", [](v1::BatchRequest& r) { return r.mutable_incident()->mutable_x(); }},
    {"incident.y", [](v1::BatchRequest& r) { return r.mutable_incident()->mutable_y(); }},
    {"incident.z", [](v1::BatchRequest& r) { return r.mutable_incident()->mutable_z(); }},
    {"alpha_x", [](v1::BatchRequest& r) { return r.mutable_alpha_x(); }},
    {"alpha_y", [](v1::BatchRequest& r) { return r.mutable_alpha_y(); }},
    {"u1", [](v1::BatchRequest& r) { return r.mutable_u1(); }},
    {"u2", [](v1::BatchRequest& r) { return r.mutable_u2(); }},
    {"u3", [](v1::BatchRequest& r) { return r.mutable_u3(); }},
    {"outgoing.x", [](v1::BatchRequest& r) { return r.mutable_outgoing()->mutable_x(); }},
    {"outgoing.y", [](v1::BatchRequest& r) { return r.mutable_outgoing()->mutable_y(); }},
    {"outgoing.z", [](v1::BatchRequest& r) { return r.mutable_outgoing()->mutable_z(); }},
};

TEST_F(MalformedCall, EveryColumn) {
  for (const ColumnField& field : kColumns) {
    const std::string name = field.name;
    const bool query = name.starts_with("outgoing");
    const auto change = [&](const char* what, auto value) {
      expect_run_error(name + ": " + what, [&](v1::BatchRequest& request) {
        if (query) {
          request.set_operation(v1::PDF_REFLECTION);
          request.clear_outputs();
          request.add_outputs(v1::PDF);
          request.clear_u1(), request.clear_u2(), request.clear_u3();
          *request.mutable_outgoing() = request.incident();
        }
        *field.bytes(request) = value;
      });
    };
    change("missing", "");
    change("10 values for 12 lanes", floats(10, 0.5f));
    change("13 values for 12 lanes", floats(13, 0.5f));
    change("47 bytes are not whole values of 4 bytes", std::string(47, 'x'));
    change("1 bytes are not whole values of 4 bytes", "x");
  }
  expect_run_error("outgoing.y: sample_reflection does not read it",
                   [](v1::BatchRequest& r) { r.mutable_outgoing()->set_y(floats(kLanes, 0)); });
}

TEST_F(MalformedCall, EveryChoice) {
  const auto unknown = [&](const std::string& field, const auto& set) {
    for (const int value : {99, -1, 1 << 30})
      expect_run_error(field + ": unknown value " + std::to_string(value), [&](v1::BatchRequest& r) { set(r, value); });
  };
  unknown("operation", [](auto& r, int v) { r.set_operation(static_cast<v1::Operation>(v)); });
  unknown("sampler", [](auto& r, int v) { r.set_sampler(static_cast<v1::SamplerKind>(v)); });
  unknown("model.distribution",
          [](auto& r, int v) { r.mutable_model()->set_distribution(static_cast<v1::Distribution>(v)); });
  unknown("model.masking", [](auto& r, int v) { r.mutable_model()->set_masking(static_cast<v1::Masking>(v)); });
  unknown("model.shadowing", [](auto& r, int v) { r.mutable_model()->set_shadowing(static_cast<v1::Shadowing>(v)); });
  unknown("outputs", [](auto& r, int v) { r.add_outputs(static_cast<v1::Output>(v)); });
  expect_run_error("operation: missing", [](auto& r) { r.clear_operation(); });
  expect_run_error("outputs: holds OUTPUT_UNSPECIFIED", [](auto& r) { r.add_outputs(v1::OUTPUT_UNSPECIFIED); });
  expect_run_error("outputs: sample_reflection does not compute VALUE", [](auto& r) { r.add_outputs(v1::VALUE); });
  expect_run_error("outputs: sample_normal does not compute OUTGOING", [](auto& r) {
    r.set_operation(v1::SAMPLE_NORMAL);
    r.clear_u3();
  });
  expect_run_error("sampler: exact does not fit sample_normal", [](auto& r) {
    r.set_operation(v1::SAMPLE_NORMAL);
    r.set_sampler(v1::EXACT);
    r.clear_outputs();
  });
}

TEST_F(MalformedCall, Generator) {
  expect_run_error("generator: given together with u1", [](auto& r) { r.mutable_generator()->set_seed(1); });
  const auto generated = [](v1::BatchRequest& r) {
    r.clear_u1(), r.clear_u2(), r.clear_u3();
    r.mutable_generator()->set_seed(1);
  };
  expect_run_error("generator.id: 11 values for 12 lanes", [&](auto& r) {
    generated(r);
    r.mutable_generator()->set_id(std::string(11 * 8, 'x'));
  });
  expect_run_error("generator.id: 12 bytes are not whole values of 8 bytes", [&](auto& r) {
    generated(r);
    r.mutable_generator()->set_id(std::string(12, 'x'));
  });
  expect_run_error("generator: masking takes no random numbers", [&](auto& r) {
    generated(r);
    r.set_operation(v1::MASKING);
    r.clear_outputs();
  });
}

TEST_F(MalformedCall, TooMuch) {
  const auto exhausted = StatusCode::RESOURCE_EXHAUSTED;
  for (const std::uint64_t lanes : {std::uint64_t{kMessageBytes / 4 + 1}, std::uint64_t{1} << 40, ~std::uint64_t{0}})
    expect_run_error("lanes: ", [&](auto& r) { r.set_lanes(lanes); });
  // A small request for a large answer.
  expect_run_error("outputs: ", [](v1::BatchRequest& r) {
    r = good_request(1);
    r.set_lanes(100000);
  });
  v1::BatchRequest large = good_request(kMessageBytes / 8 / 4);
  large.set_u3(floats(1, 0.5f));
  large.clear_outputs();
  EXPECT_TRUE(run(large).ok());
  large.set_u1(floats(kMessageBytes / 4 + 100, 0.5f));
  expect_error(run(large), exhausted, "");  // gRPC's own refusal
}

// A few hundred kilobytes that would be hundreds of megabytes.
TEST_F(MalformedCall, CompressedMessagesAreRefused) {
  for (const auto algorithm : {GRPC_COMPRESS_GZIP, GRPC_COMPRESS_DEFLATE}) {
    grpc::ClientContext context;
    context.set_compression_algorithm(algorithm);
    v1::BatchResponse response;
    v1::BatchRequest request = good_request(3);
    request.set_f0(std::string(std::size_t{200} << 20, 'x'));
    const grpc::Status status = stub_->Run(&context, request, &response);
    expect_error(status, StatusCode::UNIMPLEMENTED, "");
  }
  expect_alive();
}

TEST_F(MalformedCall, MoreMessagesThanACallTakes) {
  grpc::GenericStub generic(channel_);
  grpc::ClientContext context;
  grpc::CompletionQueue queue;
  const auto call = generic.PrepareCall(&context, "/facetwise.v1.Sampler/Run", &queue);
  const auto step = [&](auto&& start) {
    start();
    void* tag = nullptr;
    bool good = false;
    return queue.Next(&tag, &good) && good;
  };
  const std::string bytes = good_request(3).SerializeAsString();
  const grpc::Slice slice(bytes);
  const grpc::ByteBuffer message(&slice, 1);
  ASSERT_TRUE(step([&] { call->StartCall(nullptr); }));
  ASSERT_TRUE(step([&] { call->Write(message, nullptr); }));
  step([&] { call->Write(message, nullptr); });
  step([&] { call->WritesDone(nullptr); });
  grpc::Status status;
  ASSERT_TRUE(step([&] { call->Finish(&status, nullptr); }));
  expect_error(status, StatusCode::INVALID_ARGUMENT, "message: more than one");
}

TEST_F(MalformedCall, Compact) {
  v1::CompactRequest good;
  good.set_lanes(3);
  good.set_status(std::string("\0\1\0", 3));
  good.add_columns(floats(3, 1));
  EXPECT_TRUE(compact(good).ok());
  const auto expect = [&](StatusCode code, const std::string& message, const auto& change) {
    v1::CompactRequest request = good;
    change(request);
    expect_error(compact(request), code, message);
  };
  const auto invalid = StatusCode::INVALID_ARGUMENT;
  expect(invalid, "status: missing", [](auto& r) { r.clear_status(); });
  expect(invalid, "status: 2 values for 3 lanes", [](auto& r) { r.set_status("ab"); });
  expect(invalid, "columns[1]: 2 values for 3 lanes", [](auto& r) { r.add_columns(floats(2, 1)); });
  expect(invalid, "columns[1]: 0 values for 3 lanes", [](auto& r) { r.add_columns(""); });
  expect(invalid, "columns[1]: 7 bytes", [](auto& r) { r.add_columns("1234567"); });
  expect(invalid, "lanes: ", [](auto& r) { r.set_lanes(~0ull); });
  expect(invalid, "columns: more than the limit of 64", [](auto& r) {
    for (int k = 0; k < 64; ++k) r.add_columns(floats(1, 1));
  });
  expect(invalid, "columns: ", [](auto& r) {
    r.set_lanes(kMessageBytes / 8);
    r.set_status(std::string(1, 0));
    r.clear_columns();
    for (int k = 0; k < 60; ++k) r.add_columns(floats(1, 1));
  });
}

// Every way to cut a request short: refused, unless what is left asks for an empty batch.
TEST_F(MalformedCall, TruncatedMessages) {
  const std::string whole = good_request(3).SerializeAsString();
  ASSERT_TRUE(run_bytes("Run", whole).ok());
  int inside_fields = 0;
  for (std::size_t length = 0; length < whole.size(); ++length) {
    const grpc::Status status = run_bytes("Run", whole.substr(0, length));
    v1::BatchRequest parsed;
    const bool whole_fields = parsed.ParseFromString(whole.substr(0, length));
    if (whole_fields && parsed.operation() != 0 && parsed.lanes() == 0) {
      ASSERT_TRUE(status.ok()) << length << ": " << status.error_message();
      continue;
    }
    ASSERT_EQ(status.error_code(), StatusCode::INVALID_ARGUMENT) << length << ": " << status.error_message();
    ASSERT_EQ(status.error_message() == "message: truncated or damaged", !whole_fields)
        << length << ": " << status.error_message();
    inside_fields += !whole_fields;
  }
  EXPECT_GT(inside_fields, 100);
  expect_alive();
}

// The handwritten reader takes what protobuf's own takes, and refuses what it refuses.
TEST_F(MalformedCall, DamagedMessages) {
  const std::string whole = good_request(2).SerializeAsString();
  std::mt19937 random(7);
  int refused = 0, taken = 0;
  for (int round = 0; round < 3000; ++round) {
    std::string bytes = whole;
    for (unsigned k = random() % 3 + 1; k > 0; --k) bytes[random() % bytes.size()] = static_cast<char>(random());
    std::string response;
    const grpc::Status status = run_bytes("Run", bytes, &response);
    if (!status.ok()) {
      ASSERT_TRUE(status.error_code() == StatusCode::INVALID_ARGUMENT ||
                  status.error_code() == StatusCode::RESOURCE_EXHAUSTED)
          << status.error_code() << " " << status.error_message();
      ASSERT_NE(status.error_message().find(": "), std::string::npos) << status.error_message();
    }
    v1::BatchRequest parsed;
    if (!parsed.ParseFromString(bytes)) {
      ASSERT_FALSE(status.ok());
      ++refused;
    } else if (status.ok()) {
      // Read as protobuf reads it: the same answer as for what protobuf made of it.
      std::string same;
      ASSERT_TRUE(run_bytes("Run", parsed.SerializeAsString(), &same).ok());
      ASSERT_EQ(response, same);
      ++taken;
    }
  }
  EXPECT_GT(taken, 300);
  EXPECT_GT(refused, 300);
  for (const char* method : {"Run", "Compact", "Info", "Benchmark"}) {
    SCOPED_TRACE(method);
    for (int round = 0; round < 200; ++round) {
      std::string bytes(random() % 200 + 1, '\0');
      for (char& byte : bytes) byte = static_cast<char>(random());
      run_bytes(method, bytes);
    }
  }
  expect_alive();
}

// What protobuf allows: unknown fields, fields in any order, outputs one by one, a message in two parts.
TEST_F(MalformedCall, UnusualButGoodMessages) {
  const v1::BatchRequest request = good_request(3);
  const std::string whole = request.SerializeAsString();
  EXPECT_TRUE(run_bytes("Run", whole + std::string("\xf8\x07\x05", 3)).ok());      // field 127, varint
  EXPECT_TRUE(run_bytes("Run", std::string("\xfa\x07\x03xyz", 6) + whole).ok());   // field 127, bytes
  EXPECT_TRUE(run_bytes("Run", whole + std::string("\x28\x04\x28\x0a", 4)).ok());  // outputs, unpacked
  EXPECT_TRUE(run_bytes("Run", whole + std::string("\x12\x02\x18\x02", 4)).ok());  // model.shadowing
  v1::BatchRequest first = request, second;
  first.clear_alpha_x();
  first.mutable_incident()->clear_y();
  second.set_alpha_x(request.alpha_x());
  second.mutable_incident()->set_y(request.incident().y());
  EXPECT_TRUE(run_bytes("Run", second.SerializeAsString() + first.SerializeAsString()).ok());
  // Columns are the exception: once only.
  expect_error(run_bytes("Run", whole + second.SerializeAsString()), StatusCode::INVALID_ARGUMENT,
               "incident.y: given twice");
}

// The unspecified sampler is one that the columns allow.
TEST_F(MalformedCall, UnspecifiedSamplerFitsTheColumns) {
  constexpr std::size_t kLanes = 5;
  v1::BatchRequest request = good_request(kLanes);
  request.mutable_model()->set_distribution(v1::BECKMANN);
  request.set_sampler(v1::SAMPLER_UNSPECIFIED);
  for (const bool sloped : {false, true}) {
    if (sloped) request.set_mean_slope_x(floats(kLanes, 0.1f));
    v1::BatchResponse got, expected;
    ASSERT_TRUE(run(request, &got).ok()) << sloped;
    v1::BatchRequest named = request;
    named.set_sampler(sloped ? v1::VISIBLE : v1::EXACT);
    ASSERT_TRUE(run(named, &expected).ok());
    EXPECT_EQ(got.SerializeAsString(), expected.SerializeAsString());
  }
}

TEST_F(MalformedCall, EmptyBatches) {
  for (int operation = v1::SAMPLE_NORMAL; operation <= v1::MASKING; ++operation) {
    v1::BatchRequest request;
    request.set_operation(static_cast<v1::Operation>(operation));
    v1::BatchResponse response;
    const grpc::Status status = run(request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(response.statistics().accepted(), 0u);
  }
  EXPECT_TRUE(compact({}).ok());
}

// Bad lanes are no errors.
TEST_F(MalformedCall, BadLanesGetAStatus) {
  v1::BatchRequest request = good_request(4);
  std::string alpha = floats(4, 0.5f);
  const float values[] = {-1.0f, 1e-5f, NAN};
  alpha.replace(4, 12, reinterpret_cast<const char*>(values), 12);
  request.set_alpha_x(alpha);
  v1::BatchResponse response;
  const grpc::Status status = run(request, &response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response.status(), std::string("\0\3\2\3", 4));
  EXPECT_EQ(response.statistics().accepted(), 1u);
  EXPECT_EQ(response.statistics().smooth(), 1u);
  EXPECT_EQ(response.statistics().invalid(), 2u);
}

// The first malformed request ends the stream with its error, after the answers to those before it.
TEST_F(MalformedCall, InAStream) {
  grpc::ClientContext context;
  const auto stream = stub_->RunStream(&context);
  v1::BatchResponse response;
  for (const std::size_t lanes : {5, 1, 3000}) {
    ASSERT_TRUE(stream->Write(good_request(lanes)));
    ASSERT_TRUE(stream->Read(&response));
    EXPECT_EQ(response.statistics().accepted(), lanes);
  }
  v1::BatchRequest bad = good_request(5);
  bad.clear_alpha_x();
  ASSERT_TRUE(stream->Write(bad));
  EXPECT_FALSE(stream->Read(&response));
  expect_error(stream->Finish(), StatusCode::INVALID_ARGUMENT, "alpha_x: missing");

  grpc::ClientContext compact_context;
  const auto compacting = stub_->CompactStream(&compact_context);
  v1::CompactRequest request;
  request.set_lanes(3);
  request.set_status(std::string("\0\1\0", 3));
  v1::CompactResponse compacted;
  ASSERT_TRUE(compacting->Write(request) && compacting->Read(&compacted));
  EXPECT_EQ(compacted.accepted(), 2u);
  EXPECT_EQ(compacted.index(), std::string("\0\0\0\0\2\0\0\0", 8));
  compacting->WritesDone();
  EXPECT_FALSE(compacting->Read(&compacted));
  EXPECT_TRUE(compacting->Finish().ok());
}

}  // namespace
}  // namespace facetwise
