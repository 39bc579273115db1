// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What arrives, and what it marks.
#include "tessera/fusion/global_map.hpp"

namespace tessera {

namespace {

constexpr std::uint64_t kClosed = ~std::uint64_t{0};

}  // namespace

std::uint32_t GlobalMap::find_record(BlockCoord block) const noexcept {
  const Result<BlockKey> key = pack(block);
  if (!key.ok()) return 0;
  return index_.find(*key,
                     [&](std::uint32_t number) { return records_.at(number).key == key->bits; });
}

/// 0 iff there is no place for it.
std::uint32_t GlobalMap::open_record(BlockCoord block) noexcept {
  if (const std::uint32_t number = find_record(block); number != 0) return number;
  const Result<BlockKey> key = pack(block);
  const bool full = free_records_ == 0 && records_used_ == config_.blocks;
  const Result<BlockIndex::Place> place =
      !key.ok() || full ? Result<BlockIndex::Place>(Status::kOutOfRange) : index_.make_room(*key);
  if (!place.ok()) {
    ++counted_.refused_blocks;
    return 0;
  }
  std::uint32_t number = free_records_;
  if (number != 0) {
    free_records_ = records_.at(number).link.next;
  } else {
    number = ++records_used_;
  }
  records_.at(number) = {};
  records_.at(number).key = key->bits;
  index_.insert(*place, *key, number);
  ++blocks_;
  return number;
}

void GlobalMap::close_record(std::uint32_t number) noexcept {
  Record& record = records_.at(number);
  moved(record);
  agenda_.remove(records_, number);
  index_.erase(BlockKey{record.key}, [=](std::uint32_t other) { return other == number; });
  record = {};
  record.key = kClosed;
  record.link.next = free_records_;
  free_records_ = number;
  --blocks_;
}

void GlobalMap::mark(std::uint32_t number, Agenda::Work work) noexcept {
  AgendaLink& link = records_.link(number);
  if (work == Agenda::kOutput && link.list != 0) {
    records_.at(number).output_due = Agenda::work_of(link) == Agenda::kSums;
    return;
  }
  if (link.list != 0 && Agenda::work_of(link) == Agenda::kSums) return;
  if (link.list != 0) records_.at(number).output_due = true;
  agenda_.remove(records_, number);
  const BlockCoord block = unpack(BlockKey{records_.at(number).key});
  agenda_.append(records_, number, work, focus_ ? Agenda::ring_of(block, *focus_) : 0);
}

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

/// Places for the blocks that a local one goes to; all are marked, so one that stays empty is
/// closed again.
bool GlobalMap::open_records(const GridTransform& T_global_local, BlockCoord local,
                             Part part) noexcept {
  bool all = true;
  for_blocks(T_global_local.global_blocks(local), [&](BlockCoord block) {
    // One without a place keeps none of the others from being marked: what a move leaves must go.
    const std::uint32_t number = open_record(block);
    all = all && number != 0;
    if (number == 0) return;
    set_part(records_.at(number), part);
    mark(number, Agenda::kSums);
  });
  return all;
}

/// The graph's blocks that depend on this one's sums.
void GlobalMap::mark_halo(BlockCoord block, Part part) noexcept {
  const int reach = (brick_.halo() + kBlockEdge - 1) / kBlockEdge;
  const GridTransform::BlockRange range{{block.x - reach, block.y - reach, block.z - reach},
                                        {block.x + reach, block.y + reach, block.z + reach}};
  for_blocks(range, [&](BlockCoord near) {
    const std::uint32_t number = find_record(near);
    if (number == 0 || records_.at(number).sums == 0) return;
    set_part(records_.at(number), part);
    mark(number, Agenda::kOutput);
  });
}

Result<GlobalMap::Slot> GlobalMap::open(const ContributionId& id,
                                        const GridTransform& T_global_local) noexcept {
  if (const Result<Slot> known = replicas_.find(id); known.ok()) return known;
  const Result<Slot> slot = replicas_.open(id);
  if (slot.ok()) replicas_.set_frame(*slot, T_global_local, 0);
  return slot;
}

Result<Replicas::Change> GlobalMap::put(Slot slot, BlockKey key, const PartVersion& version,
                                        std::span<const std::byte> packed,
                                        std::span<const std::byte> wire) noexcept {
  if (!packed.empty() && check_packed(packed, map_->num_components()) != Status::kOk)
    return Status::kCorrupt;
  const Replicas::Contribution& contribution = replicas_.contribution(slot);
  const Move& move = moves_[slot];
  if (!contribution.present) return Status::kInvalidArgument;
  if (contribution.leaving || move.leaves) return Status::kBusy;
  if (replicas_.news(slot, key, version) != 0) {
    // While its move is marked, wherever it is and wherever it will be. Once that is done the move
    // does not wait for what arrives, which would put it off for as long as something does.
    const bool marking = move.under_way && phase_ == Phase::kMarking;
    const Part part = marking ? Part::kMove : (move.under_way ? Part::kMovedUpdate : Part::kUpdate);
    if (!open_records(contribution.T_global_local, unpack(key), part) ||
        (marking && !open_records(move.to, unpack(key), part)))
      return Status::kResourceExhausted;
  }
  return replicas_.put(slot, key, version, packed, wire);
}

std::uint64_t GlobalMap::work_on_moves(std::uint64_t budget) noexcept {
  if (phase_ == Phase::kSettled && moves_waiting_ != 0) begin_moves();
  if (phase_ == Phase::kMarking) return mark_moves(budget);
  // Half of it, if something else waits.
  if (phase_ == Phase::kMerging)
    return merge_staged((budget + 1) / (agenda_.waiting() != 0 ? 2 : 1));
  return 0;
}

std::uint64_t GlobalMap::update_first() noexcept {
  const std::uint32_t number = agenda_.first();
  if (number == 0) return 0;
  return Agenda::work_of(records_.link(number)) == Agenda::kSums ? update_sums(number)
                                                                 : begin_job(number);
}

std::uint64_t GlobalMap::step(std::uint64_t budget) noexcept {
  if (busy()) map_->begin_revision();
  std::uint64_t work = 0;
  while (work < budget && busy()) {
    if (job_.stage != Job::Stage::kNone) {
      work += go_on();
      continue;
    }
    work += work_on_moves(budget - work);
    // Marks are complete before anything is brought up to date by them.
    if (phase_ == Phase::kMarking || work >= budget) continue;
    work += update_first();
    const bool complete = records_moving_ == 0 && job_.stage == Job::Stage::kNone;
    if (phase_ == Phase::kStaging && complete) show_moves();
  }
  return work;
}

GlobalMapReport GlobalMap::report() const noexcept {
  GlobalMapReport report = counted_;
  report.blocks = blocks_;
  report.waiting = waiting();
  report.replicas = replicas_.usage();
  report.sum_bytes = std::size_t{sums_.used_segments()} * SegmentStore::kSegmentBytes;
  const std::size_t records = arena_bytes<Record>(records_used_);
  report.used_bytes = scratch_bytes(config_, map_->num_components()) + map_->usage().used_bytes +
                      staged_->usage().used_bytes + report.replicas.used_bytes + report.sum_bytes +
                      index_.used_bytes() + records;
  std::uint64_t variance = 0;
  std::uint64_t undiffused = 0;
  double largest_sum = 0.0;
  double largest_change = 0.0;
  for (std::uint32_t number = 1; number <= records_used_; ++number) {
    const Record& record = records_.at(number);
    if (record.key == kClosed || record.statistics.nodes == 0) continue;
    const NodeStatistics& of_block = record.statistics;
    ++report.overlap_blocks;
    report.nodes += of_block.nodes;
    variance += of_block.variance;
    undiffused += of_block.variance_undiffused;
    const auto larger = [](double& most, float value) {
      if (static_cast<double>(value) > most) most = static_cast<double>(value);
    };
    larger(largest_sum, of_block.largest_sum);
    larger(largest_change, of_block.largest_change);
  }
  if (report.nodes != 0) {
    const double unit = 0x1p-40 / static_cast<double>(report.nodes);
    report.mean_variance = static_cast<double>(variance) * unit;
    report.mean_variance_undiffused = static_cast<double>(undiffused) * unit;
    report.residual = largest_sum > 0.0 ? largest_change / largest_sum : 0.0;
  }
  return report;
}

}  // namespace tessera
