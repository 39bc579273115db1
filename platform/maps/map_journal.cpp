// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/map_journal.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>

#include "base/input_file.hpp"
#include "base/new_file.hpp"
#include "base/system_failure.hpp"
#include "maps/empty_map.hpp"
#include "settings/map_options.hpp"
#include "tessera/base/internal/byte_io.hpp"

namespace tessera {

namespace {

using namespace archive_format;

/// Records that are written at once.
constexpr std::size_t kBatchBytes = std::size_t{1} << 20U;
/// Pages of the map's index that a renewal walks over in a step.
constexpr std::size_t kPagesAtOnce = 32;
/// For a block that is changed at every try.
constexpr int kMostPauses = 100;
constexpr unsigned kPause_us = 1'000;

}  // namespace

MapJournal::MapJournal(std::string path, const LocalMap& map, const MapIdentity& identity)
    : path_(std::move(path)),
      identity_(identity),
      reader_(map),
      workspace_(reader_.snapshot_bytes() / sizeof(std::uint64_t) + 1),
      block_(most_block_bytes(map.num_components())),
      batch_(kBatchBytes + most_record_bytes(most_block_bytes(map.num_components()))),
      notes_(MapReader::kPageBlocks) {
  identity_.settings_bytes = 0;
}

MapJournal::~MapJournal() {
  if (next_) ::unlink(next_path().c_str());
}

Outcome<std::unique_ptr<MapJournal>> MapJournal::make(std::string path, const LocalMap& map,
                                                      const MapIdentity& identity,
                                                      const JournalContent* found,
                                                      std::uint64_t least_growth_bytes) {
  std::unique_ptr<MapJournal> made(new MapJournal(std::move(path), map, identity));
  made->least_growth_bytes_ = least_growth_bytes;
  TESSERA_TRY_ASSIGN(made->empty_, make_empty_map(map, made->empty_memory_));
  if (found == nullptr || !found->has_header) {
    TESSERA_TRY(made->begin_renewal());
    return made;
  }
  FileDescriptor file(::open(made->path_.c_str(), O_RDWR | O_CLOEXEC));
  if (!file.is_open()) return system_failure("write", made->path_, errno, FailureKind::kUsage);
  TESSERA_TRY_ASSIGN(made->file_,
                     RecordFile::resume(made->path_, std::move(file), found->whole_bytes));
  made->has_file_ = true;
  made->since_ = MapReader(map).stamp();
  // What it would have if it were new is not known; by the last record of each block about this.
  made->new_bytes_ = found->records == 0 ? 0 : found->whole_bytes / found->records * found->blocks;
  return made;
}

Failure MapJournal::write_failure(const RecordFile& file) const {
  return system_failure("write", file.path(), file.error(), FailureKind::kFailure);
}

bool MapJournal::flush(RecordFile& into) {
  if (batched_ == 0) return true;
  const bool written = into.append(std::span(batch_).first(batched_));
  written_bytes_ += written ? batched_ : 0;
  batched_ = 0;
  return written;
}

bool MapJournal::put(std::uint32_t mark, std::uint64_t key, std::span<const std::byte> payload,
                     RecordFile& into) {
  if (batched_ >= kBatchBytes && !flush(into)) return false;
  batched_ += write_record(mark, key, payload, std::span(batch_).subspan(batched_));
  return true;
}

bool MapJournal::put_note(const JournalNote& note, RecordFile& into) {
  return put(kNoteMark, 0, bytes_of(note), into) && flush(into);
}

/// read: false where the block was changed at every try.
bool MapJournal::put_block(BlockKey key, RecordFile& into, bool& read) {
  const Result<BlockSnapshot> block =
      reader_.snapshot(unpack(key), std::as_writable_bytes(std::span(workspace_)));
  read = block.ok();
  if (!block.ok()) return true;
  const std::size_t bytes = save_block(*block, block_);
  return bytes == 0 || put(kBlockMark, key.bits, std::span(block_).first(bytes), into);
}

void MapJournal::begin_round(Round& round, std::uint64_t since) noexcept {
  round = {.since = since, .start = reader_.stamp()};
}

/// Goes over at most this many pages of the index. False: the file cannot be written.
bool MapJournal::walk(Round& round, std::size_t pages, RecordFile& into) {
  const std::span<BlockNote, MapReader::kPageBlocks> notes(notes_);
  for (std::size_t i = 0; i < pages && round.page < reader_.pages(); ++i, ++round.page) {
    const Result<PageNotes> found = reader_.notes(round.page, 0, notes);
    if (!found.ok()) {
      round.complete = false;
      continue;
    }
    for (const BlockNote& note : notes.first(found->count)) {
      if (note.stamp <= round.since) continue;
      bool read = false;
      if (!put_block(note.key, into, read)) return false;
      if (!read) busy_.push_back(note.key);
    }
  }
  return read_busy(round, into);
}

/// Blocks in whose change the writer was interrupted: it continues when it has a processor again.
bool MapJournal::read_busy(Round& round, RecordFile& into) {
  for (int attempt = 0; attempt < kMostPauses && !busy_.empty(); ++attempt) {
    ::usleep(kPause_us);
    std::size_t left = 0;
    for (const BlockKey key : busy_) {
      bool read = false;
      if (!put_block(key, into, read)) return false;
      if (!read) busy_[left++] = key;
    }
    busy_.resize(left);
  }
  round.complete = round.complete && busy_.empty();
  busy_.clear();
  return true;
}

Outcome<void> MapJournal::append_changes(const JournalNote& note) {
  Round round;
  begin_round(round, since_);
  batched_ = 0;
  const std::uint64_t end = file_.end();
  if (!walk(round, reader_.pages() + 1, file_) || !put_note(note, file_) || !file_.sync()) {
    const Failure failure = write_failure(file_);
    // It is appended again.
    file_.cut_to(end);
    return failure;
  }
  // Otherwise all of it is read again.
  is_whole_ = round.complete;
  if (round.complete) since_ = round.start;
  last_note_ = note;
  return {};
}

Outcome<void> MapJournal::begin_renewal() {
  const std::string path = next_path();
  FileDescriptor file(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666));
  if (!file.is_open()) return system_failure("write", path, errno, FailureKind::kUsage);
  TESSERA_TRY_ASSIGN(RecordFile begun,
                     RecordFile::begin(kJournalMagic, path, std::move(file), empty_, identity_));
  next_.emplace(std::move(begun));
  begin_round(renewal_, 0);
  return {};
}

/// Reads on, and once all is read puts the new file in the place of the old one.
Outcome<void> MapJournal::renew(const JournalNote& note, std::size_t pages) {
  const Outcome<void> done = walk_on(note, pages);
  if (done.ok()) return done;
  next_.reset();
  ::unlink(next_path().c_str());
  return done;
}

Outcome<void> MapJournal::walk_on(const JournalNote& note, std::size_t pages) {
  batched_ = 0;
  // Brought to the disk piece by piece, so that the last one does not take long.
  if (!walk(renewal_, pages, *next_) || !flush(*next_) || !next_->sync())
    return write_failure(*next_);
  if (renewal_.page < reader_.pages()) return {};
  // What changed since this began, and what could not be read.
  Round rest;
  begin_round(rest, renewal_.complete ? renewal_.start : 0);
  if (!walk(rest, reader_.pages() + 1, *next_) || !put_note(note, *next_) || !next_->sync())
    return write_failure(*next_);
  if (::rename(next_path().c_str(), path_.c_str()) != 0)
    return system_failure("write", path_, errno, FailureKind::kFailure);
  sync_folder_of(path_);
  file_ = std::move(*next_);
  file_.set_path(path_);
  next_.reset();
  has_file_ = true;
  new_bytes_ = file_.end();
  last_note_ = note;
  is_whole_ = rest.complete;
  since_ = rest.complete ? rest.start : renewal_.start;
  if (!rest.complete && !renewal_.complete) since_ = 0;
  ++renewals_;
  return {};
}

Outcome<void> MapJournal::step(const JournalNote& note) {
  if (has_file_ && is_whole_ && !next_ && reader_.stamp() == since_ && last_note_ == note)
    return {};
  if (!has_file_) {
    if (!next_) TESSERA_TRY(begin_renewal());
    return renew(note, reader_.pages() + 1);
  }
  TESSERA_TRY(append_changes(note));
  const bool is_large = file_.end() > kMostGrowth * new_bytes_ + least_growth_bytes_;
  if (!next_ && !is_large) return {};
  // All of it is durable already, so that this may wait until the file has grown once more.
  const Outcome<void> begun = next_ ? Outcome<void>() : begin_renewal();
  if (begun.ok() && renew(note, kPagesAtOnce).ok()) return {};
  ++failed_renewals_;
  new_bytes_ = file_.end();
  return {};
}

Outcome<void> MapJournal::begin_anew(const JournalNote& note) {
  TESSERA_TRY(begin_renewal());
  return renew(note, reader_.pages() + 1);
}

void MapJournal::remove() noexcept {
  if (next_) ::unlink(next_path().c_str());
  next_.reset();
  ::unlink(path_.c_str());
  has_file_ = false;
}

}  // namespace tessera
