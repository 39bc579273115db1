// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/stored_map.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cstring>
#include <string_view>

#include "base/input_file.hpp"
#include "maps/map_journal.hpp"

namespace tessera {

namespace {

/// A byte source of the library that reads a file.
struct FileSource {
  InputFile file;
  std::uint64_t left = ~std::uint64_t{0};  ///< Bytes before the part ends.
  std::string error;  ///< Not empty if the system failed before the file ended.

  ByteSource source() {
    return {this, [](void* context, std::span<std::byte> into) -> std::size_t {
              auto& self = *static_cast<FileSource*>(context);
              const std::size_t most = std::min<std::uint64_t>(into.size(), self.left);
              const Outcome<std::size_t> n = self.file.read(into.first(most));
              if (n.ok()) {
                self.left -= *n;
                return *n;
              }
              self.error = n.failure().text();
              return 0;
            }};
  }
};

/// Most storage that a file of this size can need: the smallest stored octet takes 7 bytes.
std::uint64_t most_storage(std::uint64_t file_bytes) {
  return file_bytes * 512 + (std::uint64_t{1} << 20U);
}

constexpr FilePart kWhole{0, ~std::uint64_t{0}};

Outcome<FileSource> open_source(const std::string& path, const FilePart& part = kWhole) {
  TESSERA_TRY_ASSIGN(InputFile file, InputFile::open(path));
  if (part.offset_bytes != 0) file.skip_to(part.offset_bytes);
  return FileSource{std::move(file), part.bytes, {}};
}

Outcome<MapFileHeader> load_header_of(const std::string& path, const FilePart& part) {
  TESSERA_TRY_ASSIGN(FileSource file, open_source(path, part));
  const auto buffer = std::make_unique<MapFileBuffer>();
  MapFileHeader header;
  const MapFileStatus status = load_header(file.source(), *buffer, header);
  if (!status.ok()) return damaged_file(path, status);
  if (header.config.storage_bytes > most_storage(std::min(file.file.size_bytes(), part.bytes))) {
    return damaged_file(
        path, {Status::kCorrupt, "the file is truncated, or its header claims more than it holds",
               status.offset_bytes});
  }
  return header;
}

Outcome<bool> load_into(const std::string& path, const FilePart& part, LocalMap& map) {
  TESSERA_TRY_ASSIGN(FileSource file, open_source(path, part));
  const auto buffer = std::make_unique<MapFileBuffer>();
  MapFileHeader header;
  MapFileStatus status = load_header(file.source(), *buffer, header);
  if (status.ok() && header.identity.kind == MapKind::kSubmaps)
    return Failure{path +
                   " is in submaps and cannot be continued; give a map that is in one piece"};
  if (status.ok()) status = load_blocks(file.source(), header, *buffer, map);
  if (!file.error.empty()) return Failure{file.error, FailureKind::kFailure};
  if (status.status == Status::kResourceExhausted) return false;
  if (!status.ok()) return damaged_file(path, status);
  return true;
}

Outcome<std::unique_ptr<StoredMap>> load_part(const std::string& path, const FilePart& part,
                                              std::size_t storage_bytes) {
  TESSERA_TRY_ASSIGN(MapFileHeader header, load_header_of(path, part));
  auto stored = std::make_unique<StoredMap>();
  stored->header = header;
  MapConfig config = header.config;
  if (storage_bytes > config.storage_bytes) config.storage_bytes = storage_bytes;
  TESSERA_TRY_ASSIGN(ArenaMemory memory, ArenaMemory::allocate(required_bytes(config)));
  stored->memory = std::move(memory);
  Arena arena(stored->memory.span());
  Result<LocalMap> map = LocalMap::make(arena, config, header.classes);
  if (!map.ok())
    return Failure{
        path + ": the header has a setting out of range; make the map again or use another copy"};
  stored->map = std::move(*map);
  TESSERA_TRY_ASSIGN(const bool loaded, load_into(path, part, stored->map));
  if (!loaded) {
    return Failure{path +
                   ": the file has more than its header says; make the map again or use "
                   "another copy"};
  }
  return stored;
}

/// The value is false iff the map's storage is too small.
Outcome<bool> read_into(const std::string& path, LocalMap& map) {
  const Outcome<JournalContent> read = read_journal(path, &map);
  if (read.ok()) return true;
  const MapUsage usage = map.usage();
  if (usage.blocks_refused + usage.storage_refused != 0) return false;
  return read.failure();
}

/// How much storage its map needs is not known before it is read.
Outcome<std::unique_ptr<StoredMap>> load_journal(const std::string& path,
                                                 std::size_t storage_bytes) {
  TESSERA_TRY_ASSIGN(const JournalContent content, read_journal(path, nullptr));
  auto stored = std::make_unique<StoredMap>();
  stored->header = content.header;
  MapConfig& config = stored->header.config;
  bool is_known = false;
  for (std::uint64_t wanted = std::max<std::uint64_t>(content.whole_bytes, storage_bytes);;) {
    constexpr std::uint64_t kSpare = 64 * SlabPool::kPageBytes;
    config.storage_bytes =
        std::min<std::uint64_t>((wanted + kSpare) / SlabPool::kPageBytes * SlabPool::kPageBytes,
                                MapConfig::kMaxStorageBytes);
    TESSERA_TRY_ASSIGN(stored->memory, ArenaMemory::allocate(required_bytes(config)));
    Arena arena(stored->memory.span());
    Result<LocalMap> map = LocalMap::make(arena, config, content.header.classes);
    if (!map.ok()) return Failure{path + ": the header has a setting out of range"};
    stored->map = std::move(*map);
    TESSERA_TRY_ASSIGN(const bool fits, read_into(path, stored->map));
    if (!fits && config.storage_bytes == MapConfig::kMaxStorageBytes)
      return Failure{path + " holds more than a map can"};
    const std::uint64_t used = stored->map.usage().used_bytes;
    if (fits && (is_known || used + kSpare >= config.storage_bytes / 2)) break;
    // Once more, in what it takes.
    is_known = fits;
    wanted = fits ? std::max<std::uint64_t>(used, storage_bytes) : 2 * wanted;
  }
  stored->header.revision = stored->map.revision();
  stored->header.content.blocks = stored->map.block_count();
  return stored;
}

}  // namespace

Failure damaged_file(const std::string& path, const MapFileStatus& status) {
  if (std::string_view(status.what) == MapFileStatus::kOtherFile)
    return {path + ": " + status.what +
            " (.tsm); of maps of other programs, .bt and .ot are read, as a prior map"};
  return {fmt::format("{}: {} ({} at byte {}); make the map again or use another copy", path,
                      status.what, to_string(status.status), status.offset_bytes)};
}

Outcome<MapFileHeader> load_map_header(const std::string& path) {
  if (is_journal(path)) return read_journal_header(path);
  return load_header_of(path, kWhole);
}

Outcome<MapFileHeader> load_whole_header(const std::string& path) {
  if (is_journal(path)) return read_journal_header(path);
  TESSERA_TRY_ASSIGN(MapFileHeader header, load_header_of(path, kWhole));
  TESSERA_TRY_ASSIGN(InputFile file, InputFile::open(path));
  const std::uint64_t bytes = file.size_bytes();
  std::array<std::byte, kMapFileEndBytes> end{};
  if (bytes >= header.header_bytes + end.size()) {
    file.skip_to(bytes - end.size());
    TESSERA_TRY(file.read_exactly(end));
    if (is_end_of(header, end)) return header;
  }
  return damaged_file(path, {Status::kTruncated, "the file does not end with its end mark", bytes});
}

Json recorded_setting(const MapFileHeader& header, const char* key) {
  const std::string text(header.identity.settings.data(), header.identity.settings_bytes);
  const Json settings = Json::parse(text, nullptr, false);
  return settings.is_object() && settings.contains(key) ? settings[key] : Json();
}

Outcome<void> record_settings(const Json& config, MapIdentity& identity) {
  const auto text_of = [](const Json& json) {
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
  };
  std::string text = text_of(config);
  if (text.size() > MapIdentity::kMaxSettings && config.contains("kernels")) {
    Json shorter = config;
    shorter["kernels"] = "of a file, too many to be listed";
    text = text_of(shorter);
  }
  if (text.size() > MapIdentity::kMaxSettings) {
    return Failure{"the paths given are too long for the map's record; use shorter ones"};
  }
  std::memcpy(identity.settings.data(), text.data(), text.size());
  identity.settings_bytes = static_cast<std::uint32_t>(text.size());
  return {};
}

Outcome<bool> load_into(const std::string& path, LocalMap& map) {
  if (is_journal(path)) return read_into(path, map);
  return load_into(path, kWhole, map);
}

Outcome<std::unique_ptr<StoredMap>> load_map(const std::string& path, std::size_t storage_bytes) {
  if (is_journal(path)) return load_journal(path, storage_bytes);
  return load_part(path, kWhole, storage_bytes);
}

Outcome<std::unique_ptr<StoredMap>> load_map(const std::string& path, const FilePart& part) {
  return load_part(path, part, 0);
}

Outcome<std::uint64_t> append_map(const LocalMap& map, const MapIdentity& identity,
                                  const SavedBlocks& saved, AtomicFile& file) {
  struct Target {
    AtomicFile& file;
    bool refused = false;
  } target{file};
  const ByteSink sink{&target, [](void* context, std::span<const std::byte> bytes) {
                        auto& self = *static_cast<Target*>(context);
                        self.refused = !self.file.write(bytes) || self.refused;
                        return !self.refused;
                      }};
  const auto buffer = std::make_unique<MapFileBuffer>();
  const MapFileStatus status =
      save(map, identity, saved.blocks, saved.lookup, *buffer, sink, &saved.summary);
  if (!status.ok() && !target.refused)
    return Failure{file.path() + " cannot be written: " + status.what, FailureKind::kFailure};
  return status.offset_bytes;
}

Outcome<AppendedMap> append_map(const LocalMap& map, const MapIdentity& identity,
                                AtomicFile& file) {
  AppendedMap appended;
  std::vector<KeyedIndex> workspace = workspace_for(map);
  appended.summary = summarize(map, workspace);
  BlocksInMemory blocks(map);
  TESSERA_TRY_ASSIGN(
      appended.bytes,
      append_map(map, identity, {map.blocks_in_order(workspace), blocks.lookup(), appended.summary},
                 file));
  return appended;
}

Outcome<void> save_map(const LocalMap& map, const MapIdentity& identity,
                       std::span<const KeyedIndex> blocks, const BlockLookup& lookup,
                       const MapSummary& summary, const std::string& path) {
  TESSERA_TRY_ASSIGN(AtomicFile file, AtomicFile::open(path));
  TESSERA_TRY(append_map(map, identity, {blocks, lookup, summary}, file));
  return file.commit();
}

Outcome<MapSummary> save_map(const LocalMap& map, const MapIdentity& identity,
                             std::span<KeyedIndex> workspace, const std::string& path) {
  const MapSummary summary = summarize(map, workspace);
  BlocksInMemory blocks(map);
  TESSERA_TRY(
      save_map(map, identity, map.blocks_in_order(workspace), blocks.lookup(), summary, path));
  return summary;
}

std::vector<KeyedIndex> workspace_for(const LocalMap& map) {
  return std::vector<KeyedIndex>(2 * map.block_count());
}

}  // namespace tessera
