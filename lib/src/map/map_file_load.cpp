// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Loading trusts nothing: every count and value is checked before it is used.
#include <algorithm>
#include <bit>

#include "map_block_format.hpp"

namespace tessera {

namespace {

using detail::BlockHead;
using detail::check;
using detail::CheckedSource;
using detail::failed;
using detail::kPieceBytes;
using detail::read_content;
using detail::read_head;

constexpr std::size_t kMaxHeaderBody = 6144;

VoxelCoord voxel_of(ByteReader& in) noexcept {
  VoxelCoord voxel;
  voxel.x = static_cast<std::int32_t>(in.u32());
  voxel.y = static_cast<std::int32_t>(in.u32());
  voxel.z = static_cast<std::int32_t>(in.u32());
  return voxel;
}

/// Of the header's blocks and classes, which are known. False: such counts no map has.
bool parse_summary(ByteReader& in, MapFileHeader& header) noexcept {
  MapSummary summary;
  summary.digest = in.u64();
  summary.label_voxels = in.u64();
  summary.free_voxels = in.u64();
  summary.occupied = in.u64();
  summary.free = in.u64();
  summary.low = voxel_of(in);
  summary.high = voxel_of(in);
  const std::uint64_t most = header.content.blocks * kBlockVoxels;
  std::uint64_t labelled = 0;
  bool small = true;
  for (std::uint64_t& voxels :
       std::span(summary.occupied_by_label)
           .first(static_cast<std::size_t>(header.classes.num_components()))) {
    voxels = in.u64();
    small = small && voxels <= most;
    labelled += voxels;
  }
  for (const std::uint64_t voxels :
       {summary.label_voxels, summary.free_voxels, summary.occupied, summary.free})
    small = small && voxels <= most;
  const bool ordered = summary.low.x <= summary.high.x && summary.low.y <= summary.high.y &&
                       summary.low.z <= summary.high.z;
  header.summary = summary;
  return in.ok() && small && ordered && in_grid(summary.low) && in_grid(summary.high) &&
         summary.observed() == summary.occupied + summary.free && labelled == summary.occupied;
}

Status parse_body(ByteReader& in, MapFileHeader& header) noexcept {
  const std::uint8_t kind = in.u8();
  const unsigned tuple_byte = in.u8();
  const unsigned tuple = tuple_byte & ~(detail::kSharesBit | detail::kVotesBit);
  const std::uint8_t classes = in.u8();
  const std::uint8_t has_T_global_map = in.u8();
  header.config.resolution_m = in.f64();
  header.config.prior = in.f64();
  header.config.max_evidence = in.f32();
  header.config.free_weight = in.f32();
  header.identity.robot = in.u32();
  header.identity.epoch = in.u32();
  header.revision = in.u32();
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 4; ++c) header.identity.T_global_map(r, c) = in.f64();
  }
  MapFileContent& content = header.content;
  content = {
      .blocks = in.u64(), .label_pages = in.u64(), .free_pages = in.u64(), .octets = in.u64()};
  if (kind > static_cast<std::uint8_t>(MapKind::kSubmaps)) return Status::kUnsupported;
  if (tuple > static_cast<unsigned>(TuplePolicy::kCompact)) return Status::kUnsupported;
  if (classes < 1 || classes > kMaxClasses || has_T_global_map > 1) return Status::kCorrupt;
  header.identity.has_T_global_map = has_T_global_map == 1;
  header.identity.kind = static_cast<MapKind>(kind);
  header.config.tuple = static_cast<TuplePolicy>(tuple);
  header.config.probabilities =
      (tuple_byte & detail::kSharesBit) == 0 ? Probabilities::kEffective : Probabilities::kShares;
  header.config.label_votes = (tuple_byte & detail::kVotesBit) != 0;
  for (int label = 0; label < classes; ++label) {
    std::array<char, SemanticClass::kNameBytes> name{};
    for (char& letter : name) letter = static_cast<char>(in.u8());
    const SemanticClass given{name, {in.u8(), in.u8(), in.u8()}};
    // What follows a name's end would not be written again.
    if (!(SemanticClass::make(given.name_view(), given.color) == given)) return Status::kCorrupt;
    const Status status = header.classes.add(given.name_view(), given.color);
    TESSERA_ASSERT(status == Status::kOk);
    static_cast<void>(status);
  }
  header.identity.settings_bytes = in.u32();
  if (header.identity.settings_bytes > MapIdentity::kMaxSettings) return Status::kCorrupt;
  for (std::size_t i = 0; i < header.identity.settings_bytes; ++i) {
    header.identity.settings[i] = static_cast<char>(in.u8());
  }
  constexpr std::uint64_t kMostBlocks = std::uint64_t{1} << 32U;
  const bool fits = content.blocks <= kMostBlocks && content.label_pages <= content.blocks &&
                    content.free_pages <= content.blocks && content.octets >= content.label_pages &&
                    content.octets <= kBlockOctets * content.label_pages;
  const bool rigid =
      !header.identity.has_T_global_map || check_rigid(header.identity.T_global_map) == Status::kOk;
  if (!in.ok() || !fits || !rigid || !in_range(header.config)) return Status::kCorrupt;
  const std::uint8_t has_summary = in.u8();
  if (!in.ok() || has_summary > 1 || (has_summary == 1 && !parse_summary(in, header)))
    return Status::kCorrupt;
  const std::uint32_t octet_bytes =
      TupleStore::octet_bytes(header.config.tuple, header.classes.num_components());
  header.config.storage_bytes =
      detail::storage_for(content, octet_bytes, label_page_bytes(header.config.label_votes));
  return header.config.storage_bytes == 0 ? Status::kCorrupt : Status::kOk;
}

constexpr const char* kNoSource = "there is no source to read";

/// What of a file was loaded so far.
struct Loaded {
  MapFileContent content{};
  std::uint64_t next_key = 0;  ///< Blocks come in ascending order of keys.
};

bool no_more_than(const MapFileContent& a, const MapFileContent& b) noexcept {
  return a.blocks <= b.blocks && a.label_pages <= b.label_pages && a.free_pages <= b.free_pages &&
         a.octets <= b.octets;
}

MapFileStatus load_block(CheckedSource& source, const MapFileHeader& header, MapFileBuffer& buffer,
                         LocalMap& map, Loaded& loaded) noexcept {
  const auto pieces = std::span(buffer.bytes).first<kPieceBytes>();
  BlockHead head;
  const MapFileStatus intact = read_head(source, pieces, head);
  if (!intact.ok()) return intact;
  const bool unknown_votes = head.votes != 0 && !header.config.label_votes;
  if (head.key < loaded.next_key || head.revision > header.revision || unknown_votes)
    return failed(source, Status::kCorrupt, "a block's head is not valid");
  loaded.next_key = head.key + 1;
  loaded.content.blocks += 1;
  loaded.content.free_pages += head.free ? 1U : 0U;
  loaded.content.label_pages += head.octets != 0 ? 1U : 0U;
  loaded.content.octets += static_cast<std::uint64_t>(std::popcount(head.octets));
  // Before the content takes storage: what is too much for the header is not the storage's fault.
  if (!no_more_than(loaded.content, header.content))
    return failed(source, Status::kCorrupt, "the blocks are not what the header says");
  return read_content(source, pieces, head, map);
}

MapFileStatus load_all(CheckedSource& source, const MapFileHeader& header, MapFileBuffer& buffer,
                       LocalMap& map) noexcept {
  Loaded loaded;
  for (std::uint64_t i = 0; i < header.content.blocks; ++i) {
    const MapFileStatus status = load_block(source, header, buffer, map, loaded);
    if (!status.ok()) return status;
  }
  const std::span<std::byte> end = std::span(buffer.bytes).first(12);
  if (!source.get(end))
    return failed(source, Status::kTruncated, "the file ends before its end mark");
  ByteReader in(end);
  const std::uint32_t mark = in.u32();
  const std::uint64_t blocks = in.u64();
  if (!(loaded.content == header.content))
    return failed(source, Status::kCorrupt, "the blocks are not what the header says");
  if (mark != detail::kEndMark || blocks != header.content.blocks)
    return failed(source, Status::kCorrupt, "the end mark is not valid");
  const MapFileStatus status = check(source, "the end's checksum does not match");
  if (!status.ok()) return status;
  std::array<std::byte, 1> more{};
  if (source.get(more)) return failed(source, Status::kCorrupt, "there is more after the end mark");
  map.restore_revision(header.revision);
  return {};
}

}  // namespace

MapFileStatus load_header(const ByteSource& byte_source, MapFileBuffer& buffer,
                          MapFileHeader& header) noexcept {
  CheckedSource source(byte_source, 0);
  if (byte_source.read == nullptr) return failed(source, Status::kInvalidArgument, kNoSource);
  header = MapFileHeader{};
  const std::span<std::byte> preamble = std::span(buffer.bytes).first(detail::kPreambleBytes);
  if (!source.get(preamble))
    return failed(source, Status::kTruncated, "the file is too short for a header");
  ByteReader in(preamble);
  for (const char letter : detail::kMapMagic) {
    if (in.u8() != static_cast<std::uint8_t>(letter))
      return failed(source, Status::kCorrupt, MapFileStatus::kOtherFile);
  }
  const std::uint16_t major = in.u16();
  static_cast<void>(in.u16());  // any minor version of a major one that is known
  const std::uint32_t body_bytes = in.u32();
  if (major != detail::kMapMajor)
    return failed(source, Status::kUnsupported, "the file has another major version");
  if (body_bytes > kMaxHeaderBody)
    return failed(source, Status::kCorrupt, "the header's length is not valid");
  const std::span<std::byte> body =
      std::span(buffer.bytes).subspan(detail::kPreambleBytes, body_bytes);
  if (!source.get(body))
    return failed(source, Status::kTruncated, "the file ends inside its header");
  const MapFileStatus checksum = check(source, "the header's checksum does not match");
  if (!checksum.ok()) return checksum;
  ByteReader reader(body);
  const Status status = parse_body(reader, header);
  if (status == Status::kUnsupported)
    return failed(source, status, "the header names a kind of map that is not known");
  if (status != Status::kOk) return failed(source, status, "the header has a value out of range");
  header.header_bytes = source.offset();
  return {.offset_bytes = source.offset()};
}

bool is_end_of(const MapFileHeader& header,
               std::span<const std::byte, kMapFileEndBytes> end) noexcept {
  ByteReader in(end);
  const bool is_end = in.u32() == detail::kEndMark && in.u64() == header.content.blocks;
  return is_end && in.u32() == crc32c(end.first<kMapFileEndBytes - 4>());
}

MapFileStatus load_blocks(const ByteSource& byte_source, const MapFileHeader& header,
                          MapFileBuffer& buffer, LocalMap& map) noexcept {
  CheckedSource source(byte_source, header.header_bytes,
                       std::span(buffer.bytes).subspan(kPieceBytes));
  if (byte_source.read == nullptr) return failed(source, Status::kInvalidArgument, kNoSource);
  if (header.identity.kind == MapKind::kSubmaps)
    return failed(source, Status::kUnsupported,
                  "the map is in submaps, which are loaded one by one");
  const MapConfig& a = map.config();
  const MapConfig& b = header.config;
  const auto same = [](double x, double y) { return !(x < y) && !(x > y); };
  const bool matches =
      same(a.resolution_m, b.resolution_m) && same(a.prior, b.prior) &&
      same(static_cast<double>(a.max_evidence), static_cast<double>(b.max_evidence)) &&
      same(static_cast<double>(a.free_weight), static_cast<double>(b.free_weight)) &&
      a.tuple == b.tuple && map.classes() == header.classes && map.block_count() == 0;
  if (!matches)
    return failed(source, Status::kMismatch,
                  "the map to load into was made with other settings, or is not empty");
  const MapFileStatus status = load_all(source, header, buffer, map);
  if (!status.ok()) map.clear();
  return status;
}

}  // namespace tessera
