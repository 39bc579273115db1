// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is believed of what robots announce, where nobody signs.
#include "tessera/exchange/internal/announcement_taker.hpp"

#include <catch2/catch.hpp>

#include "exchange_rig.hpp"

namespace tessera {
namespace {

constexpr std::uint32_t kOrigin = 7;
constexpr std::uint32_t kOther = 8;
constexpr ContributionId kId{kOrigin, 1, 0};

/// Robot 1 hears. It has a frame of robot 7, of revision 5.
struct Bench {
  Bench() : rig(1) {
    REQUIRE(rig.ledger.take_frame({.id = kId, .revision = 5}, {}, true, now, rig.counted));
  }
  void announce(std::uint32_t from, const std::vector<AnnouncedContribution>& all,
                bool is_last = true) {
    const std::vector<std::byte> body = written_by([&](ByteWriter& to) {
      for (const AnnouncedContribution& one : all) REQUIRE(write_announced(to, one));
    });
    rig.hear(DatagramKind::kAnnounce, from, body, now, is_last);
    REQUIRE(rig.counted.refused_body == 0);
  }
  void announce_frame(std::uint32_t from, std::uint32_t revision) {
    announce(from, {{.id = kId, .frame_revision = revision, .origin = from == kOrigin}});
  }
  /// The revision that is asked for: higher than this; nothing where none is.
  [[nodiscard]] std::optional<std::uint32_t> asked_above() {
    const Instant later = now + Duration{600'000};
    std::array<std::byte, kMostBodyBytes> body{};
    ByteWriter to(body);
    if (!rig.repair.write(rig.ledger, to, later, rig.counted)) return std::nullopt;
    const std::span<const std::byte> written(body.data(), to.size());
    ByteReader from(written);
    RequestedContribution requested;
    REQUIRE(read_requested(from, requested));
    return requested.frame_revision;
  }
  [[nodiscard]] HeldContribution& held() { return *rig.ledger.find(kId); }
  void wait(std::int64_t ms) { now = now + Duration{1'000 * ms}; }

  ExchangeRig rig;
  Instant now = at_ms(1'000'000);
};

/// So many contributions of a robot, one after the other.
std::vector<AnnouncedContribution> list_of(std::uint32_t robot, std::uint32_t count,
                                           std::uint32_t epoch = 3) {
  std::vector<AnnouncedContribution> all;
  for (std::uint32_t i = 0; i < count; ++i)
    all.push_back({.id = {robot, epoch, i}, .frame_revision = 1, .origin = true});
  return all;
}

TEST_CASE("AnnouncementTaker: an origin that announces an earlier frame is asked for it") {
  Bench bench;
  bench.wait(1'500);
  bench.announce_frame(kOrigin, 2);
  CHECK(bench.held().frame_doubted);
  // What is held is still what others can be sent.
  CHECK(bench.held().frame_revision == 5);
  CHECK(bench.asked_above() == 0);
  REQUIRE(bench.rig.ledger.take_frame({.id = kId, .revision = 2}, {}, false, bench.now,
                                      bench.rig.counted));
  CHECK(bench.held().frame_revision == 2);
  CHECK_FALSE(bench.held().frame_doubted);
}

TEST_CASE("AnnouncementTaker: an announcement that the frame overtook makes nobody doubt it") {
  Bench bench;
  bench.wait(900);
  bench.announce_frame(kOrigin, 4);
  CHECK_FALSE(bench.held().frame_doubted);
  bench.wait(600);
  // No origin announces that it has no frame.
  bench.announce_frame(kOrigin, 0);
  CHECK_FALSE(bench.held().frame_doubted);
  bench.announce_frame(kOther, 4);
  CHECK_FALSE(bench.held().frame_doubted);
}

TEST_CASE("AnnouncementTaker: others speak of a later frame while its origin is silent") {
  Bench bench;
  bench.announce_frame(kOrigin, 5);
  bench.announce_frame(kOther, 9);
  CHECK(bench.held().announced_frame == 5);
  bench.wait(5'000);
  bench.announce_frame(kOther, 9);
  CHECK(bench.held().announced_frame == 6);
}

TEST_CASE("AnnouncementTaker: what a whole list leaves out is nobody's, of one cut short nothing") {
  const bool cut = GENERATE(false, true);
  Bench bench;
  // As many as fit, or one less.
  std::uint32_t count = cut ? 44 : 40;
  for (int i = 0; i < 2; ++i) {
    bench.announce(kOrigin, list_of(kOrigin, count, 1));
    bench.wait(1'000);
  }
  const ContributionId made_up{kOrigin, 1, 999};
  REQUIRE(bench.rig.ledger.take_frame({.id = made_up, .revision = 1}, {}, true, bench.now,
                                      bench.rig.counted));
  for (int i = 0; i < 3; ++i) {
    bench.wait(1'000);
    bench.announce(kOrigin, list_of(kOrigin, count, 1));
  }
  CHECK((bench.rig.ledger.find(made_up) != nullptr) == cut);
  // Followed by others' the list is whole, however long.
  std::vector<AnnouncedContribution> all = list_of(kOrigin, 43, 1);
  all.push_back({.id = {kOther, 1, 0}});
  for (int i = 0; i < 3; ++i) {
    bench.wait(1'000);
    bench.announce(kOrigin, all);
  }
  CHECK(bench.rig.ledger.find(made_up) == nullptr);
}

TEST_CASE("AnnouncementTaker: an announcement that came late says nothing of who is there") {
  Bench bench;
  bench.announce(kOrigin, {{.id = kId, .frame_revision = 5, .origin = true}}, false);
  CHECK(bench.held().origin_at == Instant::long_ago());
  bench.announce_frame(kOrigin, 5);
  CHECK(bench.held().origin_at == bench.now);
}

}  // namespace
}  // namespace tessera
