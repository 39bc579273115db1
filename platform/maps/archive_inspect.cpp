// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Reads an archive from its beginning: checks what it is, and finds its last complete record.
#include <fmt/core.h>

#include <algorithm>
#include <cerrno>

#include "base/input_file.hpp"
#include "base/system_failure.hpp"
#include "maps/archive_file.hpp"
#include "settings/map_options.hpp"

namespace tessera {

namespace {

using namespace archive_format;

Failure no_archive(const Message& what) {
  return Failure{what + "; use another copy, or another folder for " + kMapSettings["--archive"]};
}

}  // namespace

Outcome<ArchiveContent> ArchiveFile::inspect(const std::string& path) {
  TESSERA_TRY_ASSIGN(const InputFile file, InputFile::open(path));
  ArchiveContent content;
  TESSERA_TRY_ASSIGN(const RecordHeader header, read_record_header(kArchiveMagic, file.descriptor(),
                                                                   path, "an archive of blocks"));
  if (header.state != RecordHeader::State::kWhole) return no_archive(header.what);
  content.header = header.map;
  const std::size_t most = most_block_bytes(content.header.classes.num_components());
  RecordScan scan(file.descriptor(), std::min(header.begin, file.size_bytes()), file.size_bytes(),
                  most);
  content.whole_bytes = scan.place();
  Record record;
  while (scan.next_in_line(record)) {
    const bool is_block = record.mark == kBlockMark && record.payload.size() > 12;
    if (!is_block && record.mark != kDoneMark) break;
    content.whole_bytes = scan.place();
    content.complete = !is_block;
    if (content.complete) {
      content.revision = static_cast<std::uint32_t>(record.key);
    } else {
      ++content.records;
      content.revision = std::max(content.revision, revision_of_stored(record.payload));
    }
  }
  if (scan.failed()) return system_failure("read", path, EIO, FailureKind::kFailure);
  content.torn_bytes = file.size_bytes() - content.whole_bytes;
  // Records are written one at a time: a crash cannot damage a record with more than one after it.
  if (content.torn_bytes > most_record_bytes(most)) {
    return no_archive(fmt::format("{}: a record is damaged (at byte {}), with more after it", path,
                                  content.whole_bytes));
  }
  content.complete = content.complete && content.torn_bytes == 0;
  return content;
}

}  // namespace tessera
