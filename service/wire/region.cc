// SPDX-License-Identifier: Apache-2.0
#include "wire/region.h"

#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "absl/strings/str_cat.h"

namespace facetwise::wire {

std::optional<ReceivedOffer> receive_offer(int socket) {
  ReceivedOffer received;
  iovec bytes = {&received.offer, sizeof received.offer};
  // Room for more files than one: those must not stay open here either.
  alignas(cmsghdr) char control[CMSG_SPACE(8 * sizeof(int))];
  msghdr message = {};
  message.msg_iov = &bytes;
  message.msg_iovlen = 1;
  message.msg_control = control;
  message.msg_controllen = sizeof control;
  const ssize_t length = recvmsg(socket, &message, MSG_CMSG_CLOEXEC | MSG_DONTWAIT);
  if (length < 0) return std::nullopt;
  bool good = length == sizeof received.offer && received.offer.magic == RegionOffer::kMagic;
  for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr; part = CMSG_NXTHDR(&message, part)) {
    if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_RIGHTS) continue;
    const std::size_t count = (part->cmsg_len - CMSG_LEN(0)) / sizeof(int);
    for (std::size_t k = 0; k < count; ++k) {
      int file;
      std::memcpy(&file, CMSG_DATA(part) + k * sizeof file, sizeof file);
      if (received.file < 0) {
        received.file = file;
      } else {
        close(file);
        good = false;
      }
    }
  }
  if (good) return received;
  if (received.file >= 0) close(received.file);
  return std::nullopt;
}

absl::Status send_offer(int socket, const RegionOffer& offer, int file) {
  iovec bytes = {const_cast<RegionOffer*>(&offer), sizeof offer};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof file)] = {};
  msghdr message = {};
  message.msg_iov = &bytes;
  message.msg_iovlen = 1;
  message.msg_control = control;
  message.msg_controllen = sizeof control;
  cmsghdr* part = CMSG_FIRSTHDR(&message);
  part->cmsg_level = SOL_SOCKET;
  part->cmsg_type = SCM_RIGHTS;
  part->cmsg_len = CMSG_LEN(sizeof file);
  std::memcpy(CMSG_DATA(part), &file, sizeof file);
  ssize_t sent;
  do {
    sent = sendmsg(socket, &message, MSG_NOSIGNAL);
  } while (sent < 0 && errno == EINTR);
  return sent == sizeof offer ? absl::OkStatus() : absl::UnavailableError(std::strerror(errno));
}

}  // namespace facetwise::wire
