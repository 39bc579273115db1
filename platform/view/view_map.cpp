// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "view/view_map.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "base/number_text.hpp"
#include "tessera/semantics/estimate.hpp"

namespace tessera {

void ViewBudget::renew(std::int64_t now_us) noexcept {
  constexpr std::int64_t kSecond_us = 1'000'000;
  const std::int64_t passed_us = std::clamp<std::int64_t>(now_us - last_us_, 0, kSecond_us);
  last_us_ = now_us;
  const std::int64_t most = kNotes * std::int64_t{per_s_};
  left_ = std::min(most, left_ + most * passed_us / kSecond_us);
}

ViewMap::ViewMap(const LocalMap& map, ViewMapInfo info) : ViewMap(map, nullptr, std::move(info)) {}

ViewMap::ViewMap(const GlobalMap& global, ViewMapInfo info)
    : ViewMap(global.map(), &global, std::move(info)) {}

ViewMap::ViewMap(const LocalMap& map, const GlobalMap* global, ViewMapInfo info)
    : info_(std::move(info)),
      map_(&map),
      reader_(map),
      workspace_(reader_.snapshot_bytes()),
      notes_(MapReader::kPageBlocks),
      marks_(std::make_unique<BlockMarks>()) {
  if (global != nullptr) global_reader_.emplace(*global);
  const std::uint8_t only = info_.contributors.size() == 1 ? 0 : VoxelMark::kNobody;
  marks_->fill({.contributor = only, .disagreement = false});
}

Result<BlockSnapshot> ViewMap::snapshot(BlockCoord block) noexcept {
  const std::span<std::byte> workspace = workspace_.span();
  return global_reader_ ? global_reader_->snapshot(block, workspace)
                        : reader_.snapshot(block, workspace);
}

Result<VoxelEvidence> ViewMap::evidence(VoxelCoord voxel) noexcept {
  return global_reader_ ? global_reader_->evidence(voxel) : reader_.evidence(voxel);
}

bool ViewMap::put_block(const BlockNote& note, Message& message) noexcept {
  if (message.into.size() - message.bytes < kMostViewBlockBytes) return false;
  message.header.deferred = message.budget.is_used_up();
  if (message.header.deferred) return false;
  const Result<BlockSnapshot> block = snapshot(unpack(note.key));
  message.header.deferred = !block.ok();
  if (!block.ok()) return false;
  if (info_.marks) info_.marks(*block, *marks_);
  const EncodedBlock put = put_view_block(*block, map_->reading(), map_->classes().moving(),
                                          marks_.get(), message.into.subspan(message.bytes));
  message.budget.take_voxels(put.voxels);
  message.bytes += put.bytes;
  ++message.header.blocks;
  return true;
}

bool ViewMap::put_page(Message& message) noexcept {
  ViewCursor& at = message.header.next;
  const std::span<BlockNote, MapReader::kPageBlocks> notes(notes_);
  const Result<PageNotes> found = reader_.notes(at.page, 0, notes);
  message.header.round_is_over = found.status() == Status::kOutOfRange;
  message.header.deferred = !found.ok() && !message.header.round_is_over;
  if (!found.ok()) return false;
  message.budget.take_notes(MapReader::kPageBlocks);
  const std::span<BlockNote> here = notes.first(found->count);
  std::sort(here.begin(), here.end(),
            [](const BlockNote& a, const BlockNote& b) { return a.key < b.key; });
  for (const BlockNote& note : here) {
    if (note.key.bits < at.key || note.label_voxels == 0) continue;
    at.key = note.key.bits;
    if (note.stamp > at.since && !put_block(note, message)) return false;
    at.key = note.key.bits + 1;
    ++at.blocks;
  }
  ++at.page;
  at.key = 0;
  return true;
}

std::size_t ViewMap::put_changes(const ViewCursor& cursor, ViewHeader& header, ViewBudget& budget,
                                 std::span<std::byte> into) noexcept {
  header.next = cursor;
  if (cursor.round == 0) {
    header.next = {.since = cursor.since, .round = reader_.stamp()};
    header.round_is_over = header.next.round == 0;  // The map was always empty.
  }
  Message message{header, budget, into, kViewHeaderBytes};
  while (!header.round_is_over) {
    header.deferred = budget.is_used_up();
    if (header.deferred || !put_page(message)) break;
  }
  if (header.round_is_over)
    header.next = {.since = header.next.round, .blocks = header.next.blocks};
  put_view_header(header, into);
  return message.bytes;
}

std::size_t ViewMap::put_keys(std::uint64_t page, ViewBudget& budget,
                              std::span<std::byte> into) noexcept {
  const std::span<BlockNote, MapReader::kPageBlocks> notes(notes_);
  std::size_t bytes = sizeof page;
  const auto put = [&into](std::size_t at, std::uint64_t value) {
    std::memcpy(into.data() + at, &value, sizeof value);
  };
  while (into.size() - bytes >= sizeof page * MapReader::kPageBlocks) {
    const Result<PageNotes> found = reader_.notes(static_cast<std::size_t>(page), 0, notes);
    if (found.status() == Status::kOutOfRange) {
      page = 0;
      break;
    }
    if (!found.ok()) break;
    budget.take_notes(MapReader::kPageBlocks);
    for (const BlockNote& note : notes.first(found->count)) {
      if (note.label_voxels == 0) continue;
      put(bytes, note.key.bits);
      bytes += sizeof note.key.bits;
    }
    ++page;
  }
  put(0, page);
  return bytes;
}

Json ViewMap::voxel(const Point3d& p_map) {
  const Result<VoxelCoord> voxel = map_->lattice().voxel_of(p_map);
  VoxelEvidence counts;
  counts.num_components = map_->num_components();
  if (voxel.ok()) {
    const Result<VoxelEvidence> read = evidence(*voxel);
    if (!read.ok()) return {};
    counts = *read;
  }
  const CountSummary summary = summary_of(counts);
  const Estimate e = summary.estimate(map_->reading());
  Json json = {{"state", to_string(e.state)},
               {"label", e.label},
               {"probability", nine_digits(e.probability)},
               {"variance", nine_digits(e.variance)},
               {"evidence", nine_digits(e.evidence)},
               {"rest", nine_digits(static_cast<double>(counts.rest))},
               {"prior", nine_digits(map_->config().prior)}};
  std::array<double, kMaxComponents> probabilities;
  const auto components = static_cast<std::size_t>(counts.num_components);
  summary.distribution(map_->reading(), std::span(probabilities).first(components));
  Json sigma = Json::array();
  Json share = Json::array();
  for (std::size_t l = 0; l < components; ++l) {
    sigma.push_back(nine_digits(static_cast<double>(counts.sigma[l])));
    share.push_back(nine_digits(probabilities[l]));
  }
  json["sigma"] = std::move(sigma);
  json["share"] = std::move(share);
  if (voxel.ok()) {
    const Point3d center = map_->lattice().center_of(*voxel);
    json["voxel"] = {voxel->x, voxel->y, voxel->z};
    json["center_m"] = {nine_digits(center.x()), nine_digits(center.y()), nine_digits(center.z())};
  }
  return json;
}

}  // namespace tessera
