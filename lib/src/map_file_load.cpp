// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Loading trusts nothing: every count and value is checked before it is used.
#include <algorithm>
#include <bit>

#include "map_file_format.hpp"

namespace tessera {

namespace {

using detail::CheckedSource;

constexpr std::size_t kMaxHeaderBody = 6144;

/// What went wrong, at the place the source has reached.
MapFileStatus failed(const CheckedSource& source, Status status, const char* what) noexcept {
  return {status, what, source.offset()};
}

MapFileStatus check(CheckedSource& source, const char* bad) noexcept {
  switch (source.check_crc()) {
    case CheckedSource::Check::kGood:
      return {};
    case CheckedSource::Check::kBad:
      return failed(source, Status::kCorrupt, bad);
    case CheckedSource::Check::kEnd:
      break;
  }
  return failed(source, Status::kTruncated, "the file ends before a checksum");
}

Status parse_body(ByteReader& in, MapFileHeader& header) noexcept {
  const std::uint8_t kind = in.u8();
  const std::uint8_t tuple = in.u8();
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
  if (kind > static_cast<std::uint8_t>(MapKind::kGlobal)) return Status::kUnsupported;
  if (tuple > static_cast<std::uint8_t>(TuplePolicy::kCompact)) return Status::kUnsupported;
  if (classes < 1 || classes > kMaxClasses || has_T_global_map > 1) return Status::kCorrupt;
  header.identity.has_T_global_map = has_T_global_map == 1;
  header.identity.kind = static_cast<MapKind>(kind);
  header.config.tuple = static_cast<TuplePolicy>(tuple);
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
  const std::uint32_t octet_bytes =
      TupleStore::octet_bytes(header.config.tuple, header.classes.num_components());
  header.config.storage_bytes = detail::storage_for(content, octet_bytes);
  return header.config.storage_bytes == 0 ? Status::kCorrupt : Status::kOk;
}

constexpr const char* kNoSource = "there is no source to read";
/// A block's head and free passes are kept in the first bytes of the buffer; the rest reads ahead.
constexpr std::size_t kPieceBytes = 1024;
constexpr const char* kEndsInBlock = "the file ends inside a block";

/// The counts of one voxel with label evidence.
MapFileStatus load_counts(CheckedSource& source, VoxelEvidence& evidence) noexcept {
  std::array<std::byte, 1> one{};
  if (!source.get(one)) return failed(source, Status::kTruncated, kEndsInBlock);
  const int count = std::to_integer<int>(one[0]);
  if (count == 0) return failed(source, Status::kCorrupt, "an observed voxel has no count");
  int last = -1;  // 0 stands for the rest
  for (int i = 0; i < count; ++i) {
    std::array<std::byte, 5> bytes{};
    if (!source.get(bytes)) return failed(source, Status::kTruncated, kEndsInBlock);
    ByteReader in(bytes);
    const int component = in.u8();
    const float value = in.f32();
    if (component <= last || component >= evidence.num_components || !(value > 0.0F) ||
        !(value < 1e30F)) {
      return failed(source, Status::kCorrupt, "a count is out of range");
    }
    last = component;
    (component == 0 ? evidence.rest : evidence.sigma[static_cast<std::size_t>(component)]) = value;
  }
  return {};
}

/// Float rounding may leave a sum a little over the cap.
bool over_cap(const MapConfig& config, const VoxelEvidence& evidence,
              std::uint8_t passes) noexcept {
  if (!(config.max_evidence > 0.0F)) return false;
  float sum = static_cast<float>(passes) * config.free_weight;
  for (int l = 1; l < evidence.num_components; ++l)
    sum += evidence.sigma[static_cast<std::size_t>(l)];
  return sum + evidence.rest > config.max_evidence * 1.001F;
}

/// labelled: the octet's label evidence follows. passes: of the whole block; empty: none.
MapFileStatus load_octet(CheckedSource& source, LocalMap& map, SlabHandle block, int octet,
                         bool labelled, std::span<const std::byte> passes) noexcept {
  std::array<std::byte, 1> observed{};
  if (labelled && !source.get(observed)) return failed(source, Status::kTruncated, kEndsInBlock);
  if (labelled && observed[0] == std::byte{0})
    return failed(source, Status::kCorrupt, "an octet without an observed voxel");
  for (unsigned voxel = 0; voxel < kOctetVoxels; ++voxel) {
    VoxelEvidence evidence;
    evidence.num_components = map.num_components();
    if (((std::to_integer<unsigned>(observed[0]) >> voxel) & 1U) != 0) {
      const MapFileStatus status = load_counts(source, evidence);
      if (!status.ok()) return status;
    }
    const std::size_t at = static_cast<std::size_t>(octet) * kOctetVoxels + voxel;
    const auto free = passes.empty() ? std::uint8_t{0} : std::to_integer<std::uint8_t>(passes[at]);
    if (over_cap(map.config(), evidence, free))
      return failed(source, Status::kCorrupt, "a voxel's evidence is over the cap");
    const Status status = map.restore(block, octet, static_cast<int>(voxel), evidence, free);
    if (status == Status::kInvalidArgument)
      return failed(source, Status::kCorrupt, "a voxel has counts that no map can hold");
    if (status != Status::kOk)
      return failed(source, status, "the map's storage is too small for this file");
  }
  return {};
}

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
  constexpr std::size_t kHead = 8 + 4 + 1 + 8;
  const std::span<std::byte> head = std::span(buffer.bytes).first(kHead);
  if (!source.get(head))
    return failed(source, Status::kTruncated, "the file ends before its last block");
  const MapFileStatus intact = check(source, "a block's head is damaged");
  if (!intact.ok()) return intact;
  ByteReader in(head);
  const std::uint64_t key = in.u64();
  const std::uint32_t revision = in.u32();
  const std::uint8_t free = in.u8();
  const std::uint64_t octets = in.u64();
  const bool in_order = key >= loaded.next_key && key >> 63U == 0;
  if (!in_order || free > 1 || (free == 0 && octets == 0) || revision > header.revision)
    return failed(source, Status::kCorrupt, "a block's head is not valid");
  loaded.next_key = key + 1;
  loaded.content.blocks += 1;
  loaded.content.free_pages += free;
  loaded.content.label_pages += octets != 0 ? 1U : 0U;
  loaded.content.octets += static_cast<std::uint64_t>(std::popcount(octets));
  // Before the content takes storage: what is too much for the header is not the storage's fault.
  if (!no_more_than(loaded.content, header.content))
    return failed(source, Status::kCorrupt, "the blocks are not what the header says");
  std::span<std::byte> passes;
  if (free == 1) {
    passes = std::span(buffer.bytes).subspan(kHead, kBlockVoxels);
    if (!source.get(passes)) return failed(source, Status::kTruncated, kEndsInBlock);
    if (std::ranges::all_of(passes, [](std::byte n) { return n == std::byte{0}; }))
      return failed(source, Status::kCorrupt, "a block's free layer is empty");
  }
  const Result<SlabHandle> block = map.open_block(unpack(BlockKey{key}));
  if (!block.ok()) return failed(source, block.status(), "the map has no room for a block");
  map.restore_revision(*block, revision);
  for (int octet = 0; octet < kBlockOctets; ++octet) {
    const bool labelled = ((octets >> static_cast<unsigned>(octet)) & 1U) != 0;
    if (!labelled && passes.empty()) continue;
    const MapFileStatus status = load_octet(source, map, *block, octet, labelled, passes);
    if (!status.ok()) return status;
  }
  return check(source, "a block's checksum does not match");
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
      return failed(source, Status::kCorrupt, "this is not a map file");
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

MapFileStatus load_blocks(const ByteSource& byte_source, const MapFileHeader& header,
                          MapFileBuffer& buffer, LocalMap& map) noexcept {
  CheckedSource source(byte_source, header.header_bytes,
                       std::span(buffer.bytes).subspan(kPieceBytes));
  if (byte_source.read == nullptr) return failed(source, Status::kInvalidArgument, kNoSource);
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
