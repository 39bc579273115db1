// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/record_file.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <memory>

#include "base/system_failure.hpp"
#include "tessera/base/internal/byte_io.hpp"
#include "tessera/base/internal/crc32.hpp"

namespace tessera {

namespace {

using namespace archive_format;

/// What is read at once.
constexpr std::size_t kPieceBytes = std::size_t{1} << 20U;

constexpr std::uint64_t whole_units(std::uint64_t bytes) noexcept {
  return (bytes + kUnitBytes - 1) / kUnitBytes * kUnitBytes;
}

/// Writes all of it, or returns why not.
int write_at(int file, std::uint64_t offset, std::span<const std::byte> bytes) noexcept {
  while (!bytes.empty()) {
    const ssize_t n = ::pwrite(file, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return n < 0 ? errno : EIO;
    bytes = bytes.subspan(static_cast<std::size_t>(n));
    offset += static_cast<std::uint64_t>(n);
  }
  return 0;
}

/// The bytes that were read: fewer where the file ends. Negative: the system failed.
ssize_t read_some(int file, std::uint64_t offset, std::span<std::byte> into) noexcept {
  std::size_t done = 0;
  while (done < into.size()) {
    const ssize_t n =
        ::pread(file, into.data() + done, into.size() - done, static_cast<off_t>(offset + done));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return -1;
    if (n == 0) break;
    done += static_cast<std::size_t>(n);
  }
  return static_cast<ssize_t>(done);
}

struct BytesSource {
  std::span<const std::byte> left;
  ByteSource source() {
    return {this, [](void* context, std::span<std::byte> into) {
              auto& self = *static_cast<BytesSource*>(context);
              const std::size_t n = std::min(self.left.size(), into.size());
              std::copy_n(self.left.begin(), n, into.begin());
              self.left = self.left.subspan(n);
              return n;
            }};
  }
};

}  // namespace

std::size_t write_record(std::uint32_t mark, std::uint64_t key, std::span<const std::byte> payload,
                         std::span<std::byte> into) noexcept {
  const auto bytes = static_cast<std::size_t>(record_bytes(payload.size(), kUnitBytes));
  ByteWriter head(into.first(kHeadBytes));
  head.u32(mark);
  head.u32(static_cast<std::uint32_t>(payload.size()));
  head.u64(key);
  head.u32(crc32c(head.written()));
  const std::span<std::byte> rest = into.subspan(kHeadBytes, bytes - kHeadBytes);
  std::ranges::copy(payload, rest.begin());
  std::ranges::fill(rest.subspan(payload.size()), std::byte{0});
  ByteWriter checksum(rest.subspan(payload.size()));
  checksum.u32(crc32c(rest.first(payload.size())));
  return bytes;
}

Outcome<RecordFile> RecordFile::begin(const Magic& magic, std::string path, FileDescriptor file,
                                      const LocalMap& map, const MapIdentity& identity) {
  std::vector<std::byte> bytes(kPreambleBytes);
  const ByteSink sink{&bytes, [](void* context, std::span<const std::byte> more) {
                        auto& all = *static_cast<std::vector<std::byte>*>(context);
                        all.insert(all.end(), more.begin(), more.end());
                        return true;
                      }};
  const BlockLookup nothing{nullptr,
                            [](void*, const KeyedIndex&) -> const Block* { return nullptr; }};
  const auto buffer = std::make_unique<MapFileBuffer>();
  const MapFileStatus saved =
      save(map, identity, std::span<const KeyedIndex>{}, nothing, *buffer, sink);
  if (!saved.ok())
    return Failure{path + " cannot be written: " + saved.what, FailureKind::kFailure};
  ByteWriter preamble{std::span(bytes).first(kPreambleBytes)};
  for (const char letter : magic) preamble.u8(static_cast<std::uint8_t>(letter));
  preamble.u16(kMajor);
  preamble.u16(kMinor);
  preamble.u32(static_cast<std::uint32_t>(bytes.size() - kPreambleBytes));
  preamble.u32(crc32c(preamble.written()));
  bytes.resize(whole_units(bytes.size()));
  const int error = ::ftruncate(file.get(), 0) != 0 ? errno : write_at(file.get(), 0, bytes);
  if (error != 0) return system_failure("write", path, error, FailureKind::kFailure);
  RecordFile made;
  made.path_ = std::move(path);
  made.file_ = std::move(file);
  made.begin_ = made.end_ = bytes.size();
  return made;
}

Outcome<RecordFile> RecordFile::resume(std::string path, FileDescriptor file, std::uint64_t end) {
  RecordFile made;
  std::array<std::byte, kPreambleBytes> preamble{};
  if (read_some(file.get(), 0, preamble) != static_cast<ssize_t>(kPreambleBytes))
    return system_failure("read", path, EIO, FailureKind::kFailure);
  ByteReader in{std::span(preamble).subspan(12)};
  made.begin_ = whole_units(kPreambleBytes + std::uint64_t{in.u32()});
  made.end_ = end;
  if (::ftruncate(file.get(), static_cast<off_t>(end)) != 0)
    return system_failure("write", path, errno, FailureKind::kUsage);
  made.path_ = std::move(path);
  made.file_ = std::move(file);
  return made;
}

bool RecordFile::append(std::span<const std::byte> records) noexcept {
  error_ = write_at(file_.get(), end_, records);
  if (error_ == 0) {
    end_ += records.size();
    return true;
  }
  // Otherwise a part of a record would count as damage later.
  static_cast<void>(!::ftruncate(file_.get(), static_cast<off_t>(end_)));
  return false;
}

bool RecordFile::read_at(std::uint64_t offset, std::span<std::byte> into) const noexcept {
  return read_some(file_.get(), offset, into) == static_cast<ssize_t>(into.size());
}

bool RecordFile::sync() noexcept {
  error_ = ::fdatasync(file_.get()) == 0 ? 0 : errno;
  return error_ == 0;
}

void RecordFile::clear() noexcept { cut_to(begin_); }

void RecordFile::cut_to(std::uint64_t end) noexcept {
  if (::ftruncate(file_.get(), static_cast<off_t>(end)) == 0) end_ = end;
}

// --- Reading -------------------------------------------------------------------------------------

Outcome<RecordHeader> read_record_header(const Magic& magic, int file, const std::string& path,
                                         const char* what) {
  using State = RecordHeader::State;
  std::array<std::byte, kPreambleBytes> preamble{};
  const ssize_t got = read_some(file, 0, preamble);
  if (got < 0) return system_failure("read", path, errno, FailureKind::kFailure);
  RecordHeader header;
  const auto none = [&](State state, const std::string& why) {
    header.state = state;
    header.what = path + ": " + why;
    return header;
  };
  ByteReader in(preamble);
  const bool ours = std::ranges::all_of(
      magic, [&](char letter) { return in.u8() == static_cast<std::uint8_t>(letter); });
  if (got < static_cast<ssize_t>(preamble.size()) || !ours)
    return none(State::kForeign, std::string("this is not ") + what);
  const std::uint16_t major = in.u16();
  static_cast<void>(in.u16());
  const std::uint32_t bytes = in.u32();
  if (in.u32() != crc32c(std::span(preamble).first(kPreambleBytes - kChecksumBytes)) ||
      bytes > kMostHeaderBytes)
    return none(State::kDamaged, "its first bytes are damaged");
  if (major != kMajor) return none(State::kOtherVersion, "it has another major version");
  header.begin = whole_units(kPreambleBytes + std::uint64_t{bytes});
  std::vector<std::byte> map_file(bytes);
  if (read_some(file, kPreambleBytes, map_file) < static_cast<ssize_t>(bytes))
    return none(State::kDamaged, "it ends inside its header");
  BytesSource source{map_file};
  const auto buffer = std::make_unique<MapFileBuffer>();
  const MapFileStatus status = load_header(source.source(), *buffer, header.map);
  if (!status.ok()) return none(State::kDamaged, std::string("its header: ") + status.what);
  return header;
}

RecordScan::RecordScan(int file, std::uint64_t begin, std::uint64_t end,
                       std::size_t most_payload_bytes)
    : file_(file),
      place_(begin),
      end_(end),
      most_record_(most_record_bytes(most_payload_bytes)),
      buffer_(std::max(kPieceBytes, 2 * most_record_)) {}

std::span<const std::byte> RecordScan::at(std::uint64_t offset, std::size_t bytes) {
  if (offset + bytes > end_) return {};
  if (offset < buffer_at_ || offset + bytes > buffer_at_ + buffered_) {
    const ssize_t got = read_some(file_, offset, buffer_);
    failed_ = failed_ || got < 0;
    buffer_at_ = offset;
    buffered_ = static_cast<std::size_t>(std::max<ssize_t>(got, 0));
    if (bytes > buffered_) return {};
  }
  return std::span(buffer_).subspan(static_cast<std::size_t>(offset - buffer_at_), bytes);
}

bool RecordScan::next_in_line(Record& record) {
  const std::span<const std::byte> head = at(place_, kHeadBytes);
  if (head.empty()) return false;
  ByteReader in(head);
  record.mark = in.u32();
  record.place = place_;
  const std::uint32_t payload_bytes = in.u32();
  record.key = in.u64();
  const std::uint64_t bytes = record_bytes(payload_bytes, kUnitBytes);
  if (in.u32() != crc32c(head.first(kHeadBytes - kChecksumBytes)) || bytes > most_record_)
    return false;
  const std::span<const std::byte> whole = at(place_, static_cast<std::size_t>(bytes));
  if (whole.empty()) return false;
  record.payload = whole.subspan(kHeadBytes, payload_bytes);
  ByteReader stored(whole.subspan(kHeadBytes + payload_bytes));
  if (stored.u32() != crc32c(record.payload)) return false;
  place_ += bytes;
  return true;
}

bool RecordScan::next(Record& record) {
  const std::uint64_t from = place_;
  while (place_ + kHeadBytes <= end_ && !failed_) {
    if (next_in_line(record)) {
      damaged_bytes_ += record.place - from;
      return true;
    }
    place_ += kUnitBytes;
  }
  place_ = from;
  return false;
}

}  // namespace tessera
