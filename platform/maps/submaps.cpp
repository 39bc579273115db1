// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/submaps.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>

#include "base/input_file.hpp"
#include "base/number_text.hpp"

namespace tessera {

namespace {

Failure damaged(const std::string& path, const char* what, std::uint64_t offset_bytes) {
  return damaged_file(path, {Status::kCorrupt, what, offset_bytes});
}

bool same_settings(const MapFileHeader& a, const MapFileHeader& b) {
  const auto same = [](double x, double y) { return !(x < y) && !(x > y); };
  return same(a.config.resolution_m, b.config.resolution_m) &&
         same(a.config.prior, b.config.prior) &&
         same(static_cast<double>(a.config.free_weight),
              static_cast<double>(b.config.free_weight)) &&
         same(static_cast<double>(a.config.max_evidence),
              static_cast<double>(b.config.max_evidence)) &&
         a.config.tuple == b.config.tuple && a.classes == b.classes &&
         a.identity.robot == b.identity.robot && a.identity.epoch == b.identity.epoch;
}

}  // namespace

Outcome<SubmapWriter> SubmapWriter::open(const std::string& path, const LocalMap& common,
                                         const MapIdentity& identity) {
  TESSERA_TRY_ASSIGN(AtomicFile file, AtomicFile::open(path));
  SubmapWriter writer(std::move(file), identity);
  writer.identity_.kind = MapKind::kSubmaps;
  TESSERA_TRY_ASSIGN(const AppendedMap empty, append_map(common, writer.identity_, writer.file_));
  writer.bytes_ = empty.bytes;
  writer.identity_.kind = MapKind::kLocal;
  // What they have in common is said once.
  writer.identity_.settings_bytes = 0;
  return writer;
}

SubmapRow row_of(std::uint32_t number, const SubmapNote& note) noexcept {
  SubmapRow row;
  row.number = number;
  row.first_scan = static_cast<std::uint32_t>(note.first_scan);
  row.last_scan = static_cast<std::uint32_t>(note.last_scan);
  row.length_m = note.length_m;
  return row;
}

Outcome<SubmapRow> append_submap(const LocalMap& map, const MapIdentity& identity, AtomicFile& file,
                                 SubmapRow row) {
  TESSERA_TRY_ASSIGN(const AppendedMap added, append_map(map, identity, file));
  row.bytes = added.bytes;
  row.digest = added.summary.digest;
  row.label_voxels = added.summary.label_voxels;
  row.free_voxels = added.summary.free_voxels;
  row.occupied = added.summary.occupied;
  row.T_map_submap = *encode_rigid(Matrix34d::Identity());
  return row;
}

Outcome<void> SubmapWriter::check_room() const {
  if (rows_.size() != kMostSubmaps) return {};
  return Failure{fmt::format("{} has no room for more than {} submaps; give a larger "
                             "--submap-length",
                             file_.path(), kMostSubmaps),
                 FailureKind::kFailure};
}

Outcome<void> SubmapWriter::add(const LocalMap& map, SubmapRow row) {
  TESSERA_TRY(check_room());
  TESSERA_TRY_ASSIGN(SubmapRow added, append_submap(map, identity_, file_, row));
  added.offset_bytes = bytes_;
  rows_.push_back(added);
  bytes_ += added.bytes;
  return {};
}

Outcome<void> SubmapWriter::add_file(const std::string& path, SubmapRow row) {
  TESSERA_TRY(check_room());
  TESSERA_TRY_ASSIGN(InputFile file, InputFile::open(path));
  if (file.size_bytes() != row.bytes)
    return Failure{path + " was changed since it was written", FailureKind::kFailure};
  constexpr std::size_t kPiece = std::size_t{1} << 16U;
  const auto piece = std::make_unique<std::array<std::byte, kPiece>>();
  for (std::uint64_t left = row.bytes; left != 0;) {
    const std::span<std::byte> part =
        std::span(*piece).first(static_cast<std::size_t>(std::min<std::uint64_t>(left, kPiece)));
    TESSERA_TRY(file.read_exactly(part));
    static_cast<void>(file_.write(part));  // commit() explains a refused write
    left -= part.size();
  }
  row.offset_bytes = bytes_;
  rows_.push_back(row);
  bytes_ += row.bytes;
  return {};
}

Outcome<void> SubmapWriter::commit() {
  const ByteSink sink{&file_, [](void* file, std::span<const std::byte> bytes) {
                        return static_cast<AtomicFile*>(file)->write(bytes);
                      }};
  // commit() explains a refused write.
  static_cast<void>(save_submap_table(rows_, bytes_, sink));
  return file_.commit();
}

Outcome<StoredSubmaps> load_submaps(const std::string& path, const MapFileHeader& header) {
  TESSERA_TRY_ASSIGN(InputFile file, InputFile::open(path));
  const std::uint64_t bytes = file.size_bytes();
  std::array<std::byte, SubmapTableEnd::kBytes> last{};
  if (bytes < header.header_bytes + last.size())
    return damaged_file(path, {Status::kTruncated, "the file has no table of submaps", bytes});
  file.skip_to(bytes - last.size());
  TESSERA_TRY(file.read_exactly(last));
  SubmapTableEnd end;
  MapFileStatus status = load_submap_end(last, bytes, end);
  if (!status.ok()) return damaged_file(path, status);
  StoredSubmaps submaps{path, header, std::vector<SubmapRow>(end.submaps)};
  file.skip_to(end.offset_bytes);
  const ByteSource source{&file, [](void* context, std::span<std::byte> into) -> std::size_t {
                            const Outcome<std::size_t> n =
                                static_cast<InputFile*>(context)->read(into);
                            return n.ok() ? *n : 0;
                          }};
  status = load_submap_table(source, end, submaps.rows);
  if (!status.ok()) return damaged_file(path, status);
  return submaps;
}

Outcome<std::unique_ptr<StoredMap>> load_submap(const StoredSubmaps& submaps,
                                                const SubmapRow& row) {
  TESSERA_TRY_ASSIGN(std::unique_ptr<StoredMap> stored,
                     load_map(submaps.path, FilePart{row.offset_bytes, row.bytes}));
  const std::string name = fmt::format("{}, submap {}", submaps.path, row.number);
  if (!same_settings(stored->header, submaps.header))
    return damaged(name, "its settings are not those of the file", row.offset_bytes);
  if (!stored->header.summary || stored->header.summary->digest != row.digest)
    return damaged(name, "its content is not what the table says", row.offset_bytes);
  return stored;
}

Json to_json(const SubmapRow& row) {
  const Matrix34d T_map_submap = *decode_rigid(row.T_map_submap);
  return {{"number", row.number},
          {"first_scan", row.first_scan},
          {"last_scan", row.last_scan},
          {"length_m", row.length_m},
          {"label_voxels", row.label_voxels},
          {"free_voxels", row.free_voxels},
          {"bytes", row.bytes},
          {"digest", hex64(row.digest)},
          {"revision", row.revision},
          {"T_map_submap",
           std::vector<double>(T_map_submap.data(), T_map_submap.data() + T_map_submap.size())}};
}

MapSummary summary_of(const std::vector<SubmapRow>& rows) {
  MapSummary all;
  all.digest = digest(std::span(rows));
  for (const SubmapRow& row : rows) {
    all.label_voxels += row.label_voxels;
    all.free_voxels += row.free_voxels;
    all.occupied += row.occupied;
  }
  all.free = all.observed() - all.occupied;
  return all;
}

}  // namespace tessera
