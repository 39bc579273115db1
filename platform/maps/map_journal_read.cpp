// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a journal holds.
#include <algorithm>
#include <cerrno>

#include "base/input_file.hpp"
#include "base/system_failure.hpp"
#include "maps/map_journal.hpp"
#include "settings/map_options.hpp"
#include "tessera/base/internal/byte_io.hpp"

namespace tessera {

namespace {

using namespace archive_format;

bool is_block(const Record& record) {
  return record.mark == kBlockMark && record.payload.size() > sizeof(std::uint64_t);
}

bool is_note(const Record& record) {
  return record.mark == kNoteMark && record.payload.size() == kJournalNoteBytes;
}

/// A block and where its record is.
struct Listed {
  std::uint64_t key = 0;
  std::uint64_t place = 0;
  friend auto operator<=>(const Listed&, const Listed&) = default;
};

/// Of each block the last.
void keep_last(std::vector<Listed>& all) {
  std::sort(all.begin(), all.end());
  const auto is_replaced = [](const Listed& a, const Listed& b) { return a.key == b.key; };
  // Backwards, so that the last of equal ones is the one that stays.
  all.erase(all.begin(), std::unique(all.rbegin(), all.rend(), is_replaced).base());
  std::sort(all.begin(), all.end(),
            [](const Listed& a, const Listed& b) { return a.place < b.place; });
}

/// Raises the map's revision to that of the latest of them: blocks may be later than the last note.
/// Returns how many no map can have.
Outcome<std::uint64_t> add_blocks(RecordScan& scan, const std::vector<Listed>& blocks,
                                  LocalMap& map, const std::string& path) {
  Record record;
  std::uint64_t left_out = 0;
  auto listed = blocks.begin();
  while (listed != blocks.end() && scan.next(record)) {
    if (record.place != listed->place) continue;
    ++listed;
    const MapFileStatus added = restore_block(record.payload, map);
    if (added.status == Status::kResourceExhausted)
      return Failure{path + " holds more than fits in memory; give a larger " +
                     kMapSettings["--memory"]};
    left_out += added.ok() ? 0U : 1U;
    if (added.ok())
      map.restore_revision(std::max(map.revision(), revision_of_stored(record.payload)));
  }
  return left_out;
}

}  // namespace

std::array<std::byte, kJournalNoteBytes> bytes_of(const JournalNote& note) {
  std::array<std::byte, kJournalNoteBytes> bytes{};
  ByteWriter out(bytes);
  out.u64(note.submap.first_scan);
  out.u64(note.submap.last_scan);
  out.f64(note.submap.length_m);
  out.u32(note.map_revision);
  out.u64(static_cast<std::uint64_t>(note.stamp_us));
  for (const double element : note.T_map_body) out.f64(element);
  out.u8(note.continues ? 1 : 0);
  out.u8(note.has_scan ? 1 : 0);
  return bytes;
}

JournalNote note_in(std::span<const std::byte> payload) {
  ByteReader in(payload);
  JournalNote note;
  note.submap.first_scan = in.u64();
  note.submap.last_scan = in.u64();
  note.submap.length_m = in.f64();
  note.map_revision = in.u32();
  note.stamp_us = static_cast<std::int64_t>(in.u64());
  for (double& element : note.T_map_body) element = in.f64();
  note.continues = in.u8() != 0;
  note.has_scan = in.u8() != 0;
  return note;
}

bool has_settings(const MapFileHeader& header, const MapConfig& config,
                  const ClassTable& classes) noexcept {
  const MapConfig& held = header.config;
  return held.resolution_m == config.resolution_m && held.prior == config.prior &&
         held.tuple == config.tuple && held.max_evidence == config.max_evidence &&
         held.free_weight == config.free_weight && header.classes == classes;
}

bool is_journal(const std::string& path) {
  Outcome<InputFile> file = InputFile::open(path);
  std::array<std::byte, kJournalMagic.size()> begin{};
  if (!file.ok() || !file->read_exactly(begin).ok()) return false;
  return std::equal(
      begin.begin(), begin.end(), kJournalMagic.begin(),
      [](std::byte byte, char letter) { return byte == static_cast<std::byte>(letter); });
}

Outcome<RecordHeader> inspect_journal(const std::string& path) {
  TESSERA_TRY_ASSIGN(const InputFile file, InputFile::open(path));
  return read_record_header(kJournalMagic, file.descriptor(), path, "a kept map");
}

Outcome<MapFileHeader> read_journal_header(const std::string& path) {
  TESSERA_TRY_ASSIGN(const RecordHeader header, inspect_journal(path));
  if (header.state != RecordHeader::State::kWhole) return Failure{header.what};
  return header.map;
}

Outcome<JournalContent> read_journal(const std::string& path, LocalMap* map, bool assumes_header) {
  using State = RecordHeader::State;
  TESSERA_TRY_ASSIGN(const InputFile file, InputFile::open(path));
  TESSERA_TRY_ASSIGN(const RecordHeader header,
                     read_record_header(kJournalMagic, file.descriptor(), path, "a kept map"));
  JournalContent content;
  content.has_header = header.state == State::kWhole;
  const bool is_damaged = header.state == State::kDamaged || header.state == State::kForeign;
  const bool may_assume = is_damaged && assumes_header && map != nullptr;
  if (!content.has_header && !may_assume) return Failure{header.what};
  content.header = header.map;
  if (content.has_header && map != nullptr &&
      !has_settings(content.header, map->config(), map->classes()))
    return Failure{path + " was made with other settings of the map or other classes"};
  const ClassTable& classes = content.has_header ? content.header.classes : map->classes();
  const std::size_t most = most_block_bytes(classes.num_components());
  const std::uint64_t first =
      content.has_header ? std::min(header.begin, file.size_bytes()) : std::uint64_t{0};
  RecordScan scan(file.descriptor(), first, file.size_bytes(), most);
  std::vector<Listed> blocks;
  Record record;
  content.whole_bytes = first;
  while (scan.next(record)) {
    if (is_block(record)) blocks.push_back({record.key, record.place});
    if (is_note(record)) {
      content.note = note_in(record.payload);
      content.damaged_bytes = scan.damaged_bytes();
    }
    content.whole_bytes = scan.place();
  }
  if (scan.failed()) return system_failure("read", path, EIO, FailureKind::kFailure);
  content.records = blocks.size();
  content.torn_bytes =
      file.size_bytes() - content.whole_bytes + scan.damaged_bytes() - content.damaged_bytes;
  keep_last(blocks);
  content.blocks = blocks.size();
  if (map == nullptr) return content;
  RecordScan again(file.descriptor(), first, content.whole_bytes, most);
  TESSERA_TRY_ASSIGN(content.left_out, add_blocks(again, blocks, *map, path));
  content.blocks -= content.left_out;
  if (content.note) map->restore_revision(std::max(map->revision(), content.note->map_revision));
  return content;
}

}  // namespace tessera
