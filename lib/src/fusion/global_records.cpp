// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/internal/global_records.hpp"

#include "tessera/base/internal/put_in_place.hpp"

namespace tessera {

namespace {

template <class Visit>
void for_blocks(const GridTransform::BlockRange& range, Visit&& visit) noexcept {
  for (std::int32_t z = range.first.z; z <= range.last.z; ++z) {
    for (std::int32_t y = range.first.y; y <= range.last.y; ++y) {
      for (std::int32_t x = range.first.x; x <= range.last.x; ++x) visit(BlockCoord{x, y, z});
    }
  }
}

}  // namespace

Result<GlobalRecords> GlobalRecords::make(Arena& arena, std::uint32_t blocks,
                                          std::uint64_t hash_seed) noexcept {
  GlobalRecords made;
  const Status status =
      put_in_place(made.index_, [&] { return BlockIndex::make(arena, blocks, hash_seed); });
  if (status != Status::kOk) return status;
  const std::span<std::byte> bytes = arena.take_untouched(arena_bytes<GlobalRecord>(blocks));
  if (bytes.empty()) return Status::kResourceExhausted;
  made.records_ = {reinterpret_cast<GlobalRecord*>(bytes.data()), blocks};
  return made;
}

std::uint32_t GlobalRecords::find(BlockCoord block) const noexcept {
  const Result<BlockKey> key = pack(block);
  if (!key.ok()) return 0;
  return index_.find(*key, [&](std::uint32_t number) { return at(number).key == key->bits; });
}

/// 0 iff there is no place for it.
std::uint32_t GlobalRecords::open(BlockCoord block) noexcept {
  if (const std::uint32_t number = find(block); number != 0) return number;
  const Result<BlockKey> key = pack(block);
  const bool full = free_ == 0 && used_ == records_.size();
  const Result<BlockIndex::Place> place =
      !key.ok() || full ? Result<BlockIndex::Place>(Status::kOutOfRange) : index_.make_room(*key);
  if (!place.ok()) {
    ++refused_;
    return 0;
  }
  std::uint32_t number = free_;
  if (number != 0) {
    free_ = at(number).link.next;
  } else {
    number = ++used_;
  }
  at(number) = {};
  at(number).key = key->bits;
  index_.insert(*place, *key, number);
  ++size_;
  return number;
}

void GlobalRecords::close(std::uint32_t number) noexcept {
  GlobalRecord& record = at(number);
  set_moved(record);
  take_off(number);
  index_.erase(BlockKey{record.key}, [=](std::uint32_t other) { return other == number; });
  record = {};
  record.key = kClosed;
  record.link.next = free_;
  free_ = number;
  --size_;
}

void GlobalRecords::mark(std::uint32_t number, Agenda::Work work) noexcept {
  AgendaLink& link = at(number).link;
  if (work == Agenda::kOutput && link.list != 0) {
    at(number).output_due = Agenda::work_of(link) == Agenda::kSums;
    return;
  }
  if (link.list != 0 && Agenda::work_of(link) == Agenda::kSums) return;
  if (link.list != 0) at(number).output_due = true;
  take_off(number);
  agenda_.append(*this, number, work, focus_ ? Agenda::ring_of(block_of(number), *focus_) : 0);
}

void GlobalRecords::set_part(GlobalRecord& record, UpdatePart part) noexcept {
  if (part == UpdatePart::kUpdate) return;
  record.hidden = true;
  if (part != UpdatePart::kMove) return;
  moving_ += record.moving ? 0U : 1U;
  record.moving = true;
}

bool GlobalRecords::mark_sums(const BlockRange& range, UpdatePart part) noexcept {
  bool all = true;
  for_blocks(range, [&](BlockCoord block) {
    const std::uint32_t number = open(block);
    all = all && number != 0;
    if (number == 0) return;
    set_part(at(number), part);
    set_up_to_date(at(number));
    mark(number, Agenda::kSums);
  });
  return all;
}

void GlobalRecords::mark_refused() noexcept {
  for (std::uint32_t number = 1; number <= used_; ++number) {
    GlobalRecord& record = at(number);
    if (record.key == kClosed || !record.refused) continue;
    // Its sums may be as they were.
    record.output_due = record.sums.any();
    mark(number, Agenda::kSums);
  }
}

void GlobalRecords::mark_outputs(const BlockRange& range, UpdatePart part) noexcept {
  for_blocks(range, [&](BlockCoord block) {
    const std::uint32_t number = find_with_sums(block);
    if (number == 0) return;
    set_part(at(number), part);
    mark(number, Agenda::kOutput);
  });
}

}  // namespace tessera
