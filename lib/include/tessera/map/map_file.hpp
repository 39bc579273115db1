// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The map file, .tsm: a header, the blocks in (z, y, x) order, an end mark. Little-endian, every
// part with its CRC-32C. Streamed through an injected sink or source, so the core knows no files.
// Saving, loading and saving again gives the same bytes. docs/reference/memory.md has the layout
// byte by byte.
//
// Compatibility: a reader refuses a file with a newer major version, and reads any minor version of
// its own major one: minor versions only append to the header, whose length is stored.
#pragma once

#include <array>
#include <optional>
#include <span>

#include "tessera/base/geometry.hpp"
#include "tessera/map/map_summary.hpp"

namespace tessera {

/// Takes bytes; returns false if it cannot.
struct ByteSink {
  void* context = nullptr;
  bool (*write)(void* context, std::span<const std::byte> bytes) = nullptr;
};
/// Gives bytes; returns how many, fewer than asked for at the end only.
struct ByteSource {
  void* context = nullptr;
  std::size_t (*read)(void* context, std::span<std::byte> into) = nullptr;
};

/// One robot's map, one fused of several, or one robot's in submaps (submap/submap_file.hpp).
enum class MapKind : std::uint8_t { kLocal = 0, kGlobal = 1, kSubmaps = 2 };

/// What a file says of its map beside the voxels.
struct MapIdentity {
  static constexpr std::size_t kMaxSettings = 2048;
  MapKind kind = MapKind::kLocal;
  std::uint32_t robot = 0;
  std::uint32_t epoch = 0;
  bool has_T_global_map = false;
  Matrix34d T_global_map = Matrix34d::Identity();
  /// Text about how the map was made (JSON from the command line), not interpreted here.
  std::array<char, kMaxSettings> settings{};
  std::uint32_t settings_bytes = 0;

  /// Whether it is known where the map is: a global map is in the global frame.
  [[nodiscard]] bool is_placed() const noexcept {
    return has_T_global_map || kind == MapKind::kGlobal;
  }
  /// Where it is, or the identity.
  [[nodiscard]] Matrix34d place() const noexcept {
    return has_T_global_map ? T_global_map : Matrix34d(Matrix34d::Identity());
  }
};

/// How saving or loading ended. what: a short phrase, static; offset_bytes: where in the file.
struct [[nodiscard]] MapFileStatus {
  /// what, where the file does not begin as a map file does (kCorrupt).
  static constexpr const char* kOtherFile = "this is not a map file";

  Status status = Status::kOk;
  const char* what = "";
  std::uint64_t offset_bytes = 0;
  [[nodiscard]] bool ok() const noexcept { return status == Status::kOk; }
};

/// What a file holds, so that storage for it can be computed.
struct MapFileContent {
  std::uint64_t blocks = 0;
  std::uint64_t label_pages = 0;  ///< Blocks with label evidence.
  std::uint64_t free_pages = 0;   ///< Blocks with free evidence.
  std::uint64_t octets = 0;       ///< Octets with label evidence.
  friend constexpr bool operator==(const MapFileContent&, const MapFileContent&) = default;
};

/// A file's header: enough to make the map that the blocks go into.
struct MapFileHeader {
  MapConfig config{};  ///< storage_bytes: what the file's content needs, at least.
  ClassTable classes{};
  MapIdentity identity{};
  MapFileContent content{};
  std::uint32_t revision = 0;
  std::optional<MapSummary> summary{};  ///< As save() was given it.
  std::uint64_t header_bytes = 0;       ///< Where the blocks begin in the file.
};

/// Memory that saving and loading work in: give one, reuse it at will.
struct MapFileBuffer {
  std::array<std::byte, 8192> bytes;
};

/// Writes the map. workspace: at least 2 * map.block_count() entries. summary: of this map, for the
/// header; without it whoever wants counts or digest reads all voxels. Fails with kInvalidArgument
/// iff the map was never made, the workspace is too short, settings_bytes is over kMaxSettings or
/// the sink has no function, and nothing is written; with kIo iff the sink refuses. O(map).
MapFileStatus save(const LocalMap& map, const MapIdentity& identity,
                   std::span<KeyedIndex> workspace, MapFileBuffer& buffer, const ByteSink& sink,
                   const MapSummary* summary = nullptr) noexcept;

/// The same for blocks that a lookup gives, such as those of a map that is only partly in memory;
/// blocks: their keys in ascending order. Settings, classes and revision are those of map. Each
/// block is asked for twice, in order. Fails with kInvalidArgument iff the map was never made,
/// settings_bytes is over kMaxSettings, or lookup or sink has no function, and nothing is written;
/// with kIo iff a block cannot be had or the sink refuses. O(blocks).
MapFileStatus save(const LocalMap& map, const MapIdentity& identity,
                   std::span<const KeyedIndex> blocks, const BlockLookup& lookup,
                   MapFileBuffer& buffer, const ByteSink& sink,
                   const MapSummary* summary = nullptr) noexcept;

/// Reads and checks the header. Fails with kTruncated, kCorrupt (magic, checksum, a value out of
/// range), kUnsupported (a newer major version, an unknown tuple policy or kind), or
/// kInvalidArgument iff the source has no function.
MapFileStatus load_header(const ByteSource& source, MapFileBuffer& buffer,
                          MapFileHeader& header) noexcept;

/// Bytes of the end of each file, and whether these are the end of the file with that header.
inline constexpr std::size_t kMapFileEndBytes = 16;
[[nodiscard]] bool is_end_of(const MapFileHeader& header,
                             std::span<const std::byte, kMapFileEndBytes> end) noexcept;

/// Reads the blocks after load_header, and the source to its end, into an empty map made with the
/// header's configuration (storage_bytes may differ). Fails with kMismatch iff the map's
/// resolution, prior, cap, free weight, tuple policy or classes differ or it is not empty, or
/// kInvalidArgument iff the source has no function, kUnsupported iff the file is of submaps: the
/// map is then as it was. Else with kResourceExhausted iff its storage is too small, kTruncated or
/// kCorrupt (a checksum, a value out of range, blocks out of order, a block without evidence or
/// newer than the map, evidence over the cap, other content than the header says): the map is then
/// empty.
MapFileStatus load_blocks(const ByteSource& source, const MapFileHeader& header,
                          MapFileBuffer& buffer, LocalMap& map) noexcept;

}  // namespace tessera
