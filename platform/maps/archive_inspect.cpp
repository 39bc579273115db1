// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Reads an archive from its beginning: checks what it is, and finds its last complete record.
#include <fmt/core.h>

#include <algorithm>
#include <vector>

#include "base/input_file.hpp"
#include "maps/archive_file.hpp"
#include "maps/archive_format.hpp"
#include "settings/map_options.hpp"
#include "tessera/base/internal/byte_io.hpp"
#include "tessera/base/internal/crc32.hpp"

namespace tessera {

namespace {

using namespace archive_format;

Failure no_archive(const std::string& path, const std::string& what) {
  return {path + ": " + what + "; use another copy, or another folder for " +
          kMapSettings["--archive"]};
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

/// Reads preamble and header; returns the place where the records begin.
Outcome<std::uint64_t> read_header(InputFile& file, const std::string& path,
                                   MapFileHeader& header) {
  std::array<std::byte, kPreambleBytes> preamble{};
  TESSERA_TRY_ASSIGN(const std::size_t got, file.read(preamble));
  ByteReader in(preamble);
  const bool ours = std::ranges::all_of(
      kMagic, [&](char letter) { return in.u8() == static_cast<std::uint8_t>(letter); });
  if (got < preamble.size() || !ours) return no_archive(path, "this is not an archive of blocks");
  const std::uint16_t major = in.u16();
  static_cast<void>(in.u16());
  const std::uint32_t bytes = in.u32();
  if (in.u32() != crc32c(std::span(preamble).first(kPreambleBytes - kChecksumBytes)) ||
      bytes > kMostHeaderBytes)
    return no_archive(path, "the archive's first bytes are damaged");
  if (major != kMajor) return no_archive(path, "the archive has another major version");
  std::vector<std::byte> map_file(bytes);
  TESSERA_TRY_ASSIGN(const std::size_t body, file.read(map_file));
  if (body < bytes) return no_archive(path, "the archive ends inside its header");
  BytesSource source{map_file};
  const auto buffer = std::make_unique<MapFileBuffer>();
  const MapFileStatus status = load_header(source.source(), *buffer, header);
  if (!status.ok()) return no_archive(path, std::string("the archive's header: ") + status.what);
  const std::uint64_t end = kPreambleBytes + bytes;
  const std::uint64_t begin =
      (end + ArchiveFile::kUnitBytes - 1) / ArchiveFile::kUnitBytes * ArchiveFile::kUnitBytes;
  std::array<std::byte, ArchiveFile::kUnitBytes> padding{};
  TESSERA_TRY(file.read(std::span(padding).first(static_cast<std::size_t>(begin - end))));
  return begin;
}

/// The head of a block in its payload has its revision, after the key.
std::uint32_t revision_in(std::span<const std::byte> payload) {
  ByteReader in(payload.subspan(8));
  return in.u32();
}

struct Record {
  RecordHead head;
  std::span<const std::byte> payload;
};

/// Reads the next record; the value is false at the end, or if there is no complete one.
Outcome<bool> next_record(InputFile& file, std::vector<std::byte>& buffer, Record& record) {
  const std::span<std::byte> head = std::span(buffer).first(kHeadBytes);
  TESSERA_TRY_ASSIGN(const std::size_t got, file.read(head));
  ByteReader in(head);
  record.head = {.mark = in.u32(), .payload_bytes = in.u32(), .key = in.u64()};
  const bool whole = got == kHeadBytes && in.u32() == crc32c(head.first(kHeadBytes - 4)) &&
                     (record.head.mark == kBlockMark || record.head.mark == kDoneMark);
  const std::uint64_t bytes = record_bytes(record.head.payload_bytes, ArchiveFile::kUnitBytes);
  if (!whole || bytes > buffer.size()) return false;
  const std::span<std::byte> rest =
      std::span(buffer).subspan(kHeadBytes, static_cast<std::size_t>(bytes) - kHeadBytes);
  TESSERA_TRY_ASSIGN(const std::size_t more, file.read(rest));
  if (more < rest.size()) return false;
  record.payload = rest.first(record.head.payload_bytes);
  ByteReader stored(rest.subspan(record.head.payload_bytes));
  return stored.u32() == crc32c(record.payload) &&
         (record.head.mark == kDoneMark || record.payload.size() > 12);
}

}  // namespace

Outcome<ArchiveContent> ArchiveFile::inspect(const std::string& path) {
  TESSERA_TRY_ASSIGN(InputFile file, InputFile::open(path));
  ArchiveContent content;
  TESSERA_TRY_ASSIGN(const std::uint64_t begin, read_header(file, path, content.header));
  const std::uint64_t most =
      record_bytes(most_block_bytes(content.header.classes.num_components()), kUnitBytes);
  std::vector<std::byte> buffer(static_cast<std::size_t>(most));
  content.whole_bytes = std::min(begin, file.size_bytes());
  Record record;
  while (true) {
    TESSERA_TRY_ASSIGN(const bool more, next_record(file, buffer, record));
    if (!more) break;
    content.whole_bytes += record_bytes(record.head.payload_bytes, kUnitBytes);
    content.complete = record.head.mark == kDoneMark;
    if (content.complete) {
      content.revision = static_cast<std::uint32_t>(record.head.key);
    } else {
      ++content.records;
      content.revision = std::max(content.revision, revision_in(record.payload));
    }
  }
  content.torn_bytes = file.size_bytes() - content.whole_bytes;
  // Records are written one at a time: a crash cannot damage a record with more than one after it.
  if (content.torn_bytes > most) {
    return no_archive(path, fmt::format("a record is damaged (at byte {}), with more after it",
                                        content.whole_bytes));
  }
  content.complete = content.complete && content.torn_bytes == 0;
  return content;
}

}  // namespace tessera
