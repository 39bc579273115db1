// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// HTTP for a few browsers, in one thread and bounded memory: only GET, no bodies, limits for the
// number of connections, the time of a request and the number of large replies. Each connection has
// its own small buffer, so that a stalled one does not block others.
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

#include "base/outcome.hpp"
#include "base/shared_report.hpp"
#include "tessera/base/counters.hpp"
#include "view/listen_address.hpp"

struct MHD_Daemon;
struct MHD_Connection;
struct MHD_Response;

namespace tessera {

#define TESSERA_WEB_COUNTERS(ROW)                                                     \
  ROW(COUNTER, uint64_t, connections, "Connections accepted.")                        \
  ROW(COUNTER, uint64_t, requests, "Requests; refused ones are also counted below.")  \
  ROW(COUNTER, uint64_t, refused_method, "Another method than GET.")                  \
  ROW(COUNTER, uint64_t, refused_host, "Another host than the one that is served.")   \
  ROW(COUNTER, uint64_t, refused_site, "From another site, by the browser's header.") \
  ROW(COUNTER, uint64_t, refused_body, "With a body.")                                \
  ROW(COUNTER, uint64_t, refused_path, "Unknown name, or invalid arguments.")         \
  ROW(COUNTER, uint64_t, refused_busy, "Should be tried again.")                      \
  ROW(COUNTER, uint64_t, stalled,                                                     \
      "Connections that acknowledged no byte of a reply for kStall_us.")              \
  ROW(COUNTER, uint64_t, dropped, "These, those that took too long, and the oldest of too many.")

struct WebServerReport {
  TESSERA_WEB_COUNTERS(TESSERA_COUNTER_MEMBER)
};
TESSERA_COUNTER_TABLE(WebServerReport, TESSERA_WEB_COUNTERS(TESSERA_COUNTER_ROW))

/// A request; valid during the call.
class WebRequest {
 public:
  [[nodiscard]] std::string_view path() const noexcept { return path_; }
  /// The value of "?name=value"; none if it is missing.
  [[nodiscard]] std::optional<std::string_view> argument(const char* name) const noexcept;
  /// Memory for a reply: kRoomBytes if one of these is free, else the connection's own
  /// kOwnRoomBytes. Once per request.
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

/// Memory of a reply until it is sent.
struct WebRoom {
  std::span<std::byte> bytes;
  bool taken = false;
};

struct WebReply {
  unsigned status = 200;
  const char* type = "text/plain; charset=utf-8";  ///< Static.
  std::string text;                                ///< The body, unless one of these is:
  std::span<const std::byte> lasting;              ///< Must outlive the server.
  std::size_t room_bytes = 0;                      ///< Bytes in the memory of room().
};

class WebServer {
 public:
  static constexpr unsigned kMostConnections = 48;
  /// Memory of a connection: lines and headers of its request and of the reply.
  static constexpr std::size_t kConnectionBytes = std::size_t{16} << 10U;
  static constexpr std::size_t kRoomBytes = std::size_t{512} << 10U;
  static constexpr std::size_t kRooms = 4;
  static constexpr std::size_t kOwnRoomBytes = std::size_t{16} << 10U;
  /// Longest time from one reply to the end of the next; a page that waits longer connects again.
  static constexpr std::int64_t kPatience_us = 10'000'000;
  /// A connection that acknowledges no byte of a reply for this time is closed.
  static constexpr std::int64_t kStall_us = 2'000'000;

  using Handler = std::function<WebReply(WebRequest&)>;

  /// Starts to listen; nothing is answered before serve(). Allocates the memory of large replies.
  /// Fails with kFailure iff the system refuses the address.
  static Outcome<std::unique_ptr<WebServer>> open(const ListenAddress& address, Handler handler);
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;
  ~WebServer();

  [[nodiscard]] std::uint16_t port() const noexcept { return port_; }
  /// Waits for requests, at most timeout_ms, and answers them. For one thread. A connection uses
  /// some heap, kConnectionBytes and little more.
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
    bool replies = false;  ///< The library has not yet sent the whole reply.
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
