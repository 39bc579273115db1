// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A file of checksummed records that belong to a map: archives of moving windows, and maps that are
// kept while they are made. Records are appended and never changed. archive_format.hpp has the
// layout, docs/reference/memory.md byte by byte.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/file_descriptor.hpp"
#include "base/outcome.hpp"
#include "maps/archive_format.hpp"
#include "tessera/map/stored_block.hpp"

namespace tessera {

/// A record in memory; the payload lies in the buffer of its reader.
struct Record {
  std::uint32_t mark = 0;
  std::uint64_t key = 0;
  std::span<const std::byte> payload;
  std::uint64_t place = 0;  ///< Offset in the file.
};

/// Bytes of a record with a payload of at most payload_bytes, in a buffer.
constexpr std::size_t most_record_bytes(std::size_t payload_bytes) noexcept {
  return static_cast<std::size_t>(
      archive_format::record_bytes(payload_bytes, archive_format::kUnitBytes));
}

/// Writes a record into the front of into, which must have room for it; its size.
std::size_t write_record(std::uint32_t mark, std::uint64_t key, std::span<const std::byte> payload,
                         std::span<std::byte> into) noexcept;

class RecordFile {
 public:
  RecordFile() = default;
  /// Empties the file, which is open for reading and writing, and writes what stands before the
  /// records. Fails with kFailure iff the system does.
  static Outcome<RecordFile> begin(const archive_format::Magic& magic, std::string path,
                                   FileDescriptor file, const LocalMap& map,
                                   const MapIdentity& identity);
  /// For a file that begins so already, and has whole records up to end; the rest is cut off. Fails
  /// with kFailure or kUsage iff the system does.
  static Outcome<RecordFile> resume(std::string path, FileDescriptor file, std::uint64_t end);

  /// Appends what write_record() wrote, one record or several. False: nothing was, and error()
  /// says why.
  bool append(std::span<const std::byte> records) noexcept;
  bool read_at(std::uint64_t offset, std::span<std::byte> into) const noexcept;
  /// Lets go of what was appended since the file ended there.
  void cut_to(std::uint64_t end) noexcept;
  /// Waits until all is on the disk. False: error() says why.
  bool sync() noexcept;
  /// Lets go of all records. If the file cannot be cut, what follows is written behind them.
  void clear() noexcept;

  /// The file was renamed.
  void set_path(std::string path) { path_ = std::move(path); }
  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  [[nodiscard]] std::uint64_t begin_of_records() const noexcept { return begin_; }
  [[nodiscard]] std::uint64_t end() const noexcept { return end_; }
  /// An errno: why the last write or sync failed.
  [[nodiscard]] int error() const noexcept { return error_; }

 private:
  std::string path_;
  FileDescriptor file_;
  std::uint64_t begin_ = 0;
  std::uint64_t end_ = 0;
  int error_ = 0;
};

/// What stands before the records of a file.
struct RecordHeader {
  enum class State : std::uint8_t { kWhole, kForeign, kOtherVersion, kDamaged };
  State state = State::kWhole;
  std::string what;         ///< What is wrong, for a message.
  std::uint64_t begin = 0;  ///< Of the records.
  MapFileHeader map{};      ///< Of their map.
};

/// Fails with kFailure iff the system does. what: "an archive", for the message.
Outcome<RecordHeader> read_record_header(const archive_format::Magic& magic, int file,
                                         const std::string& path, const char* what);

/// Reads records in the order of the file, in large pieces.
class RecordScan {
 public:
  /// Of the bytes from begin to end of an open file. most_payload_bytes: a longer record is damage.
  RecordScan(int file, std::uint64_t begin, std::uint64_t end, std::size_t most_payload_bytes);

  /// The next record that is whole. What is damaged is skipped and counted. False: there is
  /// none.
  bool next(Record& record);
  /// The next record, if it is whole. False: it is not, or there is none.
  bool next_in_line(Record& record);

  /// Where the record after the last one begins, if it follows at once.
  [[nodiscard]] std::uint64_t place() const noexcept { return place_; }
  /// Bytes that next() skipped in front of records.
  [[nodiscard]] std::uint64_t damaged_bytes() const noexcept { return damaged_bytes_; }
  /// The system could not read; then there are no further records.
  [[nodiscard]] bool failed() const noexcept { return failed_; }

 private:
  [[nodiscard]] std::span<const std::byte> at(std::uint64_t offset, std::size_t bytes);

  int file_;
  std::uint64_t place_;
  std::uint64_t end_;
  std::size_t most_record_;
  std::vector<std::byte> buffer_;
  std::uint64_t buffer_at_ = 0;
  std::size_t buffered_ = 0;
  std::uint64_t damaged_bytes_ = 0;
  bool failed_ = false;
};

}  // namespace tessera
