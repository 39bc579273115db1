// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/kept_submaps.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <numeric>
#include <system_error>

#include "maps/empty_map.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

Outcome<std::unique_ptr<KeptSubmaps>> KeptSubmaps::make(std::string stem, const LocalMap& like) {
  std::unique_ptr<KeptSubmaps> made(new KeptSubmaps(std::move(stem)));
  TESSERA_TRY_ASSIGN(made->empty_, make_empty_map(like, made->memory_));
  return made;
}

std::string KeptSubmaps::path_of(const std::string& stem, std::uint32_t number) {
  return fmt::format("{}.submap-{}.tsm", stem, number);
}

void KeptSubmaps::take_up(std::vector<SubmapRow> rows, std::uint32_t epoch) {
  rows_ = std::move(rows);
  epoch_ = epoch;
}

std::optional<KeptSubmaps::Found> KeptSubmaps::find(const std::string& path, std::uint32_t number) {
  const Outcome<MapFileHeader> header = load_whole_header(path);
  std::error_code error;
  const std::uint64_t bytes = std::filesystem::file_size(path, error);
  if (!header.ok() || error || !header->summary) return std::nullopt;
  Found found{{}, *header};
  found.row.number = number;
  found.row.bytes = bytes;
  found.row.digest = header->summary->digest;
  found.row.label_voxels = header->summary->label_voxels;
  found.row.free_voxels = header->summary->free_voxels;
  found.row.occupied = header->summary->occupied;
  return found;
}

Outcome<void> KeptSubmaps::keep_ended(LocalMaps& maps, const MapIdentity& identity) {
  const std::optional<std::uint32_t> ended = maps.ended(LocalMaps::User::kKeeping);
  if (!ended) return {};
  if (!epoch_) epoch_ = identity.epoch;
  MapIdentity of_one = identity;
  of_one.epoch = *epoch_;
  of_one.settings_bytes = 0;  // What submaps have in common is said once.
  TESSERA_TRY_ASSIGN(AtomicFile file, AtomicFile::open(path_of(stem_, *ended)));
  TESSERA_TRY_ASSIGN(const SubmapRow row, append_submap(maps.of(*ended), of_one, file,
                                                        row_of(*ended, maps.note_of(*ended))));
  TESSERA_TRY(file.commit());
  rows_.push_back(row);
  maps.note_done(LocalMaps::User::kKeeping);
  return {};
}

std::vector<KeptSubmaps::Frame> KeptSubmaps::frames_of(const SubmapFrames& frames) {
  std::vector<Frame> all;
  for (std::uint32_t submap = frames.first(); submap <= frames.last(); ++submap)
    all.push_back({submap, *encode_rigid(frames.frame(submap)), frames.revision_of(submap)});
  return all;
}

Outcome<MapSummary> KeptSubmaps::save_as(const std::string& path, const CurrentSubmap& current,
                                         std::span<const Frame> frames,
                                         const MapIdentity& identity) const {
  MapIdentity of_first = identity;
  of_first.epoch = epoch_.value_or(identity.epoch);
  TESSERA_TRY_ASSIGN(SubmapWriter writer, SubmapWriter::open(path, empty_, of_first));
  for (const SubmapRow& row : rows_) TESSERA_TRY(writer.add_file(path_of(stem_, row.number), row));
  TESSERA_TRY(writer.add(current.map, row_of(current.number, current.note)));
  set_frames(writer.rows(), frames);
  TESSERA_TRY(writer.commit());
  return summary_of(writer.rows());
}

std::uint64_t KeptSubmaps::digest_with(const CurrentSubmap& current,
                                       std::span<const Frame> frames) const {
  std::vector<SubmapRow> rows = rows_;
  std::vector<KeyedIndex> workspace = workspace_for(current.map);
  rows.push_back(row_of(current.number, current.note));
  rows.back().digest = digest(current.map, workspace);
  rows.back().T_map_submap = *encode_rigid(Matrix34d::Identity());
  set_frames(rows, frames);
  return digest(rows);
}

void KeptSubmaps::set_frames(std::span<SubmapRow> rows, std::span<const Frame> frames) noexcept {
  if (frames.empty()) return;
  for (SubmapRow& row : rows) {
    const std::size_t at = row.number - std::min(row.number, frames.front().number);
    // One that has begun just now has no frame yet: it continues the one before.
    const Frame& frame = frames[std::min(at, frames.size() - 1)];
    row.T_map_submap = frame.T_map_submap;
    row.revision = at < frames.size() ? frame.revision : 1;
  }
}

void KeptSubmaps::remove() noexcept {
  for (const SubmapRow& row : rows_) ::unlink(path_of(stem_, row.number).c_str());
}

std::uint64_t KeptSubmaps::bytes() const noexcept {
  return std::accumulate(rows_.begin(), rows_.end(), std::uint64_t{0},
                         [](std::uint64_t sum, const SubmapRow& row) { return sum + row.bytes; });
}

}  // namespace tessera
