// SPDX-License-Identifier: Apache-2.0
#include "src/memory_offer.h"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "wire/region.h"
#include "wire/unix_socket.h"

namespace facetwise {
namespace {

constexpr timeval kPatience{5, 0};

}  // namespace

MemoryOffer::MemoryOffer(std::shared_ptr<const SharedMemory> memory, const std::string& address)
    : memory_(std::move(memory)), path_(wire::region_path(address.substr(address.find(':') + 1))) {}

MemoryOffer::~MemoryOffer() {
  if (socket_ >= 0) close(socket_);
}

bool MemoryOffer::has_ended() {
  constexpr int kMoment = 1000;
  const std::lock_guard lock(mutex_);
  pollfd ended = {socket_, POLLIN, 0};
  return socket_ < 0 || poll(&ended, 1, kMoment) > 0;
}

absl::Status MemoryOffer::make() {
  const std::lock_guard lock(mutex_);
  // Nothing comes on it but its end.
  if (pollfd stands = {socket_, POLLIN, 0}; socket_ >= 0 && poll(&stands, 1, 0) == 0) return absl::OkStatus();
  if (socket_ >= 0) close(std::exchange(socket_, -1));
  if (path_.size() > wire::kLongestUnixPath)
    return absl::InvalidArgumentError(absl::StrCat(path_, ": too long a path"));
  const int socket = wire::connect_unix(path_);
  if (socket < 0) return absl::UnavailableError(absl::StrCat(path_, ": ", std::strerror(errno)));
  setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &kPatience, sizeof kPatience);
  wire::RegionAnswer answer;
  absl::Status status = wire::send_offer(socket, {.id = memory_->id(), .bytes = memory_->bytes()}, memory_->file());
  if (status.ok() && recv(socket, &answer, sizeof answer, MSG_WAITALL) != sizeof answer)
    status = absl::UnavailableError(absl::StrCat(path_, ": no answer"));
  if (status.ok() && answer.refusal[0] != 0) {
    answer.refusal[sizeof answer.refusal - 1] = 0;
    status = absl::PermissionDeniedError(absl::StrCat("does not take the shared memory: ", answer.refusal));
  }
  if (status.ok())
    socket_ = socket;
  else
    close(socket);
  return status;
}

}  // namespace facetwise
