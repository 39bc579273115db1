// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What arrives, by kind: which part of the exchange it changes, and what is none of its kind.
#include "tessera/exchange/internal/message_taker.hpp"

#include <catch2/catch.hpp>

#include "exchange_rig.hpp"

namespace tessera {
namespace {

constexpr Instant kNow = at_ms(1'000'000);
constexpr ContributionId kTheirs{7, 1, 0};

std::vector<std::byte> frame_of(const ContributionId& id, std::uint32_t revision = 1) {
  return written_by(
      [&](ByteWriter& to) { REQUIRE(write_frame(to, {.id = id, .revision = revision})); });
}

/// A chunk with what a robot publishes of versions 1 .. last, from itself or passed on.
std::vector<std::byte> chunk_of(ExchangeRig& from, std::uint32_t last, bool relayed = false) {
  const HeldContribution& own = *from.ledger.publishing();
  return written_by([&](ByteWriter& to) {
    ChunkHeader header{.id = own.id, .range = {1, last}, .relayed = relayed};
    header.statement = from.ledger.statement_of(own, header.range);
    write_chunk_header(to, header);
    RecordWriter writer(to, header.range);
    for (std::uint32_t v = 1; v <= last; ++v) {
      const Replicas::Replica* const part = from.ledger.records().find_version(own, v, 0).part;
      if (part != nullptr) REQUIRE(writer.write(from.ledger.records().read(*part)));
    }
  });
}

/// A request of one contribution.
std::vector<std::byte> request_of(RequestedContribution requested) {
  return written_by([&](ByteWriter& to) { REQUIRE(write_requested(to, requested)); });
}

/// Robot 1 hears; robot 7 publishes two blocks.
struct Bench {
  Bench() : rig(1), theirs(kTheirs.robot) {
    theirs.open_own();
    theirs.publish({1, 0, 0});
    theirs.publish({2, 0, 0});
  }
  void hear(DatagramKind kind, std::span<const std::byte> body,
            std::uint32_t from = kTheirs.robot) {
    rig.hear(kind, from, body, kNow);
  }
  [[nodiscard]] const HeldContribution* held() { return rig.ledger.find(kTheirs); }

  ExchangeRig rig;
  ExchangeRig theirs;
};

TEST_CASE("MessageTaker: a body that is none of its kind is counted, and changes nothing") {
  const auto kind = GENERATE(DatagramKind::kRequest, DatagramKind::kChunk, DatagramKind::kFrame,
                             DatagramKind::kStatement, DatagramKind::kDescription,
                             DatagramKind::kConflict, DatagramKind::kLeave);
  Bench bench;
  const std::vector<std::byte> body(3, std::byte{0xff});
  bench.hear(kind, body);
  CHECK(bench.rig.counted.refused_body == 1);
  CHECK(bench.held() == nullptr);
  CHECK_FALSE(bench.rig.peer(kTheirs.robot, kNow).left);
}

TEST_CASE("MessageTaker: a robot leaves by its last message, not by one that came late") {
  Bench bench;
  const bool is_last = GENERATE(false, true);
  bench.rig.hear(DatagramKind::kLeave, kTheirs.robot, {}, kNow, is_last);
  CHECK(bench.rig.peer(kTheirs.robot, kNow).left == is_last);
  CHECK(bench.rig.counted.refused_body == 0);
}

TEST_CASE("MessageTaker: a frame opens its contribution, and a chunk fills it") {
  Bench bench;
  bench.hear(DatagramKind::kFrame, frame_of(kTheirs));
  REQUIRE(bench.held() != nullptr);
  CHECK(bench.held()->open);
  bench.hear(DatagramKind::kChunk, chunk_of(bench.theirs, 2));
  CHECK(bench.held()->records == 2);
  CHECK(bench.held()->complete());
  CHECK(bench.held()->origin_at == kNow);
  CHECK(bench.rig.counted.records_taken == 2);
}

TEST_CASE("MessageTaker: a chunk before its frame is early, and its name is kept") {
  Bench bench;
  bench.hear(DatagramKind::kChunk, chunk_of(bench.theirs, 2));
  CHECK(bench.rig.counted.records_early == 1);
  REQUIRE(bench.held() != nullptr);
  CHECK_FALSE(bench.held()->open);
  CHECK(bench.held()->records == 0);
}

TEST_CASE("MessageTaker: only its origin sends a chunk with a statement, anybody may relay") {
  Bench bench;
  bench.hear(DatagramKind::kFrame, frame_of(kTheirs));
  bench.hear(DatagramKind::kChunk, chunk_of(bench.theirs, 2), 8);
  CHECK(bench.rig.counted.refused_body == 1);
  CHECK(bench.held()->records == 0);
  bench.hear(DatagramKind::kChunk, chunk_of(bench.theirs, 2, true), 8);
  CHECK(bench.rig.counted.refused_body == 1);
  CHECK(bench.held()->records == 2);
}

TEST_CASE("MessageTaker: of this robot's own, what it did not publish is an impostor's") {
  Bench bench;
  ExchangeRig twin(1);
  twin.open_own();
  twin.publish({5, 5, 5}, 9.0F);
  bench.rig.open_own();
  bench.hear(DatagramKind::kChunk, chunk_of(twin, 1, true), 8);
  CHECK(bench.rig.counted.impostors == 1);
  bench.rig.publish({5, 5, 5}, 9.0F);
  bench.hear(DatagramKind::kChunk, chunk_of(twin, 1, true), 8);
  CHECK(bench.rig.counted.impostors == 1);
}

TEST_CASE("MessageTaker: a request for a frame that is older here owes one") {
  Bench bench;
  bench.rig.open_own();
  RequestedContribution requested{.id = {1, 1, 0}, .frame_revision = 0, .stated = true};
  bench.hear(DatagramKind::kRequest, request_of(requested));
  std::vector<std::byte> body(kMostBodyBytes);
  const auto frames_at = [&](Instant now) {
    const std::uint64_t before = bench.rig.counted.frames;
    for (int i = 0; i < 4; ++i) {
      ByteWriter to(body);
      Outgoing out = bench.rig.outgoing(now);
      if (!bench.rig.sender.control().write(out, to)) break;
    }
    return bench.rig.counted.frames - before;
  };
  CHECK(frames_at(kNow + Duration{bench.rig.config.answer_us}) == 1);
}

TEST_CASE("MessageTaker: frames that are asked for together go out in one datagram") {
  Bench bench;
  std::vector<std::byte> request(kMostBodyBytes);
  ByteWriter to(request);
  for (std::uint32_t submap = 0; submap < 3; ++submap) {
    const ContributionId id{kTheirs.robot, 1, submap};
    bench.hear(DatagramKind::kFrame, frame_of(id));
    REQUIRE(write_requested(to, {.id = id, .stated = true}));
  }
  bench.hear(DatagramKind::kRequest, to.written(), 8);
  std::vector<std::size_t> sent;
  for (std::int64_t ms = 1; ms <= 2 * bench.rig.config.answer_us / 1'000; ++ms) {
    std::vector<std::byte> body(kMostBodyBytes);
    ByteWriter answer(body);
    Outgoing out = bench.rig.outgoing(kNow + Duration{1'000 * ms});
    if (!bench.rig.sender.control().write(out, answer)) continue;
    if (out.kind == DatagramKind::kFrame) sent.push_back(frames_of(answer.written()).size());
  }
  CHECK(sent == std::vector<std::size_t>{3});
}

TEST_CASE("MessageTaker: gaps that this robot can fill wait to be answered, others do not") {
  Bench bench;
  bench.hear(DatagramKind::kFrame, frame_of(kTheirs));
  bench.hear(DatagramKind::kChunk, chunk_of(bench.theirs, 2));
  RequestedContribution requested{.id = kTheirs, .frame_revision = 1, .stated = true, .latest = 2};
  requested.count = 1;
  requested.gap[0] = {2, 9};
  bench.hear(DatagramKind::kRequest, request_of(requested), 8);
  const Answers& answers = bench.rig.sender.answers();
  const std::uint32_t number = bench.rig.ledger.number_of(*bench.held());
  CHECK(answers.waiting() == 1);
  CHECK(answers.touches(number, {2, 2}));
  CHECK_FALSE(answers.touches(number, {1, 1}));
  CHECK_FALSE(answers.touches(number, {3, 9}));
}

TEST_CASE("MessageTaker: versions are answered by the robot that is asked for them alone") {
  Bench bench;
  bench.hear(DatagramKind::kFrame, frame_of(kTheirs));
  RequestedContribution requested{.type = RequestType::kVersions, .id = kTheirs, .stated = true};
  requested.count = 2;
  requested.version[0] = 1;
  requested.version[1] = 2;
  requested.target = 5;
  bench.hear(DatagramKind::kRequest, request_of(requested), 8);
  CHECK(bench.rig.sender.answers().waiting() == 0);
  requested.target = 1;
  bench.hear(DatagramKind::kRequest, request_of(requested), 8);
  CHECK(bench.rig.sender.answers().picks().count == 2);
  CHECK(bench.rig.sender.answers().picks().front().asker == 8);
}

TEST_CASE("MessageTaker: what another robot answers first need not be sent") {
  Bench bench;
  bench.hear(DatagramKind::kFrame, frame_of(kTheirs));
  bench.hear(DatagramKind::kChunk, chunk_of(bench.theirs, 2));
  RequestedContribution requested{.id = kTheirs, .frame_revision = 1, .stated = true, .latest = 2};
  requested.count = 1;
  requested.gap[0] = {1, 2};
  bench.hear(DatagramKind::kRequest, request_of(requested), 8);
  REQUIRE(bench.rig.sender.answers().waiting() == 1);
  bench.hear(DatagramKind::kChunk, chunk_of(bench.theirs, 2, true), 9);
  CHECK(bench.rig.sender.answers().waiting() == 0);
  CHECK(bench.rig.counted.answers_saved == 1);
}

TEST_CASE("MessageTaker: memory that is too small is refused") {
  AlignedMemory memory(MessageTaker::required_bytes() - 1);
  Arena arena = memory.arena();
  CHECK(MessageTaker::make(arena, ExchangeRig::config_of(1)).status() ==
        Status::kResourceExhausted);
}

}  // namespace
}  // namespace tessera
