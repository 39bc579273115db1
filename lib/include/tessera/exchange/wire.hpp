// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a datagram is made of (docs/wire-format.md): a header, a body by kind, a tag. Every datagram
// stands alone. Reading checks lengths and ranges, never allocates, and never reads beyond the end.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "tessera/base/byte_io.hpp"
#include "tessera/base/geometry.hpp"
#include "tessera/exchange/authenticator.hpp"
#include "tessera/exchange/signatures.hpp"
#include "tessera/fusion/replicas.hpp"
#include "tessera/semantics/class_table.hpp"

namespace tessera {

/// With the channel "TESSERA" and its NUL, 1,400 bytes: nothing on the way has to cut it up.
inline constexpr std::size_t kMostDatagramBytes = 1392;
inline constexpr std::size_t kHeaderBytes = 20;
inline constexpr std::size_t kMostBodyBytes = kMostDatagramBytes - kHeaderBytes - kTagBytes;

/// What a datagram is for.
enum class DatagramKind : std::uint8_t {
  kAnnounce = 1,  ///< What its sender has.
  kRequest = 2,   ///< What its sender lacks.
  kChunk = 3,     ///< Blocks of a contribution.
  kFrame = 4,     ///< Where a contribution is.
  kLeave = 5,     ///< Its sender says no more.
};

/// Said by its sender of itself, and once; what is not is of a contribution's origin, and may be
/// passed on.
[[nodiscard]] constexpr bool is_control(DatagramKind kind) noexcept {
  return kind == DatagramKind::kAnnounce || kind == DatagramKind::kRequest ||
         kind == DatagramKind::kLeave;
}

/// What every datagram begins with, behind the letters and the format.
struct DatagramHeader {
  DatagramKind kind = DatagramKind::kAnnounce;
  std::uint32_t configuration = 0;  ///< ConfigurationDetails::checksum of the sender's.
  std::uint32_t sender = 0;         ///< Robot.
  std::uint32_t session = 0;        ///< Higher with every start of the sender.
  std::uint32_t sequence = 0;       ///< Higher with every datagram of a session.
  bool is_signed = false;           ///< Its fleet signs what it says.
};

/// What robots must have alike to fuse what the others say.
struct ConfigurationDetails {
  double resolution_m = 0.0;
  double prior = 0.0;
  float free_weight = 0.0F;
  std::uint16_t classes = 0;
  std::uint32_t class_table = 0;  ///< CRC-32C of the names.
  [[nodiscard]] std::uint32_t checksum() const noexcept;
  friend bool operator==(const ConfigurationDetails&, const ConfigurationDetails&) = default;
};

/// CRC-32C over the names of the classes, each with a zero byte after it.
[[nodiscard]] std::uint32_t class_table_checksum(const ClassTable& classes) noexcept;

/// What a robot has of a contribution.
struct AnnouncedContribution {
  ContributionId id;
  std::uint32_t latest = 0;  ///< The highest version that it knows of.
  std::uint32_t frame_revision = 0;
  bool complete = false;     ///< It has all up to that.
  bool origin = false;       ///< It is publishing it: there are no other versions.
  std::uint64_t digest = 0;  ///< Of all that it has, if complete.
};

/// One less than there are numbers, so that there is always a next one.
inline constexpr std::uint32_t kLastVersion = ~std::uint32_t{0} - 1;

/// Versions from first to last.
struct VersionRange {
  std::uint32_t first = 1;
  std::uint32_t last = 0;
  friend constexpr bool operator==(const VersionRange&, const VersionRange&) = default;
};

/// What a robot lacks of a contribution.
struct RequestedContribution {
  static constexpr std::size_t kMostGaps = 32;
  ContributionId id;
  std::uint32_t frame_revision = 0;  ///< Of the frame that it has; 0: none.
  bool all = false;                  ///< All, from whoever has another digest than this.
  std::uint64_t digest = 0;
  std::uint8_t gaps = 0;                      ///< 0 with all.
  std::array<VersionRange, kMostGaps> gap{};  ///< Ascending, none overlapping.
};

/// What all records of a chunk are of. In the range they are all that is not superseded: who has
/// them lacks nothing there.
struct ChunkHeader {
  ContributionId id{};
  VersionRange range{};
  bool all = false;          ///< Also those that only fill in for later versions.
  std::uint64_t digest = 0;  ///< With all: of what its sender has of the contribution.
  bool proofs = false;       ///< Each record has its own: its origin signed them in other chunks.
};

/// A part of a block as it goes over the wire.
struct ChunkRecord {
  BlockCoord block;
  PartVersion version;
  std::span<const std::byte> coded;    ///< block_codec.hpp
  std::span<const std::byte> proof{};  ///< record_proof.hpp; none: the chunk's signature is.
};

/// Where a contribution lies: the higher revision holds.
struct FrameBody {
  ContributionId id;
  std::uint32_t revision = 0;
  Matrix34d T_global_map = Matrix34d::Identity();
};

/// A record's proof: which leaf of how many, their path, and the signature.
inline constexpr std::size_t kMostProofBytes = 1 + 4 * kHashBytes + kSignatureBytes;
/// Bytes of a record's own, beside what is coded, at most.
inline constexpr std::size_t kMostRecordHeaderBytes = 1 + 5 + 3 * 5 + 2;
inline constexpr std::size_t kMostChunkHeaderBytes = 29;
/// What fits a datagram whatever else the record says.
inline constexpr std::size_t kMostCodedBytes =
    kMostBodyBytes - kMostChunkHeaderBytes - kMostRecordHeaderBytes - kMostProofBytes;

// --- Writing. Each call writes all or nothing: false iff it does not fit. ------------------------

void write_header(ByteWriter& to, const DatagramHeader& header) noexcept;
void write_details(ByteWriter& to, const ConfigurationDetails& details) noexcept;
bool write_announced(ByteWriter& to, const AnnouncedContribution& announced) noexcept;
bool write_requested(ByteWriter& to, const RequestedContribution& requested) noexcept;
void write_chunk_header(ByteWriter& to, const ChunkHeader& header) noexcept;
bool write_frame(ByteWriter& to, const FrameBody& frame) noexcept;

/// Records of a chunk, in the order of their versions.
class RecordWriter {
 public:
  RecordWriter(ByteWriter& to, VersionRange range) noexcept : to_(to), version_(range.first - 1) {}
  /// False iff it does not fit: nothing was written.
  bool write(const ChunkRecord& record) noexcept;

 private:
  ByteWriter& to_;
  std::uint32_t version_;
  BlockCoord block_{};
};

// --- Reading. False iff what is there is none of these; the rest of the datagram is of no use. ---

bool read_header(ByteReader& from, DatagramHeader& header) noexcept;
bool read_details(ByteReader& from, ConfigurationDetails& details) noexcept;
bool read_announced(ByteReader& from, AnnouncedContribution& announced) noexcept;
bool read_requested(ByteReader& from, RequestedContribution& requested) noexcept;
bool read_chunk_header(ByteReader& from, ChunkHeader& header) noexcept;
bool read_frame(ByteReader& from, FrameBody& frame) noexcept;

/// A chunk's records, one after the other, checked as they are read.
class RecordReader {
 public:
  RecordReader(ByteReader& from, const ChunkHeader& header) noexcept
      : from_(from),
        range_(header.range),
        proofs_(header.proofs),
        version_(header.range.first - 1) {}
  bool read(ChunkRecord& record) noexcept;

 private:
  ByteReader& from_;
  VersionRange range_;
  bool proofs_;
  std::uint32_t version_;
  BlockCoord block_{};
};

}  // namespace tessera
