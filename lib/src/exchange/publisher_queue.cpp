// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which blocks have changed: noted by going through the map's index, and through what is published.
#include "publisher_tick.hpp"

namespace tessera {

namespace {

constexpr std::int32_t apart(std::int32_t a, std::int32_t b) noexcept {
  return a < b ? b - a : a - b;
}

}  // namespace

bool Publisher::is_near(BlockKey key) const noexcept {
  const BlockCoord block = unpack(key);
  return has_focus_ && apart(block.x, focus_.x) <= config_.near_blocks &&
         apart(block.y, focus_.y) <= config_.near_blocks &&
         apart(block.z, focus_.z) <= config_.near_blocks;
}

std::int64_t Publisher::due_of(const Candidate& waiting) const noexcept {
  std::int64_t due_us = waiting.free_since_us + config_.free_staleness_us;
  if (waiting.labels_since_us != kNever) {
    std::int64_t hold_us = config_.staleness_us;
    if (waiting.fresh) hold_us = is_near(waiting.key) ? hold_us / 4 : hold_us / 2;
    if (waiting.gone) hold_us = 0;
    const std::int64_t labels_us = waiting.labels_since_us + hold_us;
    due_us = waiting.free_since_us == kNever || labels_us < due_us ? labels_us : due_us;
  }
  return due_us;
}

void Publisher::enqueue(std::uint32_t number, std::int64_t due_us) noexcept {
  Links links{candidates_};
  queue_of(candidate(number)).wheel.insert(links, number, due_us);
}

void Publisher::dequeue(std::uint32_t number) noexcept {
  Links links{candidates_};
  queue_of(candidate(number)).wheel.remove(links, number);
}

void Publisher::release(std::uint32_t number) noexcept {
  Candidate& unused = candidate(number);
  unused = {};
  unused.link.next = first_free_;
  first_free_ = number;
}

std::uint32_t Publisher::open(BlockKey key) noexcept {
  const std::uint32_t number = first_free_;
  if (number == 0) return 0;
  const std::optional<std::uint32_t> published = index_.find(key);
  if (!published && index_.insert(key, kWaits | number) != Status::kOk) return 0;
  if (published) index_.assign(key, kWaits | number);
  Candidate& opened = candidate(number);
  first_free_ = opened.link.next;
  opened = {};
  opened.key = key;
  opened.published = published.has_value();
  opened.published_labels = static_cast<std::uint16_t>(published.value_or(0));
  return number;
}

void Publisher::close(std::uint32_t number) noexcept {
  const Candidate& closed = candidate(number);
  if (closed.published) {
    index_.assign(closed.key, closed.published_labels);
  } else {
    index_.erase(closed.key);
  }
  release(number);
}

bool Publisher::note(Tick& tick, const BlockNote& block) noexcept {
  const std::optional<std::uint32_t> value = index_.find(block.key);
  const bool waits = value && is_waiting(*value);
  const std::uint32_t number = waits ? number_of(*value) : open(block.key);
  if (number == 0) {
    ++tick.report.left_out;
    const bool listed = first_free_ == 0;
    if (!listed && round_.unchanged_stamp < unlisted_stamp_)
      unlisted_stamp_ = round_.unchanged_stamp;
    return !listed;
  }
  Candidate& noted = candidate(number);
  const std::uint32_t labels = block.label_voxels;
  const std::uint32_t before = noted.published_labels;
  const std::uint32_t more = labels < before ? before - labels : labels - before;
  const bool fresh = tick.spare && more >= config_.many_voxels;
  const bool timed =
      noted.free_since_us != kNever && (noted.labels_since_us != kNever || (labels | before) == 0);
  // Most that wait are noted again with each scan.
  if (waits && timed && fresh == noted.fresh && !noted.gone) return true;
  if (waits) {
    dequeue(number);
  } else {
    ++tick.report.noted;
  }
  noted.fresh = fresh;
  noted.gone = false;
  if (noted.free_since_us == kNever) noted.free_since_us = round_.unchanged_us;
  if ((labels | before) != 0 && noted.labels_since_us == kNever)
    noted.labels_since_us = round_.unchanged_us;
  enqueue(number, due_of(noted));
  return true;
}

void Publisher::begin_round(const Tick& tick) noexcept {
  round_.going = true;
  round_.complete = true;
  round_.start_stamp = tick.map.stamp();
  round_.start_us = tick.now_us;
  // For some more keys at once, or every one that becomes free would mean to look at all again.
  const std::size_t room = index_.capacity() - index_.size();
  if (unlisted_stamp_ == kAllListed || room <= index_.capacity() / 64) return;
  if (unlisted_stamp_ < round_.unchanged_stamp) round_.unchanged_stamp = unlisted_stamp_;
  unlisted_stamp_ = kAllListed;
}

void Publisher::sweep(Tick& tick) noexcept {
  if (!round_.going) begin_round(tick);
  const std::span<BlockNote, MapReader::kPageBlocks> notes(notes_);
  std::size_t left = tick.budget.entries;
  do {
    const Result<PageNotes> found = tick.map.notes(round_.page, round_.slot, notes);
    if (found.status() == Status::kOutOfRange) return end_round();
    if (!found.ok()) {
      ++tick.report.busy;
      return;
    }
    // Where it stopped within a page, an entry may have moved to where it was before.
    if (round_.slot != 0 && round_.stop_moves != found->moves) round_.complete = false;
    tick.report.entries += static_cast<std::uint32_t>(MapReader::kPageBlocks);
    for (const BlockNote& block : notes.first(found->count)) {
      if (block.stamp <= round_.unchanged_stamp || note(tick, block)) continue;
      round_.slot = block.slot;
      round_.stop_moves = found->moves;
      return;
    }
    ++round_.page;
    round_.slot = 0;
    left -= left < MapReader::kPageBlocks ? left : MapReader::kPageBlocks;
  } while (left >= MapReader::kPageBlocks);
  if (round_.page >= tick.map.pages()) end_round();
}

void Publisher::end_round() noexcept {
  round_.page = round_.slot = 0;
  round_.going = false;
  if (!round_.complete) return;
  noted_stamp_ = round_.start_stamp;
  round_.unchanged_stamp = round_.start_stamp;
  round_.unchanged_us = round_.start_us;
}

std::optional<std::uint64_t> Publisher::unnoted(const LocalMap& map) noexcept {
  if (candidates_.empty()) return 0;
  MapReader reader(map);
  const std::span<BlockNote, MapReader::kPageBlocks> notes(notes_);
  std::uint64_t count = 0;
  const std::size_t pages = reader.pages();
  for (std::size_t page = 0; page < pages; ++page) {
    const Result<PageNotes> found = reader.notes(page, 0, notes);
    if (!found.ok()) return std::nullopt;
    for (const BlockNote& block : notes.first(found->count)) {
      if (block.stamp <= noted_stamp_) continue;
      const std::optional<std::uint32_t> value = index_.find(block.key);
      count += value && is_waiting(*value) ? 0U : 1U;
    }
  }
  return count;
}

void Publisher::sweep_published(Tick& tick) noexcept {
  const std::size_t most = tick.budget.entries / 16 + 1;
  const std::size_t buckets = index_.capacity() / 64 + 1;
  index_.for_some(published_place_, buckets < most ? buckets : most,
                  [&](BlockKey key, std::uint32_t value) {
                    if (is_waiting(value) || !tick.map.lacks(unpack(key))) return;
                    const std::uint32_t number = open(key);
                    if (number == 0) {
                      ++tick.report.left_out;
                      return;
                    }
                    ++tick.report.noted;
                    Candidate& gone = candidate(number);
                    gone.gone = true;
                    gone.labels_since_us = round_.unchanged_us;
                    enqueue(number, due_of(gone));
                  });
}

}  // namespace tessera
