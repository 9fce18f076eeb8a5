// SPDX-License-Identifier: Apache-2.0
// Memory that a client shares with a server on the same machine: how it is handed over. The server takes it on a Unix socket of
// its own, beside the one for calls; the region is the server's as long as that connection stands.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"

namespace facetwise::wire {

inline std::string region_path(const std::string& path) { return path + ".memory"; }

// What the client sends, with the file of the memory.
struct RegionOffer {
  static constexpr std::uint64_t kMagic = 0x31'67'65'72'77'66'01'00;
  std::uint64_t magic = kMagic;
  std::uint64_t id = 0;  // random, of the client's choice: calls name the memory by it
  std::uint64_t bytes = 0;
};
// The server's answer: why it does not take it, or nothing.
struct RegionAnswer {
  char refusal[192] = {};
};

// On a socket that does not block. -1: the offer came without a file, which is then the caller's.
struct ReceivedOffer {
  RegionOffer offer;
  int file = -1;
};
// Nothing: the connection has ended, or what came is no offer.
std::optional<ReceivedOffer> receive_offer(int socket);
// On a socket that blocks. Unavailable: the connection is lost.
absl::Status send_offer(int socket, const RegionOffer& offer, int file);

}  // namespace facetwise::wire
