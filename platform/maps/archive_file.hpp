// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The archive of a moving window: a file to which blocks are appended and from which they are read.
// It is never rewritten, so a crash can damage only its end, which is detected and cut off.
// docs/reference/memory.md has the layout byte by byte.
#pragma once

#include <unistd.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "base/outcome.hpp"
#include "maps/record_file.hpp"
#include "tessera/map/stored_archive.hpp"

namespace tessera {

/// Content of an archive file, up to its last complete record.
struct ArchiveContent {
  MapFileHeader header;           ///< Of the map that the blocks belong to.
  std::uint64_t records = 0;      ///< Of blocks, including those that later ones replace.
  std::uint64_t torn_bytes = 0;   ///< After the last complete record.
  bool complete = false;          ///< The last run ended and all of its map is here.
  std::uint32_t revision = 0;     ///< Of the map if complete, else the latest of a block.
  std::uint64_t whole_bytes = 0;  ///< Up to the end of the last complete record.
};

class ArchiveFile {
 public:
  static constexpr const char* kName = "blocks.tsa";
  static constexpr std::size_t kUnitBytes = archive_format::kUnitBytes;
  /// The limit of the 32-bit places of an index.
  static constexpr std::uint64_t kMostBytes = std::uint64_t{kUnitBytes} << 32U;

  /// Reads a whole file and checks it. Fails with kUsage iff it is missing, not an archive, of a
  /// newer version, or damaged other than at its end.
  static Outcome<ArchiveContent> inspect(const std::string& path);

  /// Arena bytes for an archive with an index for this number of blocks of such a map.
  static std::size_t required_bytes(const MapConfig& map, int num_components, std::size_t blocks);

  /// Creates the folder and a file for blocks of such a map, or opens the file that inspect found:
  /// cuts off an incomplete end and fills the index. arena: outlives the archive. Fails with kUsage
  /// iff it cannot be created or written, another process has it open, or the index is too small;
  /// kFailure iff the system fails.
  static Outcome<std::unique_ptr<ArchiveFile>> open(const std::string& folder, const LocalMap& map,
                                                    const MapIdentity& identity, std::size_t blocks,
                                                    Arena& arena, const ArchiveContent* found);
  ArchiveFile(const ArchiveFile&) = delete;
  ArchiveFile& operator=(const ArchiveFile&) = delete;

  /// For a Mapper: its functions use no heap. The time for them depends on the system.
  [[nodiscard]] BlockArchive interface() noexcept { return archive_->interface(); }
  [[nodiscard]] StoredArchive& blocks() noexcept { return *archive_; }
  [[nodiscard]] const StoredArchive& blocks() const noexcept { return *archive_; }
  /// Reads what is kept of a block at a place of the index, also while blocks are evicted or
  /// reloaded in another thread: what is written stays until all is let go of. into: room for
  /// most_block_bytes and a checksum. The bytes read; none if they are not this block's.
  [[nodiscard]] std::size_t read_at_place(BlockKey key, std::uint32_t place,
                                          std::span<std::byte> into) const noexcept;

  /// Removes the file, whose blocks are not needed any more.
  void remove() const noexcept { ::unlink(path().c_str()); }
  /// Marks the file as complete, and syncs it to the disk.
  Outcome<void> complete(std::uint32_t revision);

  [[nodiscard]] std::uint64_t file_bytes() const noexcept { return records_.end(); }
  [[nodiscard]] const std::string& path() const noexcept { return records_.path(); }

 private:
  ArchiveFile() = default;
  [[nodiscard]] BlockStore store() noexcept;
  Outcome<void> fill_index(std::uint64_t whole_bytes);
  bool append(std::uint32_t mark, std::uint64_t key, std::span<const std::byte> payload) noexcept;

  RecordFile records_;
  StoredArchive* archive_ = nullptr;  ///< In the arena.
  std::span<std::byte> write_;        ///< A record.
  std::span<std::byte> read_;         ///< A payload and its checksum.
};

}  // namespace tessera
