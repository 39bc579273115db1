// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/publisher.hpp"

#include "publisher_tick.hpp"

namespace tessera {

namespace {

constexpr std::int64_t kHour_us = 3'600'000'000;

constexpr bool valid(const PublisherConfig& config) noexcept {
  return config.blocks >= 1 && config.blocks <= (1U << 28U) && config.candidates >= 64 &&
         config.candidates <= config.blocks && config.staleness_us >= 1000 &&
         config.free_staleness_us >= config.staleness_us && config.free_staleness_us <= kHour_us &&
         config.retry_us >= 1 && config.retry_us <= kHour_us && config.evidence_factor > 1.0F &&
         config.evidence_factor <= 1e6F && config.few_voxels >= 1 && config.many_voxels >= 1;
}

/// Intervals of a wheel: fine beside the staleness, and twice as far as that reaches.
constexpr std::int64_t width_of(std::int64_t staleness_us) noexcept { return staleness_us / 32; }

}  // namespace

Result<Publisher> Publisher::make(Arena& arena, const PublisherConfig& config, const MapConfig& map,
                                  int num_components) noexcept {
  if (!valid(config)) return Status::kInvalidArgument;
  if (!arena.aligned() || arena.remaining_bytes() < required_bytes(config, num_components))
    return Status::kResourceExhausted;
  const Result<KeyIndex> index = KeyIndex::make(arena, config.blocks);
  const Result<BlockContent> published = BlockContent::make(arena, num_components);
  const Result<BlockContent> current = BlockContent::make(arena, num_components);
  if (!index.ok() || !published.ok() || !current.ok()) return Status::kResourceExhausted;
  Publisher publisher;
  publisher.config_ = config;
  publisher.significance_ = Significance(map, num_components, config.evidence_factor);
  publisher.index_ = *index;
  publisher.candidates_ = arena.take<Candidate>(config.candidates);
  publisher.published_ = *published;
  publisher.current_ = *current;
  publisher.notes_ = arena.take<BlockNote>(MapReader::kPageBlocks);
  publisher.workspace_ = arena.take<std::uint64_t>(snapshot_words(num_components));
  for (std::uint32_t number = config.candidates; number > 0; --number) publisher.release(number);
  publisher.labels_.wheel = DueWheel(width_of(config.staleness_us));
  publisher.free_.wheel = DueWheel(width_of(config.free_staleness_us));
  return publisher;
}

PublisherReport Publisher::tick(const LocalMap& map, std::int64_t now_us,
                                const PublisherBudget& budget, const Publication& publication,
                                std::span<LeavingBlock> leaving) noexcept {
  if (candidates_.empty()) return {};
  // Its time begins with it: what was before the first tick is not stale for long.
  const Instant now = Instant::at_us(now_us);
  if (first_tick_ == Instant::long_ago()) first_tick_ = now;
  Tick tick{.map = MapReader(map),
            .budget = budget,
            .publication = publication,
            .now_us = (now - first_tick_).us};
  begin_tick(tick);
  sweep(tick);
  sweep_published(tick);
  settle_leaving(tick, leaving);
  // A small backlog is sent at once; a quarter of the budget keeps enough for what is due.
  const auto is_light = [&](std::uint32_t waiting, std::uint64_t expected_bytes) {
    return waiting <= budget.compared / 2 && expected_bytes <= budget.label_bytes / 4;
  };
  tick.light = budget.at_once || is_light(labels_.wheel.waiting(), labels_.expected_bytes());
  work_off(tick, labels_);
  tick.light = budget.at_once || (tick.light && is_light(waiting(), free_.expected_bytes()));
  work_off(tick, free_);
  end_tick(tick);
  return tick.report;
}

void Publisher::begin_tick(Tick& tick) noexcept {
  TESSERA_ASSERT(tick.publication.quantise != nullptr && tick.publication.read != nullptr &&
                 tick.publication.publish != nullptr);
  if (tick.now_us < last_us_) tick.now_us = last_us_;
  tick.length_us = tick.now_us - last_us_;
  // Neither the first tick nor one after a pause says when the next one will be.
  const std::int64_t longest_us = config_.staleness_us / 8;
  if (tick.length_us > longest_us) tick.length_us = longest_us;
  if (tick.length_us < 1) tick.length_us = 1;
  last_us_ = tick.now_us;
  const auto ticks = static_cast<std::uint64_t>(config_.staleness_us / tick.length_us);
  tick.spare = labels_.expected_bytes() <= ticks * tick.budget.label_bytes / 2;
  labels_.wheel.advance(tick.now_us);
  free_.wheel.advance(tick.now_us);
}

void Publisher::end_tick(Tick& tick) noexcept {
  PublisherReport& report = tick.report;
  report.waiting = labels_.wheel.waiting();
  report.free_waiting = free_.wheel.waiting();
  report.overdue = labels_.wheel.overdue(tick.now_us) + free_.wheel.overdue(tick.now_us);
  totals_.add(report);
  if (waiting() > totals_.peak_waiting) totals_.peak_waiting = waiting();
}

void Publisher::forget(BlockKey key) noexcept {
  const std::optional<std::uint32_t> value = index_.find(key);
  if (!value) return;
  if (is_waiting(*value)) {
    ++totals_.forgotten_waiting;
    dequeue(number_of(*value));
    release(number_of(*value));
  }
  index_.erase(key);
}

bool Publisher::note_returned(BlockKey key) noexcept {
  const std::optional<std::uint32_t> value = index_.find(key);
  if (value && is_waiting(*value)) return true;
  const std::uint32_t number = open(key);
  if (number == 0) {
    ++totals_.left_out;
    return false;
  }
  Candidate& returned = candidate(number);
  returned.labels_since_us = returned.free_since_us = round_.unchanged_us;
  enqueue(number, due_of(returned));
  return true;
}

void Publisher::clear() noexcept {
  index_.clear();
  first_free_ = 0;
  for (auto number = static_cast<std::uint32_t>(candidates_.size()); number > 0; --number)
    release(number);
  labels_ = {};
  free_ = {};
  labels_.wheel = DueWheel(width_of(config_.staleness_us));
  free_.wheel = DueWheel(width_of(config_.free_staleness_us));
  // What is in the map from now on was not there before.
  round_ = {};
  round_.unchanged_us = last_us_;
  noted_stamp_ = 0;
  unlisted_stamp_ = kAllListed;
  published_place_ = 0;
}

}  // namespace tessera
