// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// An archive file with its memory, for a mapper with a window.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "base/arena_memory.hpp"
#include "maps/archive_file.hpp"
#include "settings/map_options.hpp"
#include "tessera/robot/mapper.hpp"

namespace tessera {

/// Path of the archive in the folder that a user names.
std::string archive_path(const std::string& folder);

/// The archive in the folder, if there is one and it holds blocks. Fails with kUsage iff its file
/// cannot be read or is not an archive.
Outcome<std::optional<ArchiveContent>> find_archive(const std::string& folder);

/// Capacity of the archive's index in blocks: as a sixteenth of the budget holds, and at least
/// twice the number of archived blocks. found: of an earlier run; null: none.
std::size_t archive_blocks(const MapSetup& setup, const ArchiveContent* found);

class HeldArchive {
 public:
  /// Opens the file in the folder for archive_blocks(setup, found) blocks, and gives it to the
  /// mapper. Fails as ArchiveFile::open, and with kFailure iff the system does not give the memory.
  static Outcome<HeldArchive> make(const std::string& folder, const MapSetup& setup,
                                   const MapIdentity& identity, const ArchiveContent* found,
                                   Mapper& mapper);
  [[nodiscard]] ArchiveFile& operator*() const { return *file_; }
  [[nodiscard]] ArchiveFile* operator->() const { return file_.get(); }
  [[nodiscard]] std::size_t memory_bytes() const { return memory_.span().size(); }

 private:
  HeldArchive(ArenaMemory memory, std::unique_ptr<ArchiveFile> file)
      : memory_(std::move(memory)), file_(std::move(file)) {}

  ArenaMemory memory_;
  std::unique_ptr<ArchiveFile> file_;
};

}  // namespace tessera
