// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/replica/replicas.hpp"

#include <algorithm>

#include "tessera/replica/contribution_kind.hpp"

namespace tessera {

Result<Replicas> Replicas::make(Arena& arena, const ReplicasConfig& config,
                                std::uint64_t hash_seed) noexcept {
  if (config.contributions == 0 || config.contributions > kMostContributions)
    return Status::kInvalidArgument;
  Replicas replicas;
  replicas.config_ = config;
  Result<SegmentStore> segments = SegmentStore::make(arena, config.segments);
  const std::span<std::byte> records = arena.take_untouched(arena_bytes<Replica>(config.blocks));
  Result<BlockIndex> index = BlockIndex::make(arena, config.blocks, hash_seed);
  replicas.contributions_ = arena.take<Contribution>(config.contributions);
  replicas.order_ = arena.take<Slot>(config.contributions);
  if (!segments.ok() || records.empty() || !index.ok() || replicas.contributions_.empty() ||
      replicas.order_.empty())
    return Status::kResourceExhausted;
  replicas.segments_ = *segments;
  replicas.index_ = *index;
  replicas.records_ = {reinterpret_cast<Replica*>(records.data()), config.blocks};
  return replicas;
}

Result<Replicas::Slot> Replicas::find(const ContributionId& id) const noexcept {
  const auto at = std::lower_bound(
      in_order().begin(), in_order().end(), id,
      [this](Slot slot, const ContributionId& sought) { return contributions_[slot].id < sought; });
  if (at == in_order().end() || contributions_[*at].id != id) return Status::kOutOfRange;
  return *at;
}

Result<Replicas::Slot> Replicas::open(const ContributionId& id) noexcept {
  if (const Result<Slot> known = find(id); known.ok()) return known;
  if (present_ == config_.contributions) return Status::kResourceExhausted;
  Slot slot = 0;
  while (contributions_[slot].present) ++slot;
  // A robot keeps its bit; a new one takes the lowest that is free.
  std::uint64_t taken = 0;
  int robot_bit = -1;
  for (const Slot other : in_order()) {
    const Contribution& contribution = contributions_[other];
    taken |= std::uint64_t{1} << contribution.robot_bit;
    if (contribution.id.robot == id.robot) robot_bit = contribution.robot_bit;
  }
  if (robot_bit < 0) robot_bit = std::countr_one(taken);
  if (robot_bit >= static_cast<int>(kMostRobots)) return Status::kResourceExhausted;
  contributions_[slot] = {};
  contributions_[slot].id = id;
  contributions_[slot].present = true;
  contributions_[slot].robot_bit = static_cast<std::uint8_t>(robot_bit);
  std::uint32_t place = present_++;
  for (; place > 0 && id < contributions_[order_[place - 1]].id; --place)
    order_[place] = order_[place - 1];
  order_[place] = slot;
  note_objections();
  return slot;
}

void Replicas::note_objections() noexcept {
  objection_count_ = 0;
  for (const Slot slot : in_order()) {
    if (Objection::is(contributions_[slot].id.submap) && objection_count_ < objections_.size())
      objections_[objection_count_++] = slot;
  }
}

void Replicas::note_frame_change(Slot slot) noexcept {
  frame_changes_ += FrameStatements::is(contributions_[slot].id.submap) ? 1U : 0U;
}

void Replicas::set_leaving(Slot slot) noexcept {
  contributions_[slot].leaving = true;
  note_frame_change(slot);
}

void Replicas::close(Slot slot) noexcept {
  TESSERA_ASSERT(contributions_[slot].blocks == 0);
  contributions_[slot].present = false;
  contributions_[slot].leaving = false;
  const std::span<Slot> order = order_.first(present_);
  std::copy(std::find(order.begin(), order.end(), slot) + 1, order.end(),
            std::find(order.begin(), order.end(), slot));
  --present_;
  note_objections();
}

std::uint32_t Replicas::find_record(Slot slot, BlockKey key) const noexcept {
  return index_.find(index_key(slot, key.bits), [&](std::uint32_t number) {
    const Replica& replica = record(number);
    return replica.key == key.bits && replica.slot == slot;
  });
}

const Replicas::Replica* Replicas::find(Slot slot, BlockKey key) const noexcept {
  const std::uint32_t number = find_record(slot, key);
  return number == 0 ? nullptr : &records_[number - 1];
}

/// A record beside first, the block's first part, or of a block that has none.
Result<std::uint32_t> Replicas::add_record(Slot slot, BlockKey key, std::uint32_t first) noexcept {
  if (blocks_ == config_.blocks) return Status::kResourceExhausted;
  const BlockKey hashed = index_key(slot, key.bits);
  const Result<BlockIndex::Place> place =
      first == 0 ? index_.make_room(hashed) : Result<BlockIndex::Place>(BlockIndex::Place{});
  if (!place.ok()) return place.status();
  std::uint32_t number = free_records_;
  if (number != 0) {
    free_records_ = records_[number - 1].next;
  } else {
    number = ++records_used_;
  }
  Contribution& contribution = contributions_[slot];
  Replica& replica = records_[number - 1];
  replica = {};
  replica.key = key.bits;
  replica.slot = slot;
  replica.next = contribution.first_block;
  if (replica.next != 0) records_[replica.next - 1].previous = number;
  contribution.first_block = number;
  ++contribution.blocks;
  ++use_of(slot).blocks;
  ++blocks_;
  if (first == 0) {
    index_.insert(*place, hashed, number);
    contribution.extent.include(unpack(key));
  } else {
    replica.next_part = records_[first - 1].next_part;
    records_[first - 1].next_part = number;
  }
  return number;
}

Replicas::Superseded Replicas::superseded(std::uint32_t first,
                                          const PartVersion& version) const noexcept {
  Superseded result{.news = version.layers};
  for (std::uint32_t part = first; part != 0; part = record(part).next_part) {
    if (record(part).supersedes(version))
      result.news &= static_cast<std::uint8_t>(~record(part).live);
  }
  for (std::uint32_t part = first; part != 0; part = record(part).next_part) {
    if ((record(part).live & ~result.news) != 0) continue;
    result.segments += segments_of(record(part));
    if (result.number == 0) result.number = part;
  }
  return result;
}

std::uint8_t Replicas::news(Slot slot, BlockKey key, const PartVersion& version) const noexcept {
  return superseded(find_record(slot, key), version).news;
}

bool Replicas::has_room(Slot slot, std::uint32_t wanted, std::uint32_t held) noexcept {
  if (wanted <= held) return true;
  if (use_of(slot).segments - held + wanted > config_.robot_segments) {
    ++counted_.replicas_refused_quota;
    return false;
  }
  if (wanted - held <= segments_.free_segments()) return true;
  ++counted_.replicas_refused_storage;
  return false;
}

/// Takes these layers from a block's parts. Records stay, for parts to come: a list of them that is
/// being walked stays a list.
void Replicas::retire(std::uint32_t first, std::uint8_t news) noexcept {
  for (std::uint32_t part = first; part != 0; part = record(part).next_part) {
    Replica& replica = records_[part - 1];
    replica.live &= static_cast<std::uint8_t>(~news);
    if (replica.live == 0) empty(replica);
  }
}

void Replicas::empty(Replica& replica) noexcept {
  contributions_[replica.slot].segments -= segments_of(replica);
  use_of(replica.slot).segments -= segments_of(replica);
  segments_.release(replica.chain);
  replica.chain = 0;
  replica.bytes = 0;
  replica.wire_bytes = 0;
}

Result<Replicas::Change> Replicas::put(Slot slot, BlockKey key, const PartVersion& version,
                                       std::span<const std::byte> packed,
                                       std::span<const std::byte> wire) noexcept {
  TESSERA_ASSERT(version.layers != 0 && version.first <= version.number && wire.size() <= 0xffffU);
  Contribution& contribution = contributions_[slot];
  const std::uint32_t first = find_record(slot, key);
  const Superseded gone = superseded(first, version);
  if (gone.news == 0) {
    ++counted_.replicas_stale;
    return Change::kStale;
  }
  const std::uint32_t wanted = SegmentStore::segments_of(packed.size() + wire.size());
  if (!has_room(slot, wanted, gone.segments)) return Status::kResourceExhausted;
  if (gone.number == 0 && use_of(slot).blocks >= config_.robot_blocks) {
    ++counted_.replicas_refused_quota;
    return Status::kResourceExhausted;
  }
  const Result<std::uint32_t> number =
      gone.number != 0 ? Result<std::uint32_t>(gone.number) : add_record(slot, key, first);
  if (!number.ok()) {
    ++counted_.replicas_refused_storage;
    return number.status();
  }
  note_frame_change(slot);
  retire(first, gone.news);
  Replica& replica = records_[*number - 1];
  if (wanted != 0) {
    const Result<SegmentStore::Chain> chain = segments_.write(packed, wire);
    TESSERA_ASSERT(chain.ok());
    replica.chain = *chain;
  }
  contribution.segments += wanted;
  use_of(slot).segments += wanted;
  replica.bytes = static_cast<std::uint32_t>(packed.size());
  replica.wire_bytes = static_cast<std::uint16_t>(wire.size());
  replica.version = version.number;
  replica.part = static_cast<std::uint8_t>(version.number - version.first);
  replica.layers = version.layers;
  replica.live = gone.news;
  replica.hash = version.hash;
  std::uint32_t newest = version.first;
  const std::uint32_t head = first != 0 ? first : *number;
  for (std::uint32_t part = head; part != 0; part = record(part).next_part)
    newest = std::max(newest, record(part).newest);
  for (std::uint32_t part = head; part != 0; part = record(part).next_part)
    records_[part - 1].newest = newest;
  return Change::kTaken;
}

/// Gives a record back that no block names any more.
void Replicas::release(std::uint32_t number) noexcept {
  Replica& replica = records_[number - 1];
  Contribution& contribution = contributions_[replica.slot];
  empty(replica);
  if (replica.previous != 0) {
    records_[replica.previous - 1].next = replica.next;
  } else {
    contribution.first_block = replica.next;
  }
  if (replica.next != 0) records_[replica.next - 1].previous = replica.previous;
  --contribution.blocks;
  --use_of(replica.slot).blocks;
  --blocks_;
  replica.next = free_records_;
  free_records_ = number;
}

void Replicas::drop(std::uint32_t number) noexcept {
  const Replica& replica = record(number);
  note_frame_change(replica.slot);
  const std::uint32_t first = find_record(replica.slot, BlockKey{replica.key});
  index_.erase(index_key(replica.slot, replica.key),
               [=](std::uint32_t other) { return other == first; });
  for (std::uint32_t part = first; part != 0;) {
    const std::uint32_t next = record(part).next_part;
    release(part);
    part = next;
  }
}

}  // namespace tessera
