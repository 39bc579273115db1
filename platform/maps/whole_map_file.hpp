// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map with an archive, saved as one map file. In memory that does not grow with the map, but for
// 32 bytes a block.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/arena_memory.hpp"
#include "base/file_descriptor.hpp"
#include "base/outcome.hpp"
#include "maps/archive_file.hpp"
#include "maps/stored_map.hpp"

namespace tessera {

/// Neither map nor archive may change meanwhile; others may read the map. The value is what the
/// file holds. Fails with kFailure iff an archived block cannot be read, the file cannot be
/// written, or the system does not give the memory.
Outcome<MapSummary> save_whole(const LocalMap& map, ArchiveFile& archive,
                               const MapIdentity& identity, const std::string& path);
/// The digest of the file that save_whole would write. Fails likewise.
Outcome<std::uint64_t> digest_of_whole(const LocalMap& map, ArchiveFile& archive);
/// save_whole for a map of which all blocks are archived: its memory is what they are read in, and
/// it is of no other use afterwards.
Outcome<MapSummary> save_archived(LocalMap& map, ArchiveFile& archive, const MapIdentity& identity,
                                  const std::string& path);

/// The map as it was when the snapshot was taken: mapping continues while that is written. Blocks
/// in memory are copied to a file that has no name; those of the archive stay in it, until it is
/// cleared.
class MapSnapshot {
 public:
  /// Neither map nor archive may change meanwhile. beside: a path in a folder for the copy. Fails
  /// with kFailure iff the copy cannot be written.
  static Outcome<std::unique_ptr<MapSnapshot>> take(const LocalMap& map, const ArchiveFile& archive,
                                                    const std::string& beside);
  MapSnapshot(const MapSnapshot&) = delete;
  MapSnapshot& operator=(const MapSnapshot&) = delete;
  /// Fails as save_whole.
  Outcome<MapSummary> save(const MapIdentity& identity, const std::string& path);

 private:
  /// Of a block in the copy.
  struct Copied {
    std::uint64_t key = 0;
    std::uint64_t offset = 0;
    std::uint32_t bytes = 0;
  };
  MapSnapshot(const LocalMap& map, const ArchiveFile& archive);
  Outcome<void> copy(const LocalMap& map, const std::string& beside);
  Status add_copied(BlockKey key, LocalMap& into);
  Status add_archived(BlockKey key, LocalMap& into);

  const ArchiveFile& archive_;
  MapConfig config_;
  ClassTable classes_;
  std::uint32_t revision_ = 0;
  FileDescriptor file_;
  std::vector<Copied> copied_;
  std::vector<KeyedIndex> archived_;  ///< With the places in the archive.
  std::vector<std::byte> buffer_;     ///< Of a block.
};

}  // namespace tessera
