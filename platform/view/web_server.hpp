// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// HTTP for a few browsers, in one thread and bounded memory: GET alone, no bodies, so many
// connections, so long a request may take, and a fixed number of large replies at a time. Each
// connection has a small room of its own, so whoever takes no bytes keeps nobody else from a reply.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "posix/outcome.hpp"
#include "posix/shared_report.hpp"
#include "view/listen_address.hpp"

struct MHD_Daemon;
struct MHD_Connection;
struct MHD_Response;

namespace tessera {

struct WebServerReport {
  std::uint64_t connections = 0;  ///< That were accepted.
  std::uint64_t requests = 0;     ///< Each once more below if it was refused.
  std::uint64_t refused_method = 0;
  std::uint64_t refused_host = 0;
  std::uint64_t refused_site = 0;  ///< A browser says that a page of elsewhere asks.
  std::uint64_t refused_body = 0;
  std::uint64_t refused_path = 0;  ///< There is nothing of this name, or its arguments are wrong.
  std::uint64_t refused_busy = 0;  ///< It should be tried again.
  std::uint64_t stalled = 0;       ///< Connections that took no byte of a reply for kStall_us.
  std::uint64_t dropped = 0;       ///< These, those that took too long, the oldest of too many.
};

/// What was asked for; of use during the call.
class WebRequest {
 public:
  [[nodiscard]] std::string_view path() const noexcept { return path_; }
  /// Of "?name=value"; none if it is not there.
  [[nodiscard]] std::optional<std::string_view> argument(const char* name) const noexcept;
  /// Room for a reply: kRoomBytes where one of these is free, else the connection's own
  /// kOwnRoomBytes. Once a request.
  [[nodiscard]] std::span<std::byte> room() noexcept;

 private:
  friend class WebServer;
  WebRequest(MHD_Connection* connection, std::string_view path, class WebServer& server)
      : connection_(connection), path_(path), server_(server) {}
  MHD_Connection* connection_;
  std::string_view path_;
  class WebServer& server_;
  struct WebRoom* room_ = nullptr;
};

/// Where a reply is until it is sent.
struct WebRoom {
  std::span<std::byte> bytes;
  bool taken = false;
};

struct WebReply {
  unsigned status = 200;
  const char* type = "text/plain; charset=utf-8";  ///< Static.
  std::string text;                                ///< The body, unless one of these is:
  std::span<const std::byte> lasting;              ///< Outlives the server.
  std::size_t room_bytes = 0;                      ///< Of what room() gave.
};

class WebServer {
 public:
  static constexpr unsigned kMostConnections = 48;
  /// Of a connection: its request's lines and headers, and those of the reply.
  static constexpr std::size_t kConnectionBytes = std::size_t{16} << 10U;
  static constexpr std::size_t kRoomBytes = std::size_t{512} << 10U;
  static constexpr std::size_t kRooms = 4;
  static constexpr std::size_t kOwnRoomBytes = std::size_t{16} << 10U;
  /// From one reply to the end of the next, at most; a page that waits longer connects anew.
  static constexpr std::int64_t kPatience_us = 10'000'000;
  /// Whoever acknowledges no byte of a reply for so long is dropped.
  static constexpr std::int64_t kStall_us = 2'000'000;

  using Handler = std::function<WebReply(WebRequest&)>;

  /// Begins to listen; nothing is answered before serve(). Takes the memory of large replies.
  /// Fails with kFailure iff the system refuses the address.
  static Outcome<std::unique_ptr<WebServer>> open(const ListenAddress& address, Handler handler);
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;
  ~WebServer();

  [[nodiscard]] std::uint16_t port() const noexcept { return port_; }
  /// Answers what there is, and waits for it, timeout_ms at most. For one thread. A connection
  /// takes some heap for its life, kConnectionBytes and little more.
  void serve(int timeout_ms) noexcept;
  /// For any thread.
  [[nodiscard]] WebServerReport report() const noexcept { return shared_report_.load(); }

 private:
  friend class WebRequest;
  friend struct WebCallbacks;
  struct Link {
    int socket = -1;  ///< -1: this place is free.
    std::int64_t since_us = 0;
    bool dropped = false;
    bool replies = false;  ///< The library has not yet sent the whole of a reply.
    std::optional<std::uint64_t> acked_bytes{};
    std::int64_t acked_us = 0;   ///< When that last grew, or the reply began.
    std::int64_t looked_us = 0;  ///< When that was last asked for.
  };

  explicit WebServer(Handler handler);
  [[nodiscard]] int answer(MHD_Connection* connection, std::string_view path,
                           std::string_view method) noexcept;
  [[nodiscard]] WebReply reply_to(WebRequest& request, MHD_Connection* connection,
                                  std::string_view method);
  [[nodiscard]] MHD_Response* response_of(WebReply& reply, WebRequest& request);
  Link* begin(MHD_Connection* connection) noexcept;
  [[nodiscard]] WebRoom* take_room(MHD_Connection* connection) noexcept;
  void drop_late() noexcept;
  void drop_stalled(std::int64_t now_us) noexcept;
  void drop(Link& link) noexcept;

  Handler handler_;
  std::unique_ptr<std::byte[]> room_bytes_;
  std::array<WebRoom, kRooms> rooms_{};
  std::array<Link, kMostConnections> links_{};
  std::array<WebRoom, kMostConnections> own_rooms_{};  ///< Of each link.
  std::uint16_t port_ = 0;
  WebServerReport report_{};
  SharedReport<WebServerReport> shared_report_;
  MHD_Daemon* daemon_ = nullptr;
};

}  // namespace tessera
