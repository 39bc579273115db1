// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/archive_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <system_error>
#include <vector>

#include "base/system_failure.hpp"
#include "maps/archive_format.hpp"
#include "settings/map_options.hpp"
#include "tessera/base/internal/byte_io.hpp"
#include "tessera/base/internal/crc32.hpp"

namespace tessera {

namespace {

using namespace archive_format;

std::size_t most_record(int num_components) {
  return static_cast<std::size_t>(
      record_bytes(most_block_bytes(num_components), ArchiveFile::kUnitBytes));
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

}  // namespace

std::size_t ArchiveFile::required_bytes(const MapConfig& map, int num_components,
                                        std::size_t blocks) {
  return StoredArchive::required_bytes(map, num_components, blocks) +
         2 * arena_bytes<std::byte>(most_record(num_components));
}

Outcome<std::unique_ptr<ArchiveFile>> ArchiveFile::open(const std::string& folder,
                                                        const LocalMap& map,
                                                        const MapIdentity& identity,
                                                        std::size_t blocks, Arena& arena,
                                                        const ArchiveContent* found) {
  std::unique_ptr<ArchiveFile> archive(new ArchiveFile);
  archive->path_ = (std::filesystem::path(folder) / kName).string();
  const Result<StoredArchive*> stored =
      StoredArchive::make(arena, map.config(), map.classes(), blocks, archive->store());
  archive->write_ = arena.take<std::byte>(most_record(map.num_components()));
  archive->read_ = arena.take<std::byte>(most_record(map.num_components()));
  if (!stored.ok() || archive->read_.empty())
    return Failure{"the archive's index does not fit; give a larger " + kMapSettings["--memory"]};
  archive->archive_ = *stored;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  const int flags = O_RDWR | O_CLOEXEC | (found == nullptr ? O_CREAT : 0);
  archive->file_ = FileDescriptor(::open(archive->path_.c_str(), flags, 0666));
  if (!archive->file_.is_open())
    return system_failure("write", archive->path_, errno, FailureKind::kUsage);
  if (::flock(archive->file_.get(), LOCK_EX | LOCK_NB) != 0) {
    return Failure{archive->path_ +
                   " is in use by another process; wait for it or choose another " +
                   kMapSettings["--archive"]};
  }
  TESSERA_TRY(found == nullptr ? archive->create(map, identity)
                               : archive->fill_index(found->whole_bytes));
  return archive;
}

Outcome<void> ArchiveFile::create(const LocalMap& map, const MapIdentity& identity) {
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
    return Failure{path_ + " cannot be written: " + saved.what, FailureKind::kFailure};
  ByteWriter preamble{std::span(bytes).first(kPreambleBytes)};
  for (const char letter : kMagic) preamble.u8(static_cast<std::uint8_t>(letter));
  preamble.u16(kMajor);
  preamble.u16(kMinor);
  preamble.u32(static_cast<std::uint32_t>(bytes.size() - kPreambleBytes));
  preamble.u32(crc32c(preamble.written()));
  bytes.resize((bytes.size() + kUnitBytes - 1) / kUnitBytes * kUnitBytes);
  // Not on opening, which is before the lock.
  const int error = ::ftruncate(file_.get(), 0) != 0 ? errno : write_at(file_.get(), 0, bytes);
  if (error != 0) return system_failure("write", path_, error, FailureKind::kFailure);
  begin_ = end_ = bytes.size();
  return {};
}

Outcome<void> ArchiveFile::fill_index(std::uint64_t whole_bytes) {
  std::array<std::byte, kPreambleBytes> preamble{};
  if (!read_at(0, preamble)) return system_failure("read", path_, EIO, FailureKind::kFailure);
  ByteReader in{std::span(preamble).subspan(12)};
  const std::uint64_t header_end = kPreambleBytes + std::uint64_t{in.u32()};
  begin_ = end_ = (header_end + kUnitBytes - 1) / kUnitBytes * kUnitBytes;
  while (end_ < whole_bytes) {
    std::array<std::byte, kHeadBytes> head{};
    if (!read_at(end_, head)) return system_failure("read", path_, EIO, FailureKind::kFailure);
    ByteReader record(head);
    const std::uint32_t mark = record.u32();
    const std::uint32_t bytes = record.u32();
    const BlockKey key{record.u64()};
    if (mark == kBlockMark) {
      if (!archive_->list(key, static_cast<std::uint32_t>(end_ / kUnitBytes)))
        return Failure{path_ + " holds more blocks than its index; give a larger " +
                       kMapSettings["--memory"]};
    }
    end_ += record_bytes(bytes, kUnitBytes);
  }
  if (::ftruncate(file_.get(), static_cast<off_t>(end_)) != 0)
    return system_failure("write", path_, errno, FailureKind::kFailure);
  return {};
}

bool ArchiveFile::append(std::uint32_t mark, std::uint64_t key,
                         std::span<const std::byte> payload) noexcept {
  const std::size_t payload_bytes = payload.size();
  const auto bytes = static_cast<std::size_t>(record_bytes(payload_bytes, kUnitBytes));
  if (end_ + bytes > kMostBytes) {
    error_ = EFBIG;
    return false;
  }
  ByteWriter head(write_.first(kHeadBytes));
  head.u32(mark);
  head.u32(static_cast<std::uint32_t>(payload_bytes));
  head.u64(key);
  head.u32(crc32c(head.written()));
  const std::span<std::byte> rest = write_.subspan(kHeadBytes, bytes - kHeadBytes);
  std::ranges::copy(payload, rest.begin());
  std::ranges::fill(rest.subspan(payload_bytes), std::byte{0});
  ByteWriter checksum(rest.subspan(payload_bytes));
  checksum.u32(crc32c(rest.first(payload_bytes)));
  error_ = write_at(file_.get(), end_, write_.first(bytes));
  if (error_ == 0) {
    end_ += bytes;
    return true;
  }
  // Otherwise a part of the record would count as damage later.
  static_cast<void>(!::ftruncate(file_.get(), static_cast<off_t>(end_)));
  return false;
}

bool ArchiveFile::read_at(std::uint64_t offset, std::span<std::byte> into) const noexcept {
  while (!into.empty()) {
    const ssize_t n = ::pread(file_.get(), into.data(), into.size(), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    into = into.subspan(static_cast<std::size_t>(n));
    offset += static_cast<std::uint64_t>(n);
  }
  return true;
}

std::size_t ArchiveFile::read_at_place(BlockKey key, std::uint32_t place,
                                       std::span<std::byte> into) const noexcept {
  const std::uint64_t offset = std::uint64_t{place} * kUnitBytes;
  std::array<std::byte, kHeadBytes> head{};
  if (!read_at(offset, head)) return 0;
  ByteReader in(head);
  const bool is_block = in.u32() == kBlockMark;
  const std::uint32_t bytes = in.u32();
  const bool is_its = in.u64() == key.bits;
  const bool whole = in.u32() == crc32c(std::span(head).first(kHeadBytes - kChecksumBytes));
  if (!is_block || !is_its || !whole || bytes + kChecksumBytes > into.size()) return 0;
  const std::span<std::byte> payload = into.first(bytes + kChecksumBytes);
  if (!read_at(offset + kHeadBytes, payload)) return 0;
  ByteReader stored(payload.subspan(bytes));
  return stored.u32() == crc32c(payload.first(bytes)) ? bytes : 0;
}

BlockStore ArchiveFile::store() noexcept {
  return {
      .context = this,
      .put =
          [](void* context, BlockKey key, std::span<const std::byte> bytes, std::uint32_t& place) {
            auto& self = *static_cast<ArchiveFile*>(context);
            const auto end = static_cast<std::uint32_t>(self.end_ / kUnitBytes);
            if (!self.append(kBlockMark, key.bits, bytes)) return false;
            place = end;
            return true;
          },
      .get = [](void* context, BlockKey key, std::uint32_t place,
                std::span<std::byte> into) -> std::size_t {
        const auto& self = *static_cast<const ArchiveFile*>(context);
        const std::size_t bytes = self.read_at_place(key, place, self.read_);
        if (bytes > into.size()) return 0;
        std::ranges::copy(self.read_.first(bytes), into.begin());
        return bytes;
      },
      .clear = [](void* context) { static_cast<ArchiveFile*>(context)->clear(); }};
}

/// If the file cannot be cut, what follows is written behind what nobody asks for any more.
void ArchiveFile::clear() noexcept {
  if (::ftruncate(file_.get(), static_cast<off_t>(begin_)) == 0) end_ = begin_;
}

Outcome<void> ArchiveFile::complete(std::uint32_t revision) {
  if (!append(kDoneMark, revision, {}))
    return system_failure("write", path_, error_, FailureKind::kFailure);
  if (::fsync(file_.get()) != 0)
    return system_failure("write", path_, errno, FailureKind::kFailure);
  return {};
}

}  // namespace tessera
