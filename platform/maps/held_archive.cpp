// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/held_archive.hpp"

#include <algorithm>
#include <filesystem>
#include <system_error>

namespace tessera {

std::string archive_path(const std::string& folder) {
  return (std::filesystem::path(folder) / ArchiveFile::kName).string();
}

Outcome<std::optional<ArchiveContent>> find_archive(const std::string& folder) {
  std::error_code error;
  if (folder.empty() || !std::filesystem::exists(archive_path(folder), error))
    return std::optional<ArchiveContent>();
  TESSERA_TRY_ASSIGN(const ArchiveContent content, ArchiveFile::inspect(archive_path(folder)));
  if (content.records == 0) return std::optional<ArchiveContent>();
  return std::optional(content);
}

std::size_t archive_blocks(const MapSetup& setup, const ArchiveContent* found) {
  constexpr std::size_t kBytesPerBlock = 26;
  const std::size_t by_budget = setup.budget_bytes / 16 / kBytesPerBlock;
  const std::size_t by_content =
      found != nullptr ? 2 * static_cast<std::size_t>(found->records) : 0;
  return std::max<std::size_t>({by_budget, by_content, 1024});
}

Outcome<HeldArchive> HeldArchive::make(const std::string& folder, const MapSetup& setup,
                                       const MapIdentity& identity, const ArchiveContent* found,
                                       Mapper& mapper) {
  const LocalMap& map = mapper.map();
  const std::size_t blocks = archive_blocks(setup, found);
  TESSERA_TRY_ASSIGN(ArenaMemory memory, ArenaMemory::allocate(ArchiveFile::required_bytes(
                                             map.config(), map.num_components(), blocks)));
  Arena arena(memory.span());
  TESSERA_TRY_ASSIGN(std::unique_ptr<ArchiveFile> file,
                     ArchiveFile::open(folder, map, identity, blocks, arena, found));
  mapper.set_archive(file->interface());
  return HeldArchive(std::move(memory), std::move(file));
}

}  // namespace tessera
