// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How one block of the global map is brought up to date: its sums, what it says of the robots, and
// what it becomes.
#include "tessera/fusion/global_map.hpp"

namespace tessera {

std::uint64_t GlobalMap::update_first() noexcept {
  const std::uint32_t number = records_.first();
  if (number == 0) return 0;
  if (records_.work_of(number) == Agenda::kSums) return update_sums(number);
  if (records_.waits_for_output(number)) return job_.begin(records_, sums_, number);
  // It has left the graph since.
  records_.take_off(number);
  records_.set_moved(records_.at(number));
  return 1;
}

std::uint64_t GlobalMap::update_sums(std::uint32_t number) noexcept {
  GlobalRecord& record = records_.at(number);
  records_.take_off(number);
  record.refused = false;
  const BlockCoord block = records_.block_of(number);
  BlockContent& content = fused_.content();
  content.clear();
  const BlockSums::Added added = adder_.add_up(replicas_, weights_, block, content);
  keep_tallies(record, added.tallies);
  records_.set_up_to_date(record);
  record.robots = added.robots;
  record.classes = added.classes;
  record.objected = added.objected;
  record.disputed = added.disputed;
  const bool graph = belongs_to_graph(record.robots);
  if (graph && config_.diffusion.mode != DiffusionMode::kNone && keep_sums(number, block))
    return added.work + 1;
  record.output_due = false;
  const bool left_graph = record.sums.any();
  sums_.drop(record.sums);
  record.statistics = {};
  if (left_graph) records_.mark_outputs(job_.around(block), record.part());
  if (graph && config_.diffusion.mode == DiffusionMode::kNone) record.statistics = fused_.measure();
  const bool empty = !content.any();
  write_content(record, block);
  records_.set_moved(record);
  // One whose robots count nothing now may count again.
  if (empty && added.robots == 0) records_.close(number);
  return added.work + 1 + kBlockOctets;
}

/// What the block says of the robots takes the place of what it said before.
void GlobalMap::keep_tallies(GlobalRecord& record, std::span<const LabelTally> tallies) noexcept {
  const std::span<const std::byte> bytes = std::as_bytes(tallies);
  if (record.tallies.any() ? sums_.is(record.tallies, bytes) : bytes.empty()) return;
  if (record.tallies.any()) {
    const std::span<const std::byte> before = sums_.read(record.tallies);
    weights_.subtract(
        {reinterpret_cast<const LabelTally*>(before.data()), before.size() / sizeof(LabelTally)});
    sums_.drop(record.tallies);
  }
  if (bytes.empty()) return;
  if (sums_.keep(record.tallies, bytes) == SumStore::Kept::kNoRoom) {
    ++counted_.refused_tallies;
    record.refused = any_refused_ = true;
    return;
  }
  weights_.add(tallies);
}

/// Robots are weighed once nothing waits, or much has changed; then the blocks where that matters
/// are to be added up again. What blocks say of the robots does not depend on it.
std::uint64_t GlobalMap::weigh_robots(std::uint64_t budget) noexcept {
  std::uint64_t work = 0;
  if (weights_.changed() && (records_.waiting() == 0 || weights_.overdue())) {
    const RobotWeights::Changed changed = weights_.update(work);
    if (changed.robots != 0) next_to_mark_ = 1;
    to_mark_.robots |= changed.robots;
    to_mark_.classes |= changed.classes;
  }
  for (; to_mark_.robots != 0 && work < budget; ++work, ++next_to_mark_) {
    if (next_to_mark_ > records_.last()) {
      to_mark_ = {};
    } else if (records_.is_open(next_to_mark_)) {
      const GlobalRecord& record = records_.at(next_to_mark_);
      if ((record.robots & to_mark_.robots) != 0 && (record.classes & to_mark_.classes) != 0)
        records_.mark_again(next_to_mark_);
    }
  }
  return work;
}

/// Of a block that is diffused. False iff there is no room: counted, and it is undiffused then.
bool GlobalMap::keep_sums(std::uint32_t number, BlockCoord block) noexcept {
  GlobalRecord& record = records_.at(number);
  if (!fused_.content().any()) return false;
  if (config_.diffusion.mode == DiffusionMode::kPaper) adder_.add_priors(fused_.content());
  const std::uint64_t classes =
      (std::uint64_t{1} << static_cast<unsigned>(maps_.map().num_components() - 1)) - 2;
  record.sums.classes = fused_.content().components() & classes;
  const SumStore::Kept kept = sums_.keep(record.sums, fused_.content());
  if (kept == SumStore::Kept::kAnew) records_.mark_outputs(job_.around(block), record.part());
  if (kept == SumStore::Kept::kAsBefore) {
    record.output_due ? records_.mark(number, Agenda::kOutput) : records_.set_moved(record);
  }
  record.output_due = false;
  if (kept == SumStore::Kept::kNoRoom) {
    ++counted_.refused_sums;
    record.refused = any_refused_ = true;
  }
  return kept != SumStore::Kept::kNoRoom;
}

/// A block that only one robot has labels of is as it says; all others, or all of the map, diffuse.
bool GlobalMap::belongs_to_graph(std::uint64_t robots) const noexcept {
  return config_.diffusion.whole_map ? robots != 0 : (robots & (robots - 1)) != 0;
}

std::uint64_t GlobalMap::work_on_job() noexcept {
  if (!job_.finishing()) return job_.work_on(records_, sums_);
  // Also if something arrived for it meanwhile: it is behind then, and will be due again, but a
  // block for which something always arrives must be seen.
  GlobalRecord& record = records_.at(job_.next());
  const BlockCoord block = records_.block_of(job_.next());
  std::uint64_t work = fused_.take(sums_.read(record.sums));
  record.statistics = fused_.diffuse(block, job_.brick(), work);
  write_content(record, block);
  records_.set_moved(record);
  job_.done();
  return work;
}

void GlobalMap::write_content(GlobalRecord& record, BlockCoord block) noexcept {
  counted_.saturated_voxels += fused_.scale_to_passes();
  const Phase phase = moves_.phase();
  if (phase != Phase::kStaging && phase != Phase::kMarking) record.hidden = false;
  if (phase == Phase::kStaging && (record.hidden || maps_.is_staged(block))) {
    if (maps_.stage(block, fused_.content())) return;
    ++counted_.torn_blocks;
  }
  if (!maps_.replace(block, fused_.content())) {
    ++counted_.refused_outputs;
    record.refused = any_refused_ = true;
  }
  if (phase == Phase::kMerging) maps_.unstage(block);
}

}  // namespace tessera
