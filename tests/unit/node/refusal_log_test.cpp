// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Lines about what is refused: of what lasts, once a minute, with its counter's name.
#include "node/refusal_log.hpp"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <string>
#include <vector>

namespace tessera {
namespace {

constexpr std::int64_t kSecond_us = 1'000'000;

/// A log that is read as text, and the counters that it is about.
class Watched {
 public:
  Watched() = default;
  ~Watched() {
    ::close(pipe_[0]);
    ::close(pipe_[1]);
  }
  Watched(const Watched&) = delete;
  Watched& operator=(const Watched&) = delete;

  /// What is said at this second of the run.
  std::string look(std::int64_t second) {
    refusals_.look({link, exchange, statuses, table, global_map, floors_refused},
                   second * kSecond_us, log_);
    LogQueue* const queues[] = {&log_};
    const std::uint64_t before = writer_.lines();
    writer_.write(queues);
    if (writer_.lines() == before) return "";
    std::string text(4096, '\0');
    const ssize_t bytes = ::read(pipe_[0], text.data(), text.size());
    REQUIRE(bytes > 0);
    text.resize(static_cast<std::size_t>(bytes));
    return text;
  }

  LinkReport link{};
  ExchangeReport exchange{};
  SideReport statuses{};
  StatusTableReport table{};
  GlobalMapReport global_map{};
  std::uint64_t floors_refused = 0;

 private:
  static std::array<int, 2> new_pipe() {
    std::array<int, 2> ends{};
    REQUIRE(::pipe(ends.data()) == 0);
    return ends;
  }
  const std::array<int, 2> pipe_ = new_pipe();
  LogQueue log_{"node"};
  RefusalLog refusals_;
  LogWriter writer_{pipe_[1], false};
};

TEST_CASE("RefusalLog: a refusal that lasts is a line at its second second, then each minute") {
  Watched watched;
  std::vector<std::int64_t> said;
  for (std::int64_t second = 100; second < 300; ++second) {
    watched.link.refused_tag += 50;
    const std::string line = watched.look(second);
    if (line.empty()) continue;
    said.push_back(second);
    CHECK(line.find("node: warning: link refused_tag: ") == 0);
    CHECK(line.find(said.size() == 1 ? " 100 datagrams" : " 3000 datagrams") != std::string::npos);
  }
  CHECK(said == std::vector<std::int64_t>{101, 161, 221, 281});
}

TEST_CASE("RefusalLog: what happens once in a while is no line") {
  Watched watched;
  for (std::int64_t second = 100; second < 1000; ++second) {
    watched.link.queue_full += second % 61 == 0 ? 1U : 0U;
    CHECK(watched.look(second).empty());
  }
}

TEST_CASE("RefusalLog: counters are told each by itself") {
  Watched watched;
  std::string said;
  for (std::int64_t second = 100; second < 103; ++second) {
    ++watched.link.kernel_dropped;
    ++watched.link.queue_full;
    ++watched.link.fragments;
    ++watched.link.refused_mission;
    ++watched.exchange.refused_contributions;
    ++watched.exchange.records_refused;
    ++watched.statuses.refused_tag;
    ++watched.table.refused_places;
    ++watched.global_map.refused_blocks;
    ++watched.global_map.refused_outputs;
    ++watched.global_map.refused_sums;
    ++watched.global_map.refused_tallies;
    ++watched.global_map.torn_blocks;
    ++watched.floors_refused;
    said += watched.look(second);
  }
  for (const char* name :
       {"link kernel_dropped: 2 ", "link queue_full: 2 ", "fragments", "link refused_mission: 2 ",
        "exchange refused_contributions: 2 ", "exchange records_refused: 2 ",
        "status refused_tag: 2 ", "status refused_places: 2 ", "global_map refused_blocks: 2 ",
        "global_map refused_outputs: 2 ", "global_map refused_sums: 2 ",
        "global_map refused_tallies: 2 ", "global_map torn_blocks: 2 ", "state floors_refused: 2 "})
    CHECK(said.find(name) != std::string::npos);
}

TEST_CASE("RefusalLog: a single conflict and a single twin are an error line at once") {
  Watched watched;
  CHECK(watched.look(100).empty());
  ++watched.exchange.conflicts;
  CHECK(watched.look(101).find("node: error: exchange conflicts: 1 contents") == 0);
  ++watched.exchange.twins;
  CHECK(watched.look(102).find("node: error: exchange twins: 1 times") == 0);
  for (std::int64_t second = 103; second < 1000; ++second) CHECK(watched.look(second).empty());
}

TEST_CASE("RefusalLog: conflicts that go on are a line a minute, and none of them is left out") {
  Watched watched;
  std::vector<std::int64_t> said;
  for (std::int64_t second = 100; second < 400; ++second) {
    // The last of them in the minute after a line, and then no more.
    if (second <= 170) ++watched.exchange.conflicts;
    const std::string line = watched.look(second);
    if (line.empty()) continue;
    said.push_back(second);
    CHECK(line.find(said.size() == 1   ? ": 1 contents"
                    : said.size() == 2 ? ": 60 contents"
                                       : ": 10 contents") != std::string::npos);
  }
  CHECK(said == std::vector<std::int64_t>{100, 160, 220});
}

}  // namespace
}  // namespace tessera
