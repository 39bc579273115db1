// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "view/web_server.hpp"

#include <linux/tcp.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <exception>
#include <utility>

#include "base/monotonic_clock.hpp"

namespace tessera {

namespace {

/// The page loads nothing from other origins, and other origins may not embed it.
constexpr std::pair<const char*, const char*> kHeaders[] = {
    {"Content-Security-Policy",
     "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' "
     "data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"},
    {"X-Content-Type-Options", "nosniff"},
    {"Cross-Origin-Resource-Policy", "same-origin"},
    {"Cross-Origin-Opener-Policy", "same-origin"},
    {"Referrer-Policy", "no-referrer"},
    {"Cache-Control", "no-store"},
};

WebReply refusal(unsigned status, const char* why) {
  WebReply reply;
  reply.status = status;
  reply.text = std::string(why) + "\n";
  return reply;
}

const char* header_of(MHD_Connection* connection, const char* name) {
  return ::MHD_lookup_connection_value(connection, MHD_HEADER_KIND, name);
}

/// Set by browsers, not by pages. "same-site" is another port of this machine: the page of another
/// program. "none": typed, or from a bookmark.
bool is_own_site(const char* fetch_site) {
  const std::string_view site(fetch_site == nullptr ? "none" : fetch_site);
  return site == "same-origin" || site == "none";
}

/// Bytes of all replies that the peer has acknowledged; none if the system does not report it.
std::optional<std::uint64_t> acked_bytes_of(int socket) noexcept {
  tcp_info info{};
  socklen_t size = sizeof info;
  constexpr std::size_t kNeeded = offsetof(tcp_info, tcpi_bytes_acked) + sizeof(__u64);
  const int error = ::getsockopt(socket, IPPROTO_TCP, TCP_INFO, &info, &size);
  return error == 0 && size >= kNeeded ? std::optional<std::uint64_t>(info.tcpi_bytes_acked)
                                       : std::nullopt;
}

void* link_of(MHD_Connection* connection) noexcept {
  const MHD_ConnectionInfo* const info =
      ::MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
  return info == nullptr ? nullptr : info->socket_context;
}

}  // namespace

/// Callback of the library.
struct WebCallbacks {
  static MHD_Result answer(void* server, MHD_Connection* connection, const char* url,
                           const char* method, const char*, const char*, std::size_t*,
                           void** state) noexcept {
    // The first call is only for the headers; a reply to it ends the connection, which is right if
    // a body follows.
    const bool has_body = header_of(connection, MHD_HTTP_HEADER_CONTENT_LENGTH) != nullptr ||
                          header_of(connection, MHD_HTTP_HEADER_TRANSFER_ENCODING) != nullptr;
    if (*state == nullptr && !has_body) {
      *state = server;
      return MHD_YES;
    }
    return static_cast<MHD_Result>(
        static_cast<WebServer*>(server)->answer(connection, url, method));
  }
  static void connection(void* server, MHD_Connection* connection, void** link,
                         MHD_ConnectionNotificationCode what) noexcept {
    if (what == MHD_CONNECTION_NOTIFY_STARTED) {
      *link = static_cast<WebServer*>(server)->begin(connection);
    } else if (*link != nullptr) {
      *static_cast<WebServer::Link*>(*link) = {};
    }
  }
  static void completed(void*, MHD_Connection* connection, void**,
                        MHD_RequestTerminationCode) noexcept {
    auto* const link = static_cast<WebServer::Link*>(link_of(connection));
    if (link == nullptr) return;
    link->since_us = MonotonicClock::now_us();
    link->replies = false;
  }
  static void give_back(void* room) noexcept { static_cast<WebRoom*>(room)->taken = false; }
};

std::optional<std::string_view> WebRequest::argument(const char* name) const noexcept {
  const char* const value = ::MHD_lookup_connection_value(connection_, MHD_GET_ARGUMENT_KIND, name);
  return value == nullptr ? std::nullopt : std::optional<std::string_view>(value);
}

std::span<std::byte> WebRequest::room() noexcept {
  room_ = server_.take_room(connection_);
  return room_ == nullptr ? std::span<std::byte>() : room_->bytes;
}

WebServer::WebServer(Handler handler)
    : handler_(std::move(handler)),
      room_bytes_(
          std::make_unique<std::byte[]>(kRooms * kRoomBytes + kMostConnections * kOwnRoomBytes)) {
  const std::span<std::byte> all(room_bytes_.get(), kRooms * kRoomBytes);
  for (std::size_t i = 0; i < kRooms; ++i)
    rooms_[i].bytes = all.subspan(i * kRoomBytes, kRoomBytes);
  for (std::size_t i = 0; i < kMostConnections; ++i)
    own_rooms_[i].bytes = {all.data() + all.size() + i * kOwnRoomBytes, kOwnRoomBytes};
}

/// A connection has one reply at a time: the library reads its next request when that is sent.
WebRoom* WebServer::take_room(MHD_Connection* connection) noexcept {
  const auto* const link = static_cast<const Link*>(link_of(connection));
  const auto free = std::ranges::find(rooms_, false, &WebRoom::taken);
  WebRoom* room = free == rooms_.end() ? nullptr : &*free;
  if (room == nullptr && link != nullptr)
    room = &own_rooms_[static_cast<std::size_t>(link - links_.data())];
  if (room == nullptr || room->taken) return nullptr;
  room->taken = true;
  return room;
}

WebServer::~WebServer() {
  if (daemon_ != nullptr) ::MHD_stop_daemon(daemon_);
}

Outcome<std::unique_ptr<WebServer>> WebServer::open(const ListenAddress& address, Handler handler) {
  std::unique_ptr<WebServer> server(new WebServer(std::move(handler)));
  const unsigned flags =
      MHD_USE_EPOLL | (address.is_ipv6() ? static_cast<unsigned>(MHD_USE_IPv6) : 0U);
  constexpr unsigned kPatience_s = kPatience_us / 1'000'000;
  errno = 0;
  server->daemon_ = ::MHD_start_daemon(
      flags, 0, nullptr, nullptr, &WebCallbacks::answer, server.get(), MHD_OPTION_SOCK_ADDR,
      reinterpret_cast<const sockaddr*>(&address.socket), MHD_OPTION_CONNECTION_LIMIT,
      kMostConnections, MHD_OPTION_CONNECTION_MEMORY_LIMIT, kConnectionBytes,
      MHD_OPTION_CONNECTION_TIMEOUT, kPatience_s, MHD_OPTION_NOTIFY_CONNECTION,
      &WebCallbacks::connection, server.get(), MHD_OPTION_NOTIFY_COMPLETED,
      &WebCallbacks::completed, nullptr, MHD_OPTION_END);
  if (server->daemon_ == nullptr) {
    return Failure{"cannot serve at " + address.url(address.port) + ": " + std::strerror(errno) +
                       "; give another address or port, or port 0 for any free one",
                   FailureKind::kFailure};
  }
  const MHD_DaemonInfo* const info =
      ::MHD_get_daemon_info(server->daemon_, MHD_DAEMON_INFO_BIND_PORT);
  server->port_ = info == nullptr ? address.port : info->port;
  return server;
}

void WebServer::serve(int timeout_ms) noexcept {
  static_cast<void>(::MHD_run_wait(daemon_, timeout_ms));
  drop_late();
  shared_report_.store(report_);
}

WebServer::Link* WebServer::begin(MHD_Connection* connection) noexcept {
  ++report_.connections;
  const MHD_ConnectionInfo* const info =
      ::MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
  for (Link& link : links_) {
    if (link.socket >= 0 || info == nullptr) continue;
    link = {.socket = info->connect_fd, .since_us = MonotonicClock::now_us()};
    return &link;
  }
  return nullptr;
}

/// A connection that sends or takes single bytes counts as late too. If nearly all places are
/// taken, the one that is without a reply for longest is closed, so that others can connect.
void WebServer::drop_late() noexcept {
  constexpr std::ptrdiff_t kSpare = 8;
  const std::int64_t now_us = MonotonicClock::now_us();
  const auto waits = [](const Link& link) { return link.socket >= 0 && !link.dropped; };
  for (Link& link : links_) {
    if (waits(link) && now_us - link.since_us > kPatience_us) drop(link);
  }
  drop_stalled(now_us);
  if (std::count_if(links_.begin(), links_.end(), waits) + kSpare <=
      static_cast<std::ptrdiff_t>(kMostConnections))
    return;
  Link* oldest = nullptr;
  for (Link& link : links_) {
    if (waits(link) && (oldest == nullptr || link.since_us < oldest->since_us)) oldest = &link;
  }
  drop(*oldest);
}

void WebServer::drop_stalled(std::int64_t now_us) noexcept {
  constexpr std::int64_t kLook_us = kStall_us / 8;
  for (Link& link : links_) {
    if (link.socket < 0 || link.dropped || !link.replies || now_us - link.looked_us < kLook_us)
      continue;
    link.looked_us = now_us;
    const std::optional<std::uint64_t> acked_bytes = acked_bytes_of(link.socket);
    if (acked_bytes != link.acked_bytes || !acked_bytes) {
      link.acked_bytes = acked_bytes;
      link.acked_us = now_us;
    } else if (now_us - link.acked_us >= kStall_us) {
      ++report_.stalled;
      drop(link);
    }
  }
}

void WebServer::drop(Link& link) noexcept {
  link.dropped = true;
  ++report_.dropped;
  ::shutdown(link.socket, SHUT_RDWR);
}

WebReply WebServer::reply_to(WebRequest& request, MHD_Connection* connection,
                             std::string_view method) {
  // The library omits the body of a reply to HEAD.
  if (method != "GET" && method != "HEAD") {
    ++report_.refused_method;
    return refusal(MHD_HTTP_METHOD_NOT_ALLOWED, "only GET is supported");
  }
  if (header_of(connection, MHD_HTTP_HEADER_CONTENT_LENGTH) != nullptr ||
      header_of(connection, MHD_HTTP_HEADER_TRANSFER_ENCODING) != nullptr) {
    ++report_.refused_body;
    return refusal(MHD_HTTP_CONTENT_TOO_LARGE, "a request must not have a body");
  }
  const char* const host = header_of(connection, MHD_HTTP_HEADER_HOST);
  if (host == nullptr || !is_trusted_host(host)) {
    ++report_.refused_host;
    return refusal(MHD_HTTP_FORBIDDEN,
                   "this page is served only by address: open it by its numbers, or as localhost");
  }
  if (!is_own_site(header_of(connection, "Sec-Fetch-Site"))) {
    ++report_.refused_site;
    return refusal(
        MHD_HTTP_FORBIDDEN,
        "requests from other sites are refused: type the address instead of following a link");
  }
  return handler_(request);
}

MHD_Response* WebServer::response_of(WebReply& reply, WebRequest& request) {
  if (request.room_ != nullptr && reply.room_bytes > 0) {
    MHD_Response* const response = ::MHD_create_response_from_buffer_with_free_callback_cls(
        reply.room_bytes, request.room_->bytes.data(), &WebCallbacks::give_back, request.room_);
    if (response != nullptr) request.room_ = nullptr;
    return response;
  }
  // The library's functions do not change what these pointers refer to.
  if (!reply.lasting.empty()) {
    return ::MHD_create_response_from_buffer(
        reply.lasting.size(), const_cast<std::byte*>(reply.lasting.data()), MHD_RESPMEM_PERSISTENT);
  }
  return ::MHD_create_response_from_buffer(reply.text.size(), reply.text.data(),
                                           MHD_RESPMEM_MUST_COPY);
}

int WebServer::answer(MHD_Connection* connection, std::string_view path,
                      std::string_view method) noexcept {
  ++report_.requests;
  WebRequest request(connection, path, *this);
  int queued = MHD_NO;
  try {
    WebReply reply = reply_to(request, connection, method);
    report_.refused_path +=
        reply.status == MHD_HTTP_NOT_FOUND || reply.status == MHD_HTTP_BAD_REQUEST ? 1 : 0;
    report_.refused_busy += reply.status == MHD_HTTP_SERVICE_UNAVAILABLE ? 1 : 0;
    MHD_Response* const response = response_of(reply, request);
    if (response != nullptr) {
      for (const auto& [name, value] : kHeaders) ::MHD_add_response_header(response, name, value);
      ::MHD_add_response_header(response, MHD_HTTP_HEADER_CONTENT_TYPE, reply.type);
      if (reply.status == MHD_HTTP_METHOD_NOT_ALLOWED)
        ::MHD_add_response_header(response, MHD_HTTP_HEADER_ALLOW, "GET");
      queued = ::MHD_queue_response(connection, reply.status, response);
      ::MHD_destroy_response(response);
    }
  } catch (const std::exception&) {
    queued = MHD_NO;  // No memory: the connection ends.
  }
  if (request.room_ != nullptr) request.room_->taken = false;
  if (auto* const link = static_cast<Link*>(link_of(connection)); link != nullptr) {
    link->replies = queued == MHD_YES;
    link->acked_us = link->looked_us = MonotonicClock::now_us();
  }
  return queued;
}

}  // namespace tessera
