// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map that is kept on disk while another thread maps into it: what has changed is appended to a
// file, block by block, and is durable when step() returns. Of a block the last record counts, so
// that evidence is there once. A crash damages at most what was appended since, and damage costs
// the blocks that it is in, which are then as an earlier record has them.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/arena_memory.hpp"
#include "maps/record_file.hpp"
#include "tessera/map/local_maps.hpp"
#include "tessera/map/map_reader.hpp"

namespace tessera {

/// What is kept beside the blocks: how far the map has come.
struct JournalNote {
  bool has_scan = false;  ///< Otherwise all but `continues` is of no account.
  SubmapNote submap{};
  std::uint32_t map_revision = 0;
  std::int64_t stamp_us = 0;            ///< Of the last scan, in the clock of the sensors.
  std::array<double, 12> T_map_body{};  ///< Then, as the elements of a Matrix34d in memory.
  bool continues = true;                ///< In the frame of the submap before.
  friend bool operator==(const JournalNote&, const JournalNote&) = default;
};

/// A note as bytes, and back.
inline constexpr std::size_t kJournalNoteBytes = 8 + 8 + 8 + 4 + 8 + 12 * 8 + 2;
std::array<std::byte, kJournalNoteBytes> bytes_of(const JournalNote& note);
JournalNote note_in(std::span<const std::byte> bytes);

/// What a file holds.
struct JournalContent {
  MapFileHeader header;
  std::optional<JournalNote> note;  ///< The last that is whole.
  std::uint64_t blocks = 0;
  std::uint64_t records = 0;        ///< Of blocks, including those that later ones replace.
  std::uint64_t left_out = 0;       ///< Of blocks that no map can have, though they are whole.
  bool has_header = true;           ///< False: it is damaged, and the map's settings were taken.
  std::uint64_t damaged_bytes = 0;  ///< In front of the last note that is whole.
  /// After it, and not whole: what is durable ends with a note, so these bytes are of an append
  /// that was not finished, as where power is lost.
  std::uint64_t torn_bytes = 0;
  std::uint64_t whole_bytes = 0;  ///< Up to the end of the last whole record.
};

/// Whether a map with these settings and classes is one of the header's.
[[nodiscard]] bool has_settings(const MapFileHeader& header, const MapConfig& config,
                                const ClassTable& classes) noexcept;

/// Whether a file begins as one of records does.
[[nodiscard]] bool is_journal(const std::string& path);
/// What stands before its records. Fails with kUsage or kFailure iff the file cannot be read.
Outcome<RecordHeader> inspect_journal(const std::string& path);
/// The header alone. Fails as read_journal without a map.
Outcome<MapFileHeader> read_journal_header(const std::string& path);

/// Reads a file, and adds its blocks to a map, which is empty and was made with these settings and
/// classes; null: none are added. Fails with kUsage iff it is missing, no such file, of another
/// major version, its header is damaged, or the map has other settings or classes or too little
/// room; kFailure iff the system fails. assumes_header: the file is known to be one, so that a
/// damaged header is taken to say what the map says. Reads the file twice; memory of 16 B a record.
Outcome<JournalContent> read_journal(const std::string& path, LocalMap* map,
                                     bool assumes_header = false);

/// For one thread, which is not that which maps.
class MapJournal {
 public:
  /// A file is rewritten when it is larger than this many times its size when it was new, plus
  /// kLeastGrowth_bytes.
  static constexpr std::uint64_t kMostGrowth = 3;
  static constexpr std::uint64_t kLeastGrowth_bytes = std::uint64_t{64} << 20U;

  /// Begins a file for a map: until the first step() has returned, what is at the path stays as it
  /// was. found: the map is what read_journal() has read there, and the file continues. The map
  /// must outlive this. Fails with kUsage or kFailure iff the system does.
  static Outcome<std::unique_ptr<MapJournal>> make(
      std::string path, const LocalMap& map, const MapIdentity& identity,
      const JournalContent* found, std::uint64_t least_growth_bytes = kLeastGrowth_bytes);
  ~MapJournal();
  MapJournal(const MapJournal&) = delete;
  MapJournal& operator=(const MapJournal&) = delete;

  /// Appends what has changed, and the note, and waits until it is on the disk; nothing if neither
  /// has. Fails with kFailure iff the system does;
  /// what was durable stays, and the next step tries again. O(index + changed blocks).
  Outcome<void> step(const JournalNote& note);
  /// The map was cleared: begins a file that has what is in the map now. As step().
  Outcome<void> begin_anew(const JournalNote& note);
  /// Removes the file: what it holds is kept elsewhere.
  void remove() noexcept;

  /// False: of what the last step() was to append, something was changed at every try, for a tenth
  /// of a second. The next one tries again.
  [[nodiscard]] bool is_whole() const noexcept { return is_whole_; }
  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  [[nodiscard]] std::uint64_t file_bytes() const noexcept { return file_.end(); }
  /// All that was appended.
  [[nodiscard]] std::uint64_t written_bytes() const noexcept { return written_bytes_; }
  /// Times that the file was rewritten, and that it could not be: it keeps growing then.
  [[nodiscard]] std::uint64_t renewals() const noexcept { return renewals_; }
  [[nodiscard]] std::uint64_t failed_renewals() const noexcept { return failed_renewals_; }

 private:
  MapJournal(std::string path, const LocalMap& map, const MapIdentity& identity);
  /// A walk over the index, for what is newer than since.
  struct Round {
    std::uint64_t since = 0;
    std::uint64_t start = 0;
    std::size_t page = 0;
    bool complete = true;
  };
  void begin_round(Round& round, std::uint64_t since) noexcept;
  bool walk(Round& round, std::size_t pages, RecordFile& into);
  bool read_busy(Round& round, RecordFile& into);
  bool put_block(BlockKey key, RecordFile& into, bool& read);
  bool put(std::uint32_t mark, std::uint64_t key, std::span<const std::byte> payload,
           RecordFile& into);
  bool flush(RecordFile& into);
  bool put_note(const JournalNote& note, RecordFile& into);
  Outcome<void> append_changes(const JournalNote& note);
  Outcome<void> begin_renewal();
  Outcome<void> renew(const JournalNote& note, std::size_t pages);
  Outcome<void> walk_on(const JournalNote& note, std::size_t pages);
  [[nodiscard]] Failure write_failure(const RecordFile& file) const;
  [[nodiscard]] std::string next_path() const { return path_ + ".new"; }

  std::string path_;
  MapIdentity identity_;
  /// For headers: the map itself is another thread's.
  ArenaMemory empty_memory_;
  LocalMap empty_{};
  MapReader reader_;
  RecordFile file_;  ///< None before the first step.
  bool has_file_ = false;
  bool is_whole_ = false;
  std::uint64_t least_growth_bytes_ = kLeastGrowth_bytes;
  std::uint64_t since_ = 0;  ///< Stamps of the map up to it are in the file.
  std::optional<JournalNote> last_note_;
  std::uint64_t new_bytes_ = 0;  ///< Of the file, when it was new.
  std::optional<RecordFile> next_;
  Round renewal_;
  std::vector<std::uint64_t> workspace_;
  std::vector<std::byte> block_;
  std::vector<std::byte> batch_;
  std::size_t batched_ = 0;
  std::vector<BlockNote> notes_;
  std::vector<BlockKey> busy_;  ///< Scratch: blocks that could not be read.
  std::uint64_t written_bytes_ = 0;
  std::uint64_t renewals_ = 0;
  std::uint64_t failed_renewals_ = 0;
};

}  // namespace tessera
