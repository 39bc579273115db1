// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is done with the blocks that wait: compared, and published, put off or dropped.
#include "publisher_tick.hpp"
#include "tessera/map/internal/packed_block.hpp"

namespace tessera {

namespace {

/// Refusals in a tick after which no more is tried: most likely there is no room for anything.
constexpr std::uint32_t kMostRefused = 8;

}  // namespace

void Publisher::work_off(Tick& tick, Queue& queue) noexcept {
  const std::uint32_t count =
      tick.light ? queue.wheel.waiting() : queue.wheel.pace(tick.now_us, tick.length_us);
  for (std::uint32_t done = 0; done < count; ++done) {
    const bool has_bytes = &queue == &labels_ ? tick.has_label_bytes() : tick.has_free_bytes();
    if (!has_bytes || tick.report.compared >= tick.budget.compared) return;
    if (tick.report.refused >= kMostRefused) return;
    const std::uint32_t number = queue.wheel.first();
    dequeue(number);
    handle(tick, queue, number);
  }
}

/// The first of them is another one at each tick, so that none that is refused holds up the rest.
void Publisher::settle_leaving(Tick& tick, std::span<LeavingBlock> leaving) noexcept {
  const std::size_t first = leaving_place_++;
  for (std::size_t i = 0; i < leaving.size(); ++i) {
    const bool is_spent = !tick.has_label_bytes() || !tick.has_free_bytes() ||
                          tick.report.refused >= kMostRefused / 2 ||
                          tick.report.compared >= (tick.budget.compared + 1) / 2;
    if (is_spent) return;
    LeavingBlock& block = leaving[(first + i) % leaving.size()];
    if (block.stamp == 0) settle(tick, block);
  }
}

/// A block that waits is done with before its time; another one may have changed since it was. It
/// stays listed until it has left: if the map is cleared before that, it has to be withdrawn.
void Publisher::settle(Tick& tick, LeavingBlock& block) noexcept {
  const std::optional<std::uint32_t> value = index_.find(block.key);
  const bool waits = value && is_waiting(*value);
  const std::uint32_t number = waits ? number_of(*value) : open(block.key);
  if (number == 0) return;
  if (waits) dequeue(number);
  candidate(number).leaves = true;
  block.stamp = handle(tick, queue_of(candidate(number)), number);
  tick.report.settled += block.stamp != 0 ? 1U : 0U;
}

/// Three quarters of the time: what is even over the ticks is a little early.
bool Publisher::is_time(const Tick& tick, const Candidate& waiting,
                        const Difference& difference) const noexcept {
  if (tick.light || waiting.gone || waiting.leaves) return true;
  const auto is_up = [&](std::int64_t since_us, std::int64_t staleness_us) {
    return since_us != kNever && tick.now_us - since_us >= staleness_us / 4 * 3;
  };
  if (is_up(waiting.labels_since_us, config_.staleness_us)) return true;
  if (is_up(waiting.free_since_us, config_.free_staleness_us)) return true;
  return tick.spare && static_cast<std::uint32_t>(difference.labelled()) >= config_.many_voxels;
}

/// Keeps the times of what differs. Few labelled voxels go with the free ones.
void Publisher::set_timers(Candidate& waiting, const Difference& difference) const noexcept {
  const auto labelled = static_cast<std::uint32_t>(difference.labelled());
  const bool few = labelled != 0 && labelled < config_.few_voxels && !waiting.gone;
  const std::int64_t since_us =
      waiting.labels_since_us != kNever ? waiting.labels_since_us : round_.unchanged_us;
  if (difference.free == 0 && !few) {
    waiting.free_since_us = kNever;
  } else if (waiting.free_since_us == kNever) {
    waiting.free_since_us = since_us;
  }
  waiting.labels_since_us = labelled == 0 || few ? kNever : since_us;
}

/// False: the block is being changed.
bool Publisher::read(Tick& tick, BlockKey key, BlockSnapshot& into) noexcept {
  const Result<BlockSnapshot> found =
      tick.map.snapshot(unpack(key), std::as_writable_bytes(workspace_));
  if (!found.ok()) return false;
  into = *found;
  return true;
}

std::uint64_t Publisher::handle(Tick& tick, Queue& queue, std::uint32_t number) noexcept {
  Candidate& waiting = candidate(number);
  const Publication& publication = tick.publication;
  ++tick.report.compared;
  BlockSnapshot block;
  const bool is_read = read(tick, waiting.key, block);
  tick.report.busy += is_read ? 0U : 1U;
  if (!is_read || (!tick.has_label_bytes() && block.label_voxels() != 0)) {
    ++tick.report.deferred;
    enqueue(number, tick.now_us + config_.retry_us);
    return 0;
  }
  waiting.gone = block.empty();
  const std::uint64_t stamp = waiting.gone ? 1 : block.stamp();
  if (publication.whole != nullptr && !publication.whole(publication.whole_context, waiting.key)) {
    ++tick.report.partial;
    if (waiting.gone) waiting.published = false;  // stays as published, and is not watched
    close(number);
    return stamp | 1U;
  }
  published_.clear();
  current_.clear();
  waiting.published = publication.read(publication.context, waiting.key, published_);
  if (!waiting.gone) {
    add_block(block, current_);
    if (!waiting.published) waiting.published_labels = 0;
  }
  const Difference difference = significance_.compare(published_, current_);
  set_timers(waiting, difference);
  if (!difference.any()) {
    if (!waiting.gone) waiting.published_labels = static_cast<std::uint16_t>(block.label_voxels());
    ++tick.report.unchanged;
    queue.note_bytes(0);
    close(number);
    return stamp;
  }
  if (!is_time(tick, waiting, difference)) {
    ++tick.report.deferred;
    waiting.fresh = false;
    enqueue(number, due_of(waiting));
    return 0;
  }
  return publish(tick, queue, number, block.label_voxels()) ? stamp : 0;
}

bool Publisher::publish(Tick& tick, Queue& queue, std::uint32_t number,
                        std::uint32_t label_voxels) noexcept {
  Candidate& waiting = candidate(number);
  const Publication& publication = tick.publication;
  publication.quantise(publication.context, current_);
  // What cannot be said on the wire is no reason to say it again.
  if (waiting.published && !significance_.compare(published_, current_).any()) {
    ++tick.report.unchanged;
    queue.note_bytes(0);
    close(number);
    return true;
  }
  const Result<WireBytes> bytes = publication.publish(publication.context, waiting.key, current_);
  if (!bytes.ok()) {
    ++tick.report.refused;
    enqueue(number, tick.now_us + config_.retry_us);
    return false;
  }
  note_published(tick, waiting, *bytes);
  waiting.published = current_.any();
  waiting.published_labels = static_cast<std::uint16_t>(label_voxels);
  tick.report.emptied += waiting.published ? 0U : 1U;
  queue.note_bytes(bytes->labels + bytes->free);
  close(number);
  return true;
}

void Publisher::note_published(Tick& tick, const Candidate& waiting,
                               const WireBytes& bytes) noexcept {
  ++tick.report.published;
  tick.report.bytes.labels += bytes.labels;
  tick.report.bytes.free += bytes.free;
  if (waiting.labels_since_us == kNever) return;
  const std::int64_t staleness_us = tick.now_us - waiting.labels_since_us;
  if (staleness_us > tick.report.worst_staleness_us) tick.report.worst_staleness_us = staleness_us;
  const std::int64_t eighths = staleness_us * 8 / config_.staleness_us;
  constexpr std::int64_t kLast = 15;
  ++totals_.by_staleness[static_cast<std::size_t>(eighths < kLast ? eighths : kLast)];
}

}  // namespace tessera
