// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/replicas.hpp"

#include <algorithm>

namespace tessera {

Result<Replicas> Replicas::make(Arena& arena, const ReplicasConfig& config) noexcept {
  if (config.contributions == 0 || config.contributions > kMostContributions)
    return Status::kInvalidArgument;
  Replicas replicas;
  replicas.config_ = config;
  Result<SegmentStore> segments = SegmentStore::make(arena, config.segments);
  const std::span<std::byte> records = arena.take_untouched(arena_bytes<Replica>(config.blocks));
  Result<BlockIndex> index = BlockIndex::make(arena, config.blocks);
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
  return slot;
}

void Replicas::close(Slot slot) noexcept {
  TESSERA_ASSERT(contributions_[slot].blocks == 0);
  contributions_[slot].present = false;
  contributions_[slot].leaving = false;
  const std::span<Slot> order = order_.first(present_);
  std::copy(std::find(order.begin(), order.end(), slot) + 1, order.end(),
            std::find(order.begin(), order.end(), slot));
  --present_;
}

std::uint32_t Replicas::segments_of_robot(std::uint32_t robot) const noexcept {
  std::uint32_t sum = 0;
  for (const Slot slot : in_order())
    sum += contributions_[slot].id.robot == robot ? contributions_[slot].segments : 0U;
  return sum;
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

Result<std::uint32_t> Replicas::add_record(Slot slot, BlockKey key) noexcept {
  if (blocks_ == config_.blocks) return Status::kResourceExhausted;
  const BlockKey hashed = index_key(slot, key.bits);
  const Result<BlockIndex::Place> place = index_.make_room(hashed);
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
  ++blocks_;
  index_.insert(*place, hashed, number);
  return number;
}

Result<Replicas::Change> Replicas::put(Slot slot, BlockKey key, std::uint32_t version,
                                       std::span<const std::byte> packed) noexcept {
  Contribution& contribution = contributions_[slot];
  const std::uint32_t known = find_record(slot, key);
  if (known != 0 && version <= record(known).version) {
    ++counted_.stale;
    return Change::kStale;
  }
  const std::uint32_t held = known == 0 ? 0 : SegmentStore::segments_of(record(known).bytes);
  const std::uint32_t wanted = SegmentStore::segments_of(packed.size());
  if (wanted > held) {
    if (segments_of_robot(contribution.id.robot) - held + wanted > config_.robot_segments) {
      ++counted_.refused_quota;
      return Status::kResourceExhausted;
    }
    if (wanted - held > segments_.free_segments()) {
      ++counted_.refused_storage;
      return Status::kResourceExhausted;
    }
  }
  const Result<std::uint32_t> number =
      known != 0 ? Result<std::uint32_t>(known) : add_record(slot, key);
  if (!number.ok()) {
    ++counted_.refused_storage;
    return number.status();
  }
  Replica& replica = records_[*number - 1];
  segments_.release(replica.chain);
  replica.chain = 0;
  if (!packed.empty()) {
    const Result<SegmentStore::Chain> chain = segments_.write(packed);
    TESSERA_ASSERT(chain.ok());
    replica.chain = *chain;
  }
  replica.bytes = static_cast<std::uint32_t>(packed.size());
  replica.version = version;
  contribution.segments += wanted - held;
  return Change::kTaken;
}

void Replicas::drop(std::uint32_t number) noexcept {
  Replica& replica = records_[number - 1];
  Contribution& contribution = contributions_[replica.slot];
  contribution.segments -= SegmentStore::segments_of(replica.bytes);
  segments_.release(replica.chain);
  index_.erase(index_key(replica.slot, replica.key),
               [=](std::uint32_t other) { return other == number; });
  if (replica.previous != 0) {
    records_[replica.previous - 1].next = replica.next;
  } else {
    contribution.first_block = replica.next;
  }
  if (replica.next != 0) records_[replica.next - 1].previous = replica.previous;
  --contribution.blocks;
  --blocks_;
  replica.next = free_records_;
  free_records_ = number;
}

ReplicasUsage Replicas::usage() const noexcept {
  ReplicasUsage usage = counted_;
  usage.contributions = present_;
  usage.blocks = blocks_;
  usage.segments = segments_.used_segments();
  usage.used_bytes = std::size_t{usage.segments} * SegmentStore::kSegmentBytes +
                     std::size_t{blocks_} * sizeof(Replica) + index_.used_bytes();
  return usage;
}

}  // namespace tessera
