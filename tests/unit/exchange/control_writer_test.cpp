// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is sent beside evidence, and when: announcements, frames and statements.
#include "tessera/exchange/internal/control_writer.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <map>
#include <optional>
#include <tuple>

#include "exchange_rig.hpp"

namespace tessera {
namespace {

constexpr std::int64_t kStart_ms = 1'000'000;

/// A robot that publishes, and the writer that is looked at.
struct Bench {
  Bench() : Bench(ExchangeRig::config_of(1)) {}
  explicit Bench(const ExchangeConfig& config)
      : rig(config), memory(ControlWriter::required_bytes(rig.config)) {
    Arena arena = memory.arena();
    control = *ControlWriter::make(arena, rig.config);
    own = &rig.open_own();
  }
  /// What is written at that time, if anything is.
  std::optional<DatagramKind> write(std::int64_t ms) {
    body.assign(kMostBodyBytes, std::byte{0});
    ByteWriter to(body);
    Outgoing out = rig.outgoing(at_ms(kStart_ms + ms));
    if (!control.write(out, to)) return std::nullopt;
    body.resize(to.size());
    asker.reset();
    if (out.for_asker) asker = out.asker;
    return out.kind;
  }
  /// Writes until nothing is due; how many of a kind there were.
  int count(DatagramKind kind, std::int64_t ms) {
    int found = 0;
    while (const std::optional<DatagramKind> next = write(ms)) found += *next == kind ? 1 : 0;
    return found;
  }

  ExchangeRig rig;
  AlignedMemory memory;
  ControlWriter control;
  const HeldContribution* own = nullptr;
  std::vector<std::byte> body;
  std::optional<std::uint32_t> asker;  ///< Who pays for it.
};

/// A robot with so many submaps, and what it has heard of two others.
struct ManyFrames : Bench {
  explicit ManyFrames(std::uint32_t submaps) : Bench(config_of(submaps)) {
    ExchangeReport& counted = rig.counted;
    for (std::uint32_t submap = 1; submap < submaps; ++submap)
      REQUIRE(rig.ledger.open(1, submap, Matrix34d::Identity(), counted) == Status::kOk);
    for (const std::uint32_t robot : {7U, 8U}) {
      for (std::uint32_t submap = 0; submap < 3; ++submap)
        REQUIRE(rig.ledger.take_frame({.id = {robot, 1, submap}, .revision = 1}, {}, true,
                                      at_ms(kStart_ms), counted));
    }
    count(DatagramKind::kFrame, 0);
  }
  static ExchangeConfig config_of(std::uint32_t submaps) {
    ExchangeConfig config = ExchangeRig::config_of(1);
    config.contributions = submaps + 10;
    config.own_contributions = submaps;
    return config;
  }
  void owe(const ContributionId& id, std::int64_t ms,
           const std::optional<ControlWriter::Asker>& by = {}) {
    control.owe_frame(rig.ledger, *rig.ledger.find(id), at_ms(kStart_ms + ms), by);
  }
  /// A datagram of frames: whose, how many, and who pays.
  struct Sent {
    std::uint32_t robot;
    bool relayed;
    std::size_t frames;
    std::optional<std::uint32_t> asker;
    friend bool operator==(const Sent&, const Sent&) = default;
  };
  std::vector<Sent> sent(std::int64_t ms) {
    std::vector<Sent> all;
    while (const std::optional<DatagramKind> next = write(ms)) {
      if (*next != DatagramKind::kFrame) continue;
      ByteReader from(body);
      FramesHeader header;
      REQUIRE(read_frames_header(from, header));
      all.push_back({header.robot, header.relayed, frames_of(body).size(), asker});
    }
    std::stable_sort(all.begin(), all.end(), [](const Sent& a, const Sent& b) {
      return std::tie(a.robot, a.relayed, a.asker) < std::tie(b.robot, b.relayed, b.asker);
    });
    return all;
  }
};

TEST_CASE("ControlWriter: a new contribution's frame goes first, then its statement, then names") {
  Bench bench;
  bench.control.begin_own(bench.rig.ledger);
  CHECK(bench.write(0) == DatagramKind::kFrame);
  const std::vector<FrameBody> frames = frames_of(bench.body);
  REQUIRE(frames.size() == 1);
  CHECK(frames[0].id == bench.own->id);
  CHECK(bench.write(0) == DatagramKind::kStatement);
  ByteReader statement_bytes(bench.body);
  Statement statement;
  REQUIRE(read_statement(statement_bytes, statement));
  CHECK(statement.id == bench.own->id);
  CHECK(bench.write(0) == DatagramKind::kAnnounce);
  CHECK(bench.rig.counted.frames == 1);
  CHECK(bench.rig.counted.statements == 1);
  CHECK(bench.rig.counted.announcements == 1);
}

TEST_CASE("ControlWriter: an announcement has this robot's configuration and what it publishes") {
  Bench bench;
  bench.rig.publish({1, 2, 3});
  REQUIRE(bench.write(0) == DatagramKind::kAnnounce);
  ByteReader from(bench.body);
  AnnouncementHeader header;
  AnnouncedContribution announced;
  REQUIRE(read_announcement_header(from, header));
  CHECK(header.details == bench.rig.gate.details());
  REQUIRE(read_announced(from, announced));
  CHECK(announced.id == bench.own->id);
  CHECK(announced.origin);
  CHECK(announced.complete);
  CHECK(announced.latest == 1);
  CHECK(announced.digest == bench.own->held.folded());
  CHECK(from.remaining() == 0);
}

TEST_CASE("ControlWriter: announcements come at about their period, or soon where that is asked") {
  Bench bench;
  REQUIRE(bench.count(DatagramKind::kAnnounce, 0) == 1);
  const std::int64_t period_ms = bench.rig.config.announce_us / 1000;
  CHECK(bench.count(DatagramKind::kAnnounce, period_ms * 9 / 10 - 1) == 0);
  CHECK(bench.count(DatagramKind::kAnnounce, period_ms * 11 / 10) == 1);
  const std::int64_t now_ms = period_ms * 11 / 10;
  const std::int64_t soon_ms = bench.rig.config.announce_soon_us / 1000;
  bench.control.announce_soon(at_ms(kStart_ms + now_ms));
  // The earlier one holds.
  bench.control.announce_soon(at_ms(kStart_ms + now_ms + 100));
  CHECK(bench.count(DatagramKind::kAnnounce, now_ms + soon_ms - 1) == 0);
  CHECK(bench.count(DatagramKind::kAnnounce, now_ms + soon_ms) == 1);
}

TEST_CASE("ControlWriter: unasked a frame and a statement go with one announcement of eight") {
  Bench bench;
  int announcements = 0;
  int frames = 0;
  int statements = 0;
  for (std::int64_t ms = 0; announcements < 32; ms += 100) {
    while (const std::optional<DatagramKind> next = bench.write(ms)) {
      announcements += *next == DatagramKind::kAnnounce ? 1 : 0;
      frames += *next == DatagramKind::kFrame ? 1 : 0;
      statements += *next == DatagramKind::kStatement ? 1 : 0;
    }
  }
  CHECK(frames == 4);
  CHECK(statements == 4);
}

TEST_CASE(
    "ControlWriter: what is asked for again is sent after a pause, to the greedy a long one") {
  Bench bench;
  bench.count(DatagramKind::kFrame, 0);
  const bool seldom = GENERATE(false, true);
  const auto ask = [&](std::int64_t ms) {
    bench.control.owe_statement(bench.rig.ledger, *bench.own, at_ms(kStart_ms + ms),
                                ControlWriter::Asker{9, !seldom});
  };
  ask(10'000);
  CHECK(bench.count(DatagramKind::kStatement, 9'999) == 0);
  CHECK(bench.count(DatagramKind::kStatement, 10'000) == 1);
  ask(10'001);
  const std::int64_t pause_ms = seldom ? 8'000 : 500;
  CHECK(bench.count(DatagramKind::kStatement, 10'000 + pause_ms - 1) == 0);
  CHECK(bench.count(DatagramKind::kStatement, 10'000 + pause_ms) == 1);
}

TEST_CASE("ControlWriter: frames that are due go out together, 16 of one robot at a time") {
  ManyFrames bench(20);
  const std::uint64_t before = bench.rig.counted.frames;
  for (std::uint32_t submap = 0; submap < 20; ++submap) bench.owe({1, 1, submap}, 1'500);
  for (const std::uint32_t robot : {8U, 7U}) {
    for (std::uint32_t submap = 0; submap < 3; ++submap) bench.owe({robot, 1, submap}, 1'500);
  }
  // Of an earlier start of this robot, whose frame it cannot sign anew.
  REQUIRE(bench.rig.ledger.take_frame({.id = {1, 0, 5}, .revision = 1}, {}, true, at_ms(kStart_ms),
                                      bench.rig.counted));
  bench.owe({1, 0, 5}, 1'500);
  bench.owe({7, 1, 1}, 9'000);  // not due yet
  const std::vector<ManyFrames::Sent> sent = bench.sent(1'500);
  CHECK(sent == std::vector<ManyFrames::Sent>{{1, false, 16, {}},
                                              {1, false, 4, {}},
                                              {1, true, 1, {}},
                                              {7, true, 3, {}},
                                              {8, true, 3, {}}});
  CHECK(bench.rig.counted.frames - before == 27);
}

TEST_CASE("ControlWriter: who asks for frames pays for these, and for no others") {
  ManyFrames bench(8);
  const auto asks = [&](std::uint32_t robot, std::uint32_t submap, bool may_ask = true) {
    bench.owe({1, 1, submap}, 9'500, ControlWriter::Asker{robot, may_ask});
  };
  for (const std::uint32_t submap : {0U, 3U}) asks(7, submap);
  for (const std::uint32_t submap : {1U, 2U, 4U}) asks(8, submap);
  bench.owe({1, 1, 5}, 9'500);
  asks(9, 6, false);
  const std::vector<ManyFrames::Sent> sent = bench.sent(9'500);
  // Nobody pays for two, nor for what the announcement brings.
  REQUIRE(sent.size() >= 3);
  CHECK(sent[0] == ManyFrames::Sent{1, false, 2, {}});
  CHECK(sent[sent.size() - 3].asker == std::nullopt);
  CHECK(sent[sent.size() - 2] == ManyFrames::Sent{1, false, 2, 7});
  CHECK(sent[sent.size() - 1] == ManyFrames::Sent{1, false, 3, 8});
}

TEST_CASE("ControlWriter: what another robot has sent is not sent") {
  Bench bench;
  bench.count(DatagramKind::kFrame, 0);
  const Instant due = at_ms(kStart_ms + 900);
  bench.control.owe_frame(bench.rig.ledger, *bench.own, due);
  bench.control.owe_statement(bench.rig.ledger, *bench.own, due);
  bench.control.drop_frame(bench.rig.ledger, *bench.own);
  CHECK(bench.count(DatagramKind::kFrame, 899) == 0);
  CHECK(bench.write(900) != DatagramKind::kFrame);
  bench.control.drop_statement(bench.rig.ledger, *bench.own);
  bench.control.owe_frame(bench.rig.ledger, *bench.own, at_ms(kStart_ms + 60'000));
  CHECK(bench.write(60'000) == DatagramKind::kFrame);
}

TEST_CASE("ControlWriter: a due of a contribution that lost its place is none of the next one's") {
  Bench bench;
  bench.count(DatagramKind::kFrame, 0);
  ExchangeReport& counted = bench.rig.counted;
  const FrameBody frame{.id = {7, 1, 0}, .revision = 1};
  const Instant now = at_ms(kStart_ms);
  REQUIRE(bench.rig.ledger.take_frame(frame, {}, true, now, counted));
  bench.control.owe_frame(bench.rig.ledger, *bench.rig.ledger.find({7, 1, 0}), now);
  bench.rig.ledger.remove_robot(7);
  FrameBody other = frame;
  other.id.robot = 8;
  REQUIRE(bench.rig.ledger.take_frame(other, {}, true, now, counted));
  CHECK(bench.count(DatagramKind::kFrame, 100) == 0);
}

TEST_CASE("ControlWriter: of more own contributions than fit each is named, and others' too") {
  const auto own = static_cast<std::uint32_t>(GENERATE(1, 30, 41, 42, 43, 44, 45, 46, 100));
  ExchangeConfig config = ExchangeRig::config_of(1);
  config.contributions = 110;
  config.own_contributions = own;
  Bench bench(config);
  ExchangeReport& counted = bench.rig.counted;
  for (std::uint32_t submap = 1; submap < own; ++submap)
    REQUIRE(bench.rig.ledger.open(1, submap, Matrix34d::Identity(), counted) == Status::kOk);
  for (std::uint32_t robot = 20; robot < 25; ++robot)
    REQUIRE(bench.rig.ledger.take_frame({.id = {robot, 1, 0}, .revision = 1}, {}, true,
                                        at_ms(kStart_ms), counted));
  std::map<ContributionId, int> named;
  std::map<ContributionId, int> framed;
  for (std::int64_t ms = 0; counted.announcements < 24; ms += 100) {
    int here = 0;
    while (const std::optional<DatagramKind> next = bench.write(ms)) {
      if (*next == DatagramKind::kFrame) {
        for (const FrameBody& frame : frames_of(bench.body)) ++framed[frame.id];
        ++here;
      }
      ByteReader from(bench.body);
      AnnouncementHeader header;
      if (*next != DatagramKind::kAnnounce || !read_announcement_header(from, header)) continue;
      AnnouncedContribution announced;
      while (from.remaining() != 0) {
        REQUIRE(read_announced(from, announced));
        ++named[announced.id];
      }
    }
    // Nothing else goes out meanwhile.
    CHECK(here <= 1);
  }
  CHECK(named.size() == own + 5);
  CHECK(framed.size() == own);
  for (const auto& [id, times] : named) CHECK(times >= 3);
}

TEST_CASE("ControlWriter: memory that is too small is refused") {
  const ExchangeConfig config = ExchangeRig::config_of(1);
  AlignedMemory memory(ControlWriter::required_bytes(config) - 1);
  Arena arena = memory.arena();
  CHECK(ControlWriter::make(arena, config).status() == Status::kResourceExhausted);
}

}  // namespace
}  // namespace tessera
