// SPDX-License-Identifier: Apache-2.0
// Memory that clients on this machine share with the server: columns that lie there are not sent.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "src/listen.h"
#include "src/log.h"

namespace facetwise {

// Only of processes of the server's own user, or of those named; a memory file that cannot shrink (sealed), so that no access
// fails whatever the client does. A region goes when its client's connection does, and with the last call that uses it.
class SharedRegions {
 public:
  class Region {
   public:
    Region(char* data, std::size_t bytes) : data_(data), bytes_(bytes) {}
    ~Region();
    Region(const Region&) = delete;
    Region& operator=(const Region&) = delete;
    char* data() const { return data_; }
    std::size_t bytes() const { return bytes_; }

   private:
    char* const data_;
    const std::size_t bytes_;
  };

  // `users`: their ids; empty: the server's own.
  SharedRegions(std::size_t max_bytes, std::vector<unsigned> users, Log& log);
  ~SharedRegions();

  // Takes regions at these sockets from now on. Once.
  void listen(std::vector<Socket> sockets);
  // Null: there is none.
  std::shared_ptr<const Region> find(std::uint64_t id) const;
  std::size_t bytes() const;
  std::size_t max_bytes() const { return max_bytes_; }

 private:
  struct Client {
    Socket socket;
    std::uint64_t region = 0;  // 0: it has offered none yet
    std::chrono::steady_clock::time_point since;
  };

  void serve();
  void accept(const Socket& socket);
  // What a client has sent. False: it has gone, or must go.
  bool hear(Client& client);
  // Empty: taken.
  std::string take(int file, std::uint64_t id, std::uint64_t bytes);

  const std::size_t max_bytes_;
  const std::vector<unsigned> users_;
  Log& log_;
  mutable std::mutex mutex_;  // of the following
  std::map<std::uint64_t, std::shared_ptr<const Region>> regions_;
  std::size_t bytes_ = 0;

  std::vector<Socket> sockets_;
  std::vector<Client> clients_;
  const Socket ends_;  // readable: at the end
  std::thread thread_;
};

}  // namespace facetwise
