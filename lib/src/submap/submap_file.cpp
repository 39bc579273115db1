// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/submap/submap_file.hpp"

#include "tessera/base/internal/byte_io.hpp"
#include "tessera/base/internal/crc32.hpp"
#include "tessera/base/internal/digest.hpp"
#include "tessera/base/internal/rigid_code_io.hpp"

namespace tessera {

namespace {

constexpr std::uint32_t kTableMark = 0x53424d54U;
constexpr double kMostLength_m = 1e9;

void put(const SubmapRow& row, ByteWriter& to) noexcept {
  for (const std::uint32_t word : {row.number, row.revision, row.first_scan, row.last_scan})
    to.u32(word);
  to.f64(row.length_m);
  write_rigid_code(to, row.T_map_submap);
  for (const std::uint64_t word :
       {row.offset_bytes, row.bytes, row.digest, row.label_voxels, row.free_voxels, row.occupied})
    to.u64(word);
}

/// False: such a row is never written.
bool read(ByteReader& from, SubmapRow& row) noexcept {
  for (std::uint32_t* const word : {&row.number, &row.revision, &row.first_scan, &row.last_scan})
    *word = from.u32();
  row.length_m = from.f64();
  row.T_map_submap = read_rigid_code(from);
  for (std::uint64_t* const word : {&row.offset_bytes, &row.bytes, &row.digest, &row.label_voxels,
                                    &row.free_voxels, &row.occupied})
    *word = from.u64();
  return from.ok() && row.revision != 0 && row.first_scan <= row.last_scan && row.length_m >= 0.0 &&
         row.length_m <= kMostLength_m && decode_rigid(row.T_map_submap).ok();
}

MapFileStatus damaged(const char* what, std::uint64_t offset_bytes) noexcept {
  return {Status::kCorrupt, what, offset_bytes};
}

}  // namespace

MapFileStatus save_submap_table(std::span<const SubmapRow> rows, std::uint64_t offset_bytes,
                                const ByteSink& sink) noexcept {
  if (rows.size() > kMostSubmaps)
    return {Status::kInvalidArgument, "there are too many submaps", 0};
  std::uint32_t checksum = 0;
  std::array<std::byte, SubmapRow::kBytes> bytes{};
  for (const SubmapRow& row : rows) {
    ByteWriter to(bytes);
    put(row, to);
    checksum = crc32c(bytes, checksum);
    if (!sink.write(sink.context, bytes)) return {Status::kIo, "the sink refused the bytes", 0};
  }
  std::array<std::byte, SubmapTableEnd::kBytes> end{};
  ByteWriter to(end);
  to.u64(offset_bytes);
  to.u32(static_cast<std::uint32_t>(rows.size()));
  to.u32(checksum);
  to.u32(kTableMark);
  to.u32(crc32c(std::span(end).first<SubmapTableEnd::kBytes - 4>()));
  if (!sink.write(sink.context, end)) return {Status::kIo, "the sink refused the bytes", 0};
  return {.offset_bytes = offset_bytes + rows.size() * SubmapRow::kBytes + end.size()};
}

MapFileStatus load_submap_end(std::span<const std::byte, SubmapTableEnd::kBytes> bytes,
                              std::uint64_t file_bytes, SubmapTableEnd& end) noexcept {
  ByteReader from(bytes);
  end.offset_bytes = from.u64();
  end.submaps = from.u32();
  end.checksum = from.u32();
  const bool is_end =
      from.u32() == kTableMark && from.u32() == crc32c(bytes.first<SubmapTableEnd::kBytes - 4>());
  const std::uint64_t at = file_bytes - SubmapTableEnd::kBytes;
  if (!is_end) return {Status::kTruncated, "the file does not end with its table of submaps", at};
  if (end.submaps > kMostSubmaps || end.offset_bytes > at ||
      at - end.offset_bytes != std::uint64_t{end.submaps} * SubmapRow::kBytes)
    return damaged("the place of the table of submaps is not valid", at);
  return {};
}

MapFileStatus load_submap_table(const ByteSource& source, const SubmapTableEnd& end,
                                std::span<SubmapRow> rows) noexcept {
  std::uint64_t offset_bytes = end.offset_bytes;
  if (rows.size() != end.submaps)
    return {Status::kInvalidArgument, "there is no room for all submaps", offset_bytes};
  std::uint32_t checksum = 0;
  std::uint64_t free_from = 0;
  std::array<std::byte, SubmapRow::kBytes> bytes{};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (source.read(source.context, bytes) != bytes.size())
      return {Status::kTruncated, "the file ends inside its table of submaps", offset_bytes};
    checksum = crc32c(bytes, checksum);
    ByteReader from(bytes);
    SubmapRow& row = rows[i];
    const bool valid = read(from, row) && (i == 0 || row.number > rows[i - 1].number) &&
                       row.offset_bytes >= free_from && row.offset_bytes <= end.offset_bytes &&
                       row.bytes <= end.offset_bytes - row.offset_bytes;
    if (!valid) return damaged("a row of the table of submaps is not valid", offset_bytes);
    free_from = row.offset_bytes + row.bytes;
    offset_bytes += bytes.size();
  }
  if (checksum != end.checksum)
    return damaged("the checksum of the table of submaps does not match", offset_bytes);
  return {};
}

std::uint64_t digest(std::span<const SubmapRow> rows) noexcept {
  Digest all;
  for (const SubmapRow& row : rows) {
    all.add(row.number);
    for (const std::int32_t part : row.T_map_submap.translation)
      all.add(static_cast<std::uint32_t>(part));
    for (const std::int32_t part : row.T_map_submap.rotation)
      all.add(static_cast<std::uint32_t>(part));
    all.add(row.T_map_submap.largest);
    all.add(row.digest);
  }
  return all.value();
}

}  // namespace tessera
