// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "fuzz/forged_datagram.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/exchange/conflicts.hpp"
#include "tessera/exchange/presence.hpp"
#include "tessera/frames/frame_statements.hpp"

namespace tessera::fuzz {

namespace {

constexpr std::uint32_t kLastVersion = ~std::uint32_t{0} - 1;

/// What was read of the input, as it is written again.
struct Echo {
  explicit Echo(Bytes given) : input(given), from(given) {}
  /// Of all that was read so far.
  void check() const {
    const std::size_t read = input.size() - from.remaining();
    require(to.ok() && to.size() == read, "written in another length");
    const Bytes all = to.written();
    require(std::equal(all.begin(), all.end(), input.begin()), "not canonical");
  }

  Bytes input;
  std::array<std::byte, kMostDatagramBytes> written{};
  ByteReader from;
  ByteWriter to{written};
};

void header(Echo& echo) {
  DatagramHeader header;
  if (!read_header(echo.from, header)) return;
  require(header.kind >= DatagramKind::kAnnounce && static_cast<unsigned>(header.kind) <= kMostKind,
          "kind");
  write_header(echo.to, header);
  echo.check();
}

void announcement(Echo& echo) {
  AnnouncementHeader header;
  if (!read_announcement_header(echo.from, header)) return;
  write_announcement_header(echo.to, header);
  echo.check();
  static_cast<void>(header.details.checksum());
  AnnouncedContribution announced;
  while (echo.from.remaining() != 0 && read_announced(echo.from, announced)) {
    require(announced.latest <= kLastVersion, "a version that has no next one");
    require(write_announced(echo.to, announced), "read and not written");
    echo.check();
  }
}

void request(Echo& echo) {
  RequestedContribution requested;
  while (echo.from.remaining() != 0 && read_requested(echo.from, requested)) {
    const bool gaps = requested.type == RequestType::kGaps;
    require(!gaps || requested.count <= RequestedContribution::kMostGaps, "too many gaps");
    for (const VersionRange& gap : std::span(requested.gap).first(gaps ? requested.count : 0))
      require(gap.first >= 1 && gap.first <= gap.last && gap.last <= kLastVersion, "a gap");
    require(write_requested(echo.to, requested), "read and not written");
    echo.check();
    requested = {};
  }
}

void statement(Echo& echo) {
  Statement statement;
  if (!read_statement(echo.from, statement)) return;
  require(statement.floor <= statement.id.epoch, "a floor above the epoch");
  require(write_statement(echo.to, statement), "read and not written");
  echo.check();
}

void description(Echo& echo) {
  DescriptionHeader header;
  if (!read_description_header(echo.from, header)) return;
  write_description_header(echo.to, header);
  Description description;
  while (echo.from.remaining() != 0 && read_description(echo.from, description)) {
    require(write_description(echo.to, description), "read and not written");
    echo.check();
    description = {};
  }
}

void chunk(Echo& echo) {
  ChunkHeader header;
  if (!read_chunk_header(echo.from, 1, header)) return;
  require(header.range.first >= 1 && header.range.first <= header.range.last &&
              header.range.last <= kLastVersion,
          "a range");
  write_chunk_header(echo.to, header);
  echo.check();
  RecordReader reader(echo.from, header.range, header.relayed);
  RecordWriter writer(echo.to, header.range);
  ChunkRecord record;
  std::uint32_t before = header.range.first - 1;
  while (echo.from.remaining() != 0 && reader.read(record)) {
    const PartVersion& version = record.version;
    require(version.number > before && version.number <= header.range.last, "versions ascend");
    require(version.first >= 1 && version.first <= version.number, "the first of the parts");
    require(version.layers != 0 && version.layers <= kAllLayers, "layers");
    require(pack(record.block).ok(), "a block that is not in the grid");
    before = version.number;
    require(writer.write(record), "read and not written");
    echo.check();
  }
}

void frames(Echo& echo) {
  FramesHeader header;
  if (!read_frames_header(echo.from, header)) return;
  write_frames_header(echo.to, header);
  echo.check();
  FrameReader reader(echo.from, header.robot, header.relayed);
  FrameWriter writer(echo.to);
  FrameBody frame;
  std::span<const std::byte> proof;
  while (echo.from.remaining() != 0 && reader.read(frame, proof)) {
    require(frame.revision >= 1, "a revision of none");
    require(frame.id.robot == header.robot, "of another robot");
    require(!frame.extent.any() || (in_grid(frame.extent.low) && in_grid(frame.extent.high)),
            "an extent that is not in the grid");
    require(writer.write(frame, proof), "read and not written");
    echo.check();
  }
}

void presence(Echo& echo) {
  Presence presence;
  if (!read_presence(echo.from, presence)) return;
  require(check_rigid(presence.T_global_body) == Status::kOk, "a place that is none");
  require(presence.T_global_body.cwiseAbs().maxCoeff() <= Presence::kMostMetres + 2.0, "far away");
  if (!Presence::is_sendable(presence.box)) return;
  // Rounded once more, the place may be another one beside it, and the box one step larger.
  std::array<std::byte, Presence::kBytes> bytes{};
  ByteWriter to(bytes);
  Presence again;
  if (!write_presence(to, presence)) return;
  ByteReader from(bytes);
  require(read_presence(from, again), "written and not read");
  require((again.T_global_body - presence.T_global_body).cwiseAbs().maxCoeff() < 0.002,
          "written elsewhere");
  require(again.stamp_ms == presence.stamp_ms && again.age_ms == presence.age_ms &&
              again.speed_m_per_s == presence.speed_m_per_s,
          "written otherwise");
}

void conflict(Echo& echo) {
  ConflictBody conflict;
  if (!read_conflict(echo.from, conflict)) return;
  require(write_conflict(echo.to, conflict), "read and not written");
  require(echo.to.size() <= kMostConflictBytes, "longer than it can be");
  echo.check();
}

/// Of the contribution that it says it is of.
void frame_statement(Echo& echo) {
  const Bytes all = echo.input;
  const auto word = [&](std::size_t at) {
    ByteReader from(all.subspan(std::min(at, all.size())));
    return from.u32();
  };
  if (all.size() == StatedPrior::kBytes) {
    const Result<StatedPrior> prior = decode_prior(all);
    require(prior.ok() == is_frame_statement({word(0), word(4), 0}, kPlaceOfPrior, all), "a prior");
    if (!prior.ok()) return;
    std::array<std::byte, StatedPrior::kBytes> again{};
    require(encode_prior(*prior, again) == Status::kOk, "a prior that has no code");
    require(std::equal(again.begin(), again.end(), all.begin()), "a prior with another code");
    return;
  }
  const Result<FrameLink> link = decode_link(all);
  require(link.ok() == is_frame_statement({word(0), word(8), 0}, place_of_link(word(4)), all),
          "a link");
  if (!link.ok()) return;
  std::array<std::byte, FrameLink::kBytes> again{};
  require(encode_link(*link, again) == Status::kOk, "a link that has no code");
  require(std::equal(again.begin(), again.end(), all.begin()), "a link with another code");
  require(check_rigid(link->T_from_to) == Status::kOk, "a link that is not rigid");
}

}  // namespace

void wire(Bytes bytes) {
  Input input(bytes);
  const int kind = input.below(10);
  Echo echo(input.bytes(kMostDatagramBytes));
  switch (kind) {
    case 0:
      return header(echo);
    case 1:
      return announcement(echo);
    case 2:
      return request(echo);
    case 3:
      return chunk(echo);
    case 4:
      return statement(echo);
    case 5:
      return description(echo);
    case 6:
      return conflict(echo);
    case 8:
      return presence(echo);
    case 9:
      return frame_statement(echo);
    default:
      return frames(echo);
  }
}

}  // namespace tessera::fuzz
