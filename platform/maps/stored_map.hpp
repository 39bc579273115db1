// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map with its memory, loaded from and saved to a .tsm file.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/arena_memory.hpp"
#include "base/atomic_file.hpp"
#include "base/json.hpp"
#include "base/outcome.hpp"
#include "tessera/base/arena.hpp"
#include "tessera/map/map_file.hpp"

namespace tessera {

/// A map in memory with what a file says of it.
struct StoredMap {
  /// For the map of a file.
  StoredMap() noexcept : map(loaded) {}
  /// For a map that something else holds, which must outlive this.
  explicit StoredMap(LocalMap& held) noexcept : map(held) {}
  StoredMap(const StoredMap&) = delete;
  StoredMap& operator=(const StoredMap&) = delete;
  StoredMap(StoredMap&&) = delete;
  StoredMap& operator=(StoredMap&&) = delete;
  ~StoredMap() = default;

  ArenaMemory memory;
  LocalMap loaded;
  LocalMap& map;
  MapFileHeader header;
};

/// Reads a map file that is not in submaps, or a map that a node keeps while it maps (MapJournal),
/// of which the functions below read too; its storage is exactly what it needs, or storage_bytes if
/// that is larger. Fails with kUsage iff the file is missing, damaged or of another kind; the
/// message has the error and its place.
Outcome<std::unique_ptr<StoredMap>> load_map(const std::string& path,
                                             std::size_t storage_bytes = 0);

/// Reads only the header.
Outcome<MapFileHeader> load_map_header(const std::string& path);
/// The same of a file that also ends as it should: it is not truncated.
Outcome<MapFileHeader> load_whole_header(const std::string& path);

/// Where in a file a map file is, if there are others before and after it.
struct FilePart {
  std::uint64_t offset_bytes = 0;
  std::uint64_t bytes = 0;
};
/// As load_map. Offsets in messages are of the part.
Outcome<std::unique_ptr<StoredMap>> load_map(const std::string& path, const FilePart& part);
/// "path: what (kind at byte N); remedy".
Failure damaged_file(const std::string& path, const MapFileStatus& status);

/// The value of an option in the record of the map; null if it has none.
Json recorded_setting(const MapFileHeader& header, const char* key);

/// Sets the record of the map, without kernels that are too many for it. Fails with kUsage iff it
/// is too long.
Outcome<void> record_settings(const Json& config, MapIdentity& identity);

/// Reads path into a map that was made with its header's settings; the value is false iff the map's
/// storage is too small for it; the map is then unusable. Fails as load_map.
Outcome<bool> load_into(const std::string& path, LocalMap& map);

/// Writes the map to a temporary name and renames it; the value is what the file's header says that
/// it holds. workspace: at least 2 * map.block_count() entries.
Outcome<MapSummary> save_map(const LocalMap& map, const MapIdentity& identity,
                             std::span<KeyedIndex> workspace, const std::string& path);

/// The same for blocks of a lookup; blocks: their keys in ascending order. summary: theirs. Also
/// fails iff the lookup of one fails.
Outcome<void> save_map(const LocalMap& map, const MapIdentity& identity,
                       std::span<const KeyedIndex> blocks, const BlockLookup& lookup,
                       const MapSummary& summary, const std::string& path);

/// The blocks of a map: of a lookup, by their keys in ascending order, with their summary.
struct SavedBlocks {
  std::span<const KeyedIndex> blocks;
  BlockLookup lookup;
  const MapSummary& summary;
};
/// Appends a complete map file to an open one; commit() explains a refused write. The value is its
/// bytes. Fails with kFailure iff the lookup of a block fails.
Outcome<std::uint64_t> append_map(const LocalMap& map, const MapIdentity& identity,
                                  const SavedBlocks& saved, AtomicFile& file);
/// The same for a map in memory, with its summary.
struct AppendedMap {
  MapSummary summary;
  std::uint64_t bytes = 0;
};
Outcome<AppendedMap> append_map(const LocalMap& map, const MapIdentity& identity, AtomicFile& file);

/// Workspace for iterating over a map.
std::vector<KeyedIndex> workspace_for(const LocalMap& map);

}  // namespace tessera
