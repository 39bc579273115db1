// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A datagram (docs/reference/wire-format.md): a header, a body by kind, a tag. Reading checks
// lengths and ranges, never allocates, and never reads beyond the end.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "tessera/base/internal/byte_io.hpp"
#include "tessera/exchange/authenticator.hpp"
#include "tessera/exchange/internal/fingerprint.hpp"
#include "tessera/exchange/signatures.hpp"
#include "tessera/replica/replicas.hpp"
#include "tessera/semantics/class_table.hpp"

namespace tessera {

/// With the channel "TESSERA" and its NUL, 1,400 bytes: nothing has to cut it up.
inline constexpr std::size_t kMostDatagramBytes = 1392;
inline constexpr std::size_t kHeaderBytes = 32;
inline constexpr std::size_t kMostBodyBytes = kMostDatagramBytes - kHeaderBytes - kTagBytes;

/// What a datagram is for.
enum class DatagramKind : std::uint8_t {
  kAnnounce = 1,     ///< What its sender has.
  kRequest = 2,      ///< What its sender asks for.
  kChunk = 3,        ///< Records of a contribution.
  kFrame = 4,        ///< Where contributions are (frames.hpp).
  kLeave = 5,        ///< Its sender sends no more.
  kStatement = 6,    ///< What the origin of a contribution states about it.
  kDescription = 7,  ///< What its sender holds of a range of versions.
  kConflict = 8,     ///< Proof that a robot signed two contents of one version.
  kPresence = 9,     ///< Where its sender is (presence.hpp), and after it an announcement or not.
};

/// True for messages that only their sender may send, once. Others carry data of an origin's.
[[nodiscard]] constexpr bool is_control(DatagramKind kind) noexcept {
  return kind == DatagramKind::kAnnounce || kind == DatagramKind::kRequest ||
         kind == DatagramKind::kLeave || kind == DatagramKind::kDescription ||
         kind == DatagramKind::kPresence;
}

/// What every datagram begins with, after the letters and the format.
struct DatagramHeader {
  DatagramKind kind = DatagramKind::kAnnounce;
  std::uint32_t mission = 0;        ///< ExchangeConfig::mission.
  std::uint32_t configuration = 0;  ///< ConfigurationDetails::checksum of the sender's.
  std::uint32_t sender = 0;         ///< Robot.
  std::uint64_t session = 0;   ///< The upper 32 bits are higher with every start of the sender.
  std::uint64_t sequence = 0;  ///< Higher with every datagram of a session; never wraps.
  bool is_signed = false;      ///< Its fleet signs what it sends.
};

/// What follows from the proof that a robot signed two contents of one version.
enum class ConflictPolicy : std::uint8_t {
  kAlarm = 0,    ///< It is counted and passed on; one of the two contents counts.
  kExclude = 1,  ///< The contribution's epoch is removed; of three such, the robot.
};

/// What robots must have in common to fuse each other's evidence.
struct ConfigurationDetails {
  static constexpr std::size_t kBytes = 31;
  double resolution_m = 0.0;
  double prior = 0.0;
  float free_weight = 0.0F;
  std::uint16_t classes = 0;
  std::uint32_t class_table = 0;  ///< CRC-32C of the names.
  float max_evidence = 0.0F;      ///< The most that one robot's evidence counts in a voxel.
  ConflictPolicy conflicts = ConflictPolicy::kAlarm;
  [[nodiscard]] std::uint32_t checksum() const noexcept;
  friend bool operator==(const ConfigurationDetails&, const ConfigurationDetails&) = default;
};

/// CRC-32C over the names of the classes, each with a zero byte after it.
[[nodiscard]] std::uint32_t class_table_checksum(const ClassTable& classes) noexcept;

/// A robot asks another one to prove that it is there now: who answers with the nonce is.
struct Challenge {
  static constexpr std::size_t kBytes = 13;
  bool is_answer = false;
  std::uint32_t robot = 0;  ///< Whom it is for.
  std::uint64_t nonce = 0;
};

/// What an announcement begins with, before the contributions.
struct AnnouncementHeader {
  static constexpr std::size_t kMostChallenges = 4;
  static constexpr std::size_t kMostBytes =
      ConfigurationDetails::kBytes + 4 + 8 + 1 + kMostChallenges * Challenge::kBytes;
  ConfigurationDetails details;
  std::uint32_t floor = 0;  ///< The lowest epoch of the sender that counts.
  /// Sequence of the last datagram of the sender that was no control message; 0: there was none.
  std::uint64_t data_sequence = 0;
  std::uint8_t challenges = 0;
  std::array<Challenge, kMostChallenges> challenge{};
};

/// What a robot has of a contribution.
struct AnnouncedContribution {
  static constexpr std::size_t kBytes = 12 + 4 + 4 + 1 + 8;
  ContributionId id;
  std::uint32_t latest = 0;  ///< Of the newest statement that it has.
  std::uint32_t frame_revision = 0;
  bool stated = false;       ///< It has a statement.
  bool complete = false;     ///< It holds what that states.
  bool origin = false;       ///< It publishes this contribution.
  bool disputed = false;     ///< It needs no proof of a conflict in this epoch: it has one.
  std::uint64_t digest = 0;  ///< Fingerprint::folded() of the records that it holds.
  /// It names nothing that is held, but the floor of a robot that was heard with a lower one.
  [[nodiscard]] bool is_floor() const noexcept {
    return !stated && !complete && !origin && frame_revision == 0;
  }
};

/// One less than there are numbers, so that there is always a next one.
inline constexpr std::uint32_t kLastVersion = ~std::uint32_t{0} - 1;

/// Versions from first to last.
struct VersionRange {
  std::uint32_t first = 1;
  std::uint32_t last = 0;
  friend constexpr bool operator==(const VersionRange&, const VersionRange&) = default;
};

/// 2^width versions, the first of which is (index << width) + 1.
struct VersionSpan {
  std::uint8_t width = 0;   ///< At most 32.
  std::uint32_t index = 0;  ///< (index << width) is under 2^32.
  [[nodiscard]] constexpr std::uint64_t first() const noexcept {
    return (std::uint64_t{index} << width) + 1;
  }
  [[nodiscard]] constexpr std::uint64_t last() const noexcept {
    return (std::uint64_t{index} + 1) << width;
  }
  friend constexpr bool operator==(const VersionSpan&, const VersionSpan&) = default;
};

/// What a robot asks for of a contribution.
enum class RequestType : std::uint8_t {
  kGaps = 0,      ///< All records of ranges that are not superseded, from anybody.
  kVersions = 1,  ///< Records by their versions, from one robot.
  kDescribe = 2,  ///< Descriptions of spans, from one robot.
};
/// One contribution of a request: its type says which of the arrays is meant.
struct RequestedContribution {
  static constexpr std::size_t kMostGaps = 32;
  static constexpr std::size_t kMostVersions = 128;
  static constexpr std::size_t kMostSpans = 128;
  RequestType type = RequestType::kGaps;
  ContributionId id;
  std::uint32_t frame_revision = 0;  ///< Of the frame that it has; 0: none.
  bool stated = false;               ///< It has a statement, with latest:
  std::uint32_t latest = 0;
  std::uint32_t target = 0;                            ///< The robot that is asked; not with kGaps.
  std::uint8_t count = 0;                              ///< Of what follows.
  std::array<VersionRange, kMostGaps> gap{};           ///< Ascending, none overlapping.
  std::array<std::uint32_t, kMostVersions> version{};  ///< Ascending.
  std::uint8_t width = 0;                              ///< Of the spans.
  std::array<std::uint32_t, kMostSpans> span{};        ///< Their indexes, ascending.
};

/// What the origin of a contribution states about it. Of two statements the newer one holds.
struct Statement {
  ContributionId id;
  VersionRange range{};       ///< Of the chunk that it came with.
  std::uint32_t latest = 0;   ///< The highest version that was published.
  std::uint32_t records = 0;  ///< That count: superseded ones do not.
  Fingerprint fingerprint{};  ///< Of these.
  std::uint32_t frame_revision = 0;
  std::uint32_t floor = 0;          ///< The lowest epoch of the robot that counts.
  std::uint32_t session_floor = 0;  ///< The same of its map sessions: with a lower one none does.
  std::uint64_t session = 0;        ///< Of the process that stated it.
  /// True if this one replaces other: what grows in them grows with time.
  [[nodiscard]] bool is_newer_than(const Statement& other) const noexcept;
  /// False: both are of one moment, and state different contents.
  [[nodiscard]] bool agrees_with(const Statement& other) const noexcept {
    return latest != other.latest || (records == other.records && fingerprint == other.fingerprint);
  }
};

/// What all records of a chunk are of. Sent by the origin it has a statement, and its records are
/// all of the range that count.
struct ChunkHeader {
  ContributionId id{};
  VersionRange range{};
  bool relayed = false;   ///< By another robot: each record has a proof, if the fleet signs.
  bool partial = false;   ///< Records by their versions; other versions may be missing.
  Statement statement{};  ///< If it is not relayed.
};

/// A part of a block as it goes over the wire.
struct ChunkRecord {
  BlockCoord block;
  PartVersion version;
  std::span<const std::byte> coded;    ///< block_codec.hpp
  std::span<const std::byte> proof{};  ///< record_proof.hpp; none: the chunk's signature is.
};

/// Of which contribution, and for whom, the descriptions of a datagram are.
struct DescriptionHeader {
  ContributionId id;
  std::uint32_t target = 0;  ///< The robot that asked.
};

/// What a robot holds of a span: sums of its equal parts, or the records themselves.
struct Description {
  static constexpr std::size_t kMostSums = 64;
  static constexpr std::size_t kMostRecords = 135;
  /// A record: its version, and of its hash and live layers 32 bits.
  struct Mark {
    std::uint32_t version = 0;
    std::uint32_t mark = 0;
  };
  VersionSpan span{};
  bool is_list = false;
  std::uint8_t part_width = 0;  ///< Of each sum's span.
  std::uint32_t last = 0;       ///< A list has all records of the span up to this version.
  std::uint8_t count = 0;
  std::array<std::uint64_t, kMostSums> sum{};
  std::array<Mark, kMostRecords> record{};
};

/// A proof: which leaf of how many, their path, and the signature.
inline constexpr std::size_t kMostProofBytes = 1 + 4 * kHashBytes + kSignatureBytes;
/// Bytes of a record's own, beside what is coded, at most.
inline constexpr std::size_t kMostRecordHeaderBytes = 1 + 5 + 3 * 5 + 2;
inline constexpr std::size_t kMostChunkHeaderBytes = 57;
/// What fits a datagram whatever else the record says, with a signature or a proof.
inline constexpr std::size_t kMostCodedBytes =
    kMostBodyBytes - kMostRecordHeaderBytes - 21 - kMostProofBytes;
static_assert(kMostCodedBytes + kMostRecordHeaderBytes + kMostChunkHeaderBytes + kSignatureBytes <=
              kMostBodyBytes);

// --- Writing. Each call writes all or nothing: false iff it does not fit. ------------------------
void write_id(ByteWriter& to, const ContributionId& id) noexcept;
void write_header(ByteWriter& to, const DatagramHeader& header) noexcept;
void write_details(ByteWriter& to, const ConfigurationDetails& details) noexcept;
void write_announcement_header(ByteWriter& to, const AnnouncementHeader& header) noexcept;
bool write_announced(ByteWriter& to, const AnnouncedContribution& announced) noexcept;
bool write_requested(ByteWriter& to, const RequestedContribution& requested) noexcept;
void write_chunk_header(ByteWriter& to, const ChunkHeader& header) noexcept;
bool write_statement(ByteWriter& to, const Statement& statement) noexcept;
void write_description_header(ByteWriter& to, const DescriptionHeader& header) noexcept;
bool write_description(ByteWriter& to, const Description& description) noexcept;

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

// --- Reading. False iff the bytes are none of these; the rest of the datagram is invalid. ---

bool read_header(ByteReader& from, DatagramHeader& header) noexcept;
bool read_details(ByteReader& from, ConfigurationDetails& details) noexcept;
bool read_announcement_header(ByteReader& from, AnnouncementHeader& header) noexcept;
bool read_announced(ByteReader& from, AnnouncedContribution& announced) noexcept;
bool read_requested(ByteReader& from, RequestedContribution& requested) noexcept;
/// session: of the datagram.
bool read_chunk_header(ByteReader& from, std::uint64_t session, ChunkHeader& header) noexcept;
bool read_statement(ByteReader& from, Statement& statement) noexcept;
bool read_description_header(ByteReader& from, DescriptionHeader& header) noexcept;
bool read_description(ByteReader& from, Description& description) noexcept;

/// A chunk's records, one after the other, checked as they are read.
class RecordReader {
 public:
  /// proofs: each record has one.
  RecordReader(ByteReader& from, VersionRange range, bool proofs) noexcept
      : from_(from), range_(range), proofs_(proofs), version_(range.first - 1) {}
  bool read(ChunkRecord& record) noexcept;

 private:
  ByteReader& from_;
  VersionRange range_;
  bool proofs_;
  std::uint32_t version_;
  BlockCoord block_{};
};

}  // namespace tessera
