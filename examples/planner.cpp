// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A planner as a separate process: queries a running node over LCM about the space ahead of a
// place, with only the two message types of tessera, and liblcm. docs/reference/queries.md has the
// protocol.
//
//     planner URL X Y Z [global]
#include <lcm/lcm.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <tessera_query.hpp>
#include <tessera_reply.hpp>
#include <vector>

namespace {

/// Sends one query at a time and waits for its reply.
class MapClient {
 public:
  explicit MapClient(const char* url) : lcm_(lcm_create(url), &lcm_destroy) {
    if (lcm_ != nullptr) lcm_subscribe(lcm_.get(), "TESSERA_REPLY", &MapClient::hear, this);
    // So that replies to other processes are ignored.
    client_ = static_cast<std::int64_t>(::getpid()) << 32 | (::time(nullptr) & 0x7fffffff);
  }
  [[nodiscard]] bool is_open() const { return lcm_ != nullptr; }

  /// Fills in reply; false iff no reply came in three tries of 200 ms, as datagrams may be lost.
  bool ask(tessera_query query, tessera_reply& reply) {
    query.version = 1;
    query.client = client_;
    query.request = ++request_;
    std::array<std::byte, 512> bytes{};
    const int size = query.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    for (int attempt = 0; attempt < 3; ++attempt) {
      answered_ = false;
      lcm_publish(lcm_.get(), "TESSERA_QUERY", bytes.data(), static_cast<unsigned>(size));
      while (!answered_ && lcm_handle_timeout(lcm_.get(), 200) > 0) {
      }
      if (!answered_) continue;
      reply = reply_;
      return true;
    }
    return false;
  }

 private:
  static void hear(const lcm_recv_buf_t* message, const char*, void* user) {
    auto& self = *static_cast<MapClient*>(user);
    tessera_reply reply{};
    // Only arrays of fixed size: decode() stays within the message.
    if (reply.decode(message->data, 0, static_cast<int>(message->data_size)) < 0) return;
    if (reply.client != self.client_ || reply.request != self.request_) return;
    self.reply_ = reply;
    self.answered_ = true;
  }

  std::unique_ptr<lcm_t, void (*)(lcm_t*)> lcm_;
  std::int64_t client_ = 0;
  std::int32_t request_ = 0;
  tessera_reply reply_{};
  bool answered_ = false;
};

const char* state_of(std::uint8_t cell) {
  const char* const names[] = {"unknown", "free", "occupied", "invalid"};
  return names[cell >> 6U];
}

int fail(const char* what) {
  std::fprintf(stderr, "planner: %s\n", what);
  return EXIT_FAILURE;
}

/// A box of 4 m around the place from above: '#' occupied, '.' free, ' ' unknown.
bool print_around(MapClient& map, tessera_query query) {
  for (int axis = 0; axis < 3; ++axis) {
    const float reach = axis == 2 ? 0.0F : 2.0F;
    query.point[1][axis] = query.point[0][axis] + reach;
    query.point[0][axis] -= reach;
  }
  query.kind = tessera_query::REGION;
  query.cell_voxels = 4;
  query.cursor = 0;
  std::vector<std::uint8_t> cells;
  tessera_reply reply{};
  // Page by page; each reply has the begin of the next.
  do {
    if (!map.ask(query, reply) || reply.error != tessera_reply::OK) return false;
    cells.insert(cells.end(), reply.cell, reply.cell + reply.count);
    query.cursor = reply.next_cursor;
  } while (reply.next_cursor >= 0 && cells.size() < 4096);
  std::printf("around     %d x %d cells of %.2f m\n", reply.size_cells[0], reply.size_cells[1],
              4 * reply.resolution_m);
  const auto columns = static_cast<std::size_t>(reply.size_cells[0]);
  const auto rows = static_cast<std::size_t>(reply.size_cells[1]);
  for (std::size_t row = rows; row-- > 0;) {
    for (std::size_t column = 0; column < columns && row * columns + column < cells.size();
         ++column)
      std::putchar(" .#?"[cells[row * columns + column] >> 6U]);
    std::putchar('\n');
  }
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) return fail("usage: planner URL X Y Z [global]");
  MapClient map(argv[1]);
  if (!map.is_open()) return fail("cannot use that URL");
  tessera_query query{};
  const bool is_global = argc > 5 && std::strcmp(argv[5], "global") == 0;
  query.map = tessera_query::LOCAL;
  if (is_global) query.map = tessera_query::GLOBAL;
  for (int axis = 0; axis < 3; ++axis) query.point[0][axis] = std::strtof(argv[2 + axis], nullptr);

  tessera_reply reply{};
  query.kind = tessera_query::POINTS;
  query.count = 1;
  if (!map.ask(query, reply)) return fail("no node answers; is it running, with this URL?");
  if (reply.error != tessera_reply::OK) {
    std::fprintf(stderr, "planner: the node answers with error %d\n", reply.error);
    return EXIT_FAILURE;
  }
  std::printf("here       %s, label %d\n", state_of(reply.cell[0]), reply.cell[0] & 63);

  query.kind = tessera_query::NEAREST;
  query.length_m = 5.0;
  if (!map.ask(query, reply) || reply.error != tessera_reply::OK) return fail("no answer");
  if ((reply.flags & tessera_reply::FOUND) != 0) {
    std::printf("nearest    label %d, %.2f m away\n", reply.cell[0] & 63,
                static_cast<double>(reply.distance_m));
  } else {
    std::printf("nearest    nothing within %.2f m\n", static_cast<double>(reply.searched_m));
  }

  query.kind = tessera_query::RAY;
  query.point[1][0] = 1.0F;  // Along x.
  query.length_m = 20.0;
  query.flags = tessera_query::STOP_AT_UNKNOWN;  // Unknown space is not free.
  if (!map.ask(query, reply) || reply.error != tessera_reply::OK) return fail("no answer");
  const char* const end = (reply.flags & tessera_reply::FOUND) != 0        ? "an obstacle after"
                          : (reply.flags & tessera_reply::AT_UNKNOWN) != 0 ? "not known beyond"
                                                                           : "free up to";
  std::printf("ahead      %s %.2f m\n", end, static_cast<double>(reply.distance_m));
  return print_around(map, query) ? EXIT_SUCCESS : fail("no answer");
}
