// SPDX-License-Identifier: Apache-2.0
// Answers one message as the server does, within small limits.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "facetwise/albedo_table.h"
#include "facetwise/batch.h"
#include "facetwise/shared_memory.h"
#include "src/answer.h"
#include "src/listen.h"
#include "wire/region.h"
#include "wire/unix_socket.h"

namespace facetwise::fuzz {

inline constexpr std::size_t kMessageBytes = std::size_t{1} << 16;

// Small tables of albedo, which else take seconds each.
inline void make_albedo_tables() {
  for (Model model : all_models())
    for (const Shadowing shadowing : {Shadowing::correlated, Shadowing::uncorrelated}) {
      model.shadowing = shadowing;
      AlbedoTable::Options options;
      options.sizes = {2, 2, 2, 2, 2, 2};
      options.dielectric_sizes = {2, 2, 0, 0, 0, 0, 3};
      options.samples = 2;
      for (const Interface interface : {Interface::conductor, Interface::dielectric}) {
        model.interface = interface;
        if (auto table = AlbedoTable::build(model, options); table.ok()) use_albedo_table(*table);
      }
    }
}

// Memory that a client shares, named 7 in the corpus: handed over as a client does.
inline const SharedRegions& regions(Log& log) {
  static SharedRegions regions(std::size_t{1} << 20, {}, log);
  static const bool ready = [] {
    char folder[] = "/tmp/facetwise-fuzz-XXXXXX";
    const std::string path = std::string(mkdtemp(folder)) + "/memory";
    regions.listen(std::move(listen_on("unix:" + path, 0600)->sockets));
    static const auto memory = *SharedMemory::make(kMessageBytes);
    const int socket = wire::connect_unix(path);
    wire::RegionAnswer answer;
    if (!wire::send_offer(socket, {.id = 7, .bytes = memory->bytes()}, memory->file()).ok() ||
        recv(socket, &answer, sizeof answer, MSG_WAITALL) != sizeof answer || answer.refusal[0] != 0)
      std::abort();
    unlink(path.c_str());
    rmdir(folder);
    return true;
  }();
  if (!ready) std::abort();
  return regions;
}

template <class Answer>
void answer(Answer answer, const std::uint8_t* data, std::size_t size) {
  static Compute compute(1, {});
  static Tables tables(0, {});
  static Metrics metrics({}, [] { return v1::ServerLoad(); });
  static Log log(LogFormat::none, LogLevel::warning);
  static const std::atomic<bool> stop{false};
  static Admission admission({8, 8, 64 * kMessageBytes, kMessageBytes, std::chrono::milliseconds(1000)});
  static const bool ready = [] {
    make_albedo_tables();
    return true;
  }();
  if (!ready || size > kMessageBytes) return;
  // In slices of uneven sizes, as they come from a network.
  std::vector<grpc::Slice> slices;
  for (std::size_t begin = 0, length = 1; begin < size; begin += length, length = length * 5 % 1021 + 1) {
    length = std::min(length, size - begin);
    slices.emplace_back(data + begin, length);
  }
  grpc::ByteBuffer request(slices.data(), slices.size());
  Admission::Stay stay(
      admission, [] {}, "");
  CallFacts facts;
  const CallTools tools{{kMessageBytes}, compute, tables, regions(log), stay, stop, metrics, facts};
  const auto answered = wait_for(answer(request, tools));
  // What is too much or malformed is refused; nothing else goes wrong.
  if (!answered.ok() && answered.status().code() != absl::StatusCode::kInvalidArgument &&
      answered.status().code() != absl::StatusCode::kResourceExhausted &&
      answered.status().code() != absl::StatusCode::kNotFound &&
      answered.status().code() != absl::StatusCode::kUnimplemented)
    std::abort();
  if (answered.ok() && answered->Length() > 2 * kMessageBytes) std::abort();
}

}  // namespace facetwise::fuzz
