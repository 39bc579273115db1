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

/// Reads a map file; its storage is exactly what it needs, or storage_bytes if that is larger.
/// Fails with kUsage iff the file is missing, damaged or of another kind; the message has the error
/// and its place.
Outcome<std::unique_ptr<StoredMap>> load_map(const std::string& path,
                                             std::size_t storage_bytes = 0);

/// Reads only the header.
Outcome<MapFileHeader> load_map_header(const std::string& path);
/// The same of a file that also ends as it should: it is not truncated.
Outcome<MapFileHeader> load_whole_header(const std::string& path);

/// The value of an option in the record of the map; null if it has none.
Json recorded_setting(const MapFileHeader& header, const char* key);

/// Sets the record of the map. Fails with kUsage iff it is too long.
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

/// Workspace for iterating over a map.
std::vector<KeyedIndex> workspace_for(const LocalMap& map);

}  // namespace tessera
