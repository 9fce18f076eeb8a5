// SPDX-License-Identifier: Apache-2.0
#include "src/shared_regions.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>

#include "absl/strings/str_cat.h"
#include "wire/region.h"

namespace facetwise {
namespace {

constexpr std::size_t kMostClients = 256;
// A client that has connected and offers nothing for so long is let go.
constexpr std::chrono::seconds kPatience{5};
constexpr int kLookMs = 1000;
constexpr std::chrono::milliseconds kPause{50};

}  // namespace

SharedRegions::Region::~Region() { munmap(data_, bytes_); }

SharedRegions::SharedRegions(std::size_t max_bytes, std::vector<unsigned> users, Log& log)
    : max_bytes_(max_bytes),
      users_(users.empty() ? std::vector<unsigned>{geteuid()} : std::move(users)),
      log_(log),
      ends_(eventfd(0, EFD_CLOEXEC)) {}

SharedRegions::~SharedRegions() {
  if (!thread_.joinable()) return;
  eventfd_write(ends_.file(), 1);
  thread_.join();
}

void SharedRegions::listen(std::vector<Socket> sockets) {
  sockets_ = std::move(sockets);
  thread_ = std::thread([this] { serve(); });
}

std::shared_ptr<const SharedRegions::Region> SharedRegions::find(std::uint64_t id) const {
  const std::lock_guard lock(mutex_);
  const auto found = regions_.find(id);
  return found == regions_.end() ? nullptr : found->second;
}

std::size_t SharedRegions::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

void SharedRegions::serve() {
  for (;;) {
    std::vector<pollfd> files = {{ends_.file(), POLLIN, 0}};
    for (const Client& client : clients_) files.push_back({client.socket.file(), POLLIN, 0});
    if (clients_.size() < kMostClients)
      for (const Socket& socket : sockets_) files.push_back({socket.file(), POLLIN, 0});
    const bool waits_for_offers = std::any_of(clients_.begin(), clients_.end(), [](auto& c) { return c.region == 0; });
    poll(files.data(), files.size(), waits_for_offers ? kLookMs : -1);
    if (files[0].revents != 0) return;
    const auto now = std::chrono::steady_clock::now();
    std::vector<Client> stay;
    for (std::size_t k = 0; k < clients_.size(); ++k) {
      Client& client = clients_[k];
      const bool stays =
          files[k + 1].revents == 0 ? client.region != 0 || now - client.since < kPatience : hear(client);
      if (stays) {
        stay.push_back(std::move(client));
      } else if (client.region != 0) {
        const std::lock_guard lock(mutex_);
        const auto region = regions_.find(client.region);
        bytes_ -= region->second->bytes();
        regions_.erase(region);
      }
    }
    const std::size_t first = 1 + clients_.size();
    clients_ = std::move(stay);
    for (std::size_t k = first; k < files.size(); ++k)
      if (files[k].revents != 0) accept(sockets_[k - first]);
  }
}

void SharedRegions::accept(const Socket& socket) {
  Socket client(accept4(socket.file(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
  if (client.file() < 0) {
    // At the limit of open files the client stays in the system's queue, and would be found there at once.
    std::this_thread::sleep_for(kPause);
    return;
  }
  clients_.push_back({std::move(client), 0, std::chrono::steady_clock::now()});
}

bool SharedRegions::hear(Client& client) {
  const auto received = wire::receive_offer(client.socket.file());
  if (!received) return false;
  const Socket file(received->file);
  ucred peer = {};
  socklen_t size = sizeof peer;
  const bool known = getsockopt(client.socket.file(), SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0;
  std::string refusal;
  if (!known || std::find(users_.begin(), users_.end(), peer.uid) == users_.end())
    refusal = absl::StrCat("the server does not share memory with user ", peer.uid);
  else if (client.region != 0)
    refusal = "one region a connection";
  else
    refusal = take(file.file(), received->offer.id, received->offer.bytes);
  if (refusal.empty())
    client.region = received->offer.id;
  else
    log_.write_some(LogLevel::warning, "shared memory refused",
                    {{"user", peer.uid}, {"process", peer.pid}, {"why", refusal}});
  wire::RegionAnswer answer;
  std::memcpy(answer.refusal, refusal.data(), std::min(refusal.size(), sizeof answer.refusal - 1));
  return send(client.socket.file(), &answer, sizeof answer, MSG_NOSIGNAL) == sizeof answer;
}

std::string SharedRegions::take(int file, std::uint64_t id, std::uint64_t bytes) {
  if (id == 0) return "its id is 0";
  struct stat status;
  if (file < 0 || fstat(file, &status) != 0 || !S_ISREG(status.st_mode)) return "no file of memory came with it";
  // Without this seal the file could shrink, and the next access end the server.
  const int seals = fcntl(file, F_GET_SEALS);
  if (seals < 0 || (seals & F_SEAL_SHRINK) == 0) return "the file of memory is not sealed against shrinking";
  if (bytes == 0 || static_cast<std::uint64_t>(status.st_size) != bytes)
    return absl::StrCat(bytes, " bytes announced, the file has ", status.st_size);
  {
    const std::lock_guard lock(mutex_);
    if (bytes > max_bytes_ - bytes_)
      return absl::StrCat(bytes, " bytes beside ", bytes_, " that are shared are above the limit of ", max_bytes_);
    if (regions_.contains(id)) return "another region has its id";
  }
  void* const memory = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  if (memory == MAP_FAILED) return absl::StrCat("cannot be mapped: ", std::strerror(errno));
  (void)madvise(memory, bytes, MADV_HUGEPAGE);
  const std::lock_guard lock(mutex_);  // only this thread adds
  regions_.emplace(id, std::make_shared<Region>(static_cast<char*>(memory), bytes));
  bytes_ += bytes;
  return "";
}

}  // namespace facetwise
