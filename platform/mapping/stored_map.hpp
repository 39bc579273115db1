// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map with the memory that it lives in, and its way to and from a .tsm file.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "mapping/report.hpp"
#include "posix/outcome.hpp"
#include "tessera/base/arena.hpp"
#include "tessera/map/map_file.hpp"

namespace tessera {

/// Memory for arenas, aligned to kArenaAlignment; pages count only once they are touched.
class ArenaMemory {
 public:
  /// Fails with kFailure iff the system refuses.
  static Outcome<ArenaMemory> allocate(std::size_t bytes);
  [[nodiscard]] std::span<std::byte> span() const { return {bytes_.get(), size_}; }

 private:
  struct Free {
    void operator()(std::byte* bytes) const;
  };
  std::unique_ptr<std::byte, Free> bytes_;
  std::size_t size_ = 0;
};

/// A map file in memory.
struct StoredMap {
  ArenaMemory memory;
  LocalMap map;
  MapFileHeader header;
};

/// Reads a map file; its storage is just what it needs, or storage_bytes if that is larger.
/// Fails with kUsage iff the file is missing, damaged or of another kind; the message says what is
/// wrong and where.
Outcome<std::unique_ptr<StoredMap>> load_map(const std::string& path,
                                             std::size_t storage_bytes = 0);

/// Reads only the header.
Outcome<MapFileHeader> load_map_header(const std::string& path);

/// What the map's own record says of an option that it was made with; null if it does not.
Json recorded_setting(const MapFileHeader& header, const char* key);

/// Makes this the map's record. Fails with kUsage iff it is too long.
Outcome<void> record_settings(const Json& config, MapIdentity& identity);

/// Reads path into a map that was made with its header's settings; the value is false iff the map's
/// storage is too small for it, and the map is then of no use. Fails as load_map.
Outcome<bool> load_into(const std::string& path, LocalMap& map);

/// Writes the map to a temporary name and renames it. workspace: at least 2 * map.block_count()
/// entries.
Outcome<void> save_map(const LocalMap& map, const MapIdentity& identity,
                       std::span<KeyedIndex> workspace, const std::string& path);

/// The same for blocks that a lookup gives; blocks: their keys in ascending order. Fails too iff
/// one cannot be had.
Outcome<void> save_map(const LocalMap& map, const MapIdentity& identity,
                       std::span<const KeyedIndex> blocks, const BlockLookup& lookup,
                       const std::string& path);

/// Workspace for iterating over a map.
std::vector<KeyedIndex> workspace_for(const LocalMap& map);

}  // namespace tessera
