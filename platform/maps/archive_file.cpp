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

#include "base/system_failure.hpp"
#include "maps/archive_format.hpp"
#include "settings/map_options.hpp"
#include "tessera/base/internal/byte_io.hpp"
#include "tessera/base/internal/crc32.hpp"

namespace tessera {

namespace {

using namespace archive_format;

std::size_t most_record(int num_components) {
  return most_record_bytes(most_block_bytes(num_components));
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
  std::string path = (std::filesystem::path(folder) / kName).string();
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
  FileDescriptor file(::open(path.c_str(), flags, 0666));
  if (!file.is_open()) return system_failure("write", path, errno, FailureKind::kUsage);
  // The file is emptied after this, not when it is opened.
  if (::flock(file.get(), LOCK_EX | LOCK_NB) != 0) {
    return Failure{path + " is in use by another process; wait for it or choose another " +
                   kMapSettings["--archive"]};
  }
  TESSERA_TRY_ASSIGN(
      archive->records_,
      found == nullptr
          ? RecordFile::begin(kArchiveMagic, std::move(path), std::move(file), map, identity)
          : RecordFile::resume(std::move(path), std::move(file), found->whole_bytes));
  if (found != nullptr) TESSERA_TRY(archive->fill_index(found->whole_bytes));
  return archive;
}

Outcome<void> ArchiveFile::fill_index(std::uint64_t whole_bytes) {
  for (std::uint64_t at = records_.begin_of_records(); at < whole_bytes;) {
    std::array<std::byte, kHeadBytes> head{};
    if (!records_.read_at(at, head))
      return system_failure("read", path(), EIO, FailureKind::kFailure);
    ByteReader record(head);
    const std::uint32_t mark = record.u32();
    const std::uint32_t bytes = record.u32();
    const BlockKey key{record.u64()};
    if (mark == kBlockMark) {
      if (!archive_->list(key, static_cast<std::uint32_t>(at / kUnitBytes)))
        return Failure{path() + " holds more blocks than its index; give a larger " +
                       kMapSettings["--memory"]};
    }
    at += record_bytes(bytes, kUnitBytes);
  }
  return {};
}

bool ArchiveFile::append(std::uint32_t mark, std::uint64_t key,
                         std::span<const std::byte> payload) noexcept {
  const std::size_t bytes = write_record(mark, key, payload, write_);
  return records_.end() + bytes <= kMostBytes && records_.append(write_.first(bytes));
}

std::size_t ArchiveFile::read_at_place(BlockKey key, std::uint32_t place,
                                       std::span<std::byte> into) const noexcept {
  const std::uint64_t offset = std::uint64_t{place} * kUnitBytes;
  std::array<std::byte, kHeadBytes> head{};
  if (!records_.read_at(offset, head)) return 0;
  ByteReader in(head);
  const bool is_block = in.u32() == kBlockMark;
  const std::uint32_t bytes = in.u32();
  const bool is_its = in.u64() == key.bits;
  const bool whole = in.u32() == crc32c(std::span(head).first(kHeadBytes - kChecksumBytes));
  if (!is_block || !is_its || !whole || bytes + kChecksumBytes > into.size()) return 0;
  const std::span<std::byte> payload = into.first(bytes + kChecksumBytes);
  if (!records_.read_at(offset + kHeadBytes, payload)) return 0;
  ByteReader stored(payload.subspan(bytes));
  return stored.u32() == crc32c(payload.first(bytes)) ? bytes : 0;
}

BlockStore ArchiveFile::store() noexcept {
  return {
      .context = this,
      .put =
          [](void* context, BlockKey key, std::span<const std::byte> bytes, std::uint32_t& place) {
            auto& self = *static_cast<ArchiveFile*>(context);
            const auto end = static_cast<std::uint32_t>(self.records_.end() / kUnitBytes);
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
      .clear = [](void* context) { static_cast<ArchiveFile*>(context)->records_.clear(); }};
}

Outcome<void> ArchiveFile::complete(std::uint32_t revision) {
  if (!append(kDoneMark, revision, {}) || !records_.sync())
    return system_failure("write", path(), records_.error(), FailureKind::kFailure);
  return {};
}

}  // namespace tessera
