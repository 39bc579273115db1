// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/internal/block_sums.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

#include "block_adders.hpp"
#include "tessera/base/internal/put_in_place.hpp"
#include "tessera/replica/contribution_kind.hpp"

namespace tessera {

Result<BlockSums> BlockSums::make(Arena& arena, const GlobalMapConfig& config, int num_components,
                                  std::span<std::byte> scratch) noexcept {
  BlockSums made;
  Status status = put_in_place(made.share_, [&] {
    return RobotShare::make(arena, num_components, config.replicas.contributions,
                            config.max_evidence, config.map.free_weight);
  });
  if (status == Status::kOk)
    status = put_in_place(made.sessions_, [&] {
      return SessionShare::make(arena, num_components, config.replicas.contributions,
                                config.max_evidence, config.map.free_weight);
    });
  if (status == Status::kOk)
    status = put_in_place(made.opinions_, [&] {
      return Opinions::make(arena, most_robots(config.replicas), num_components,
                            config.map.free_weight);
    });
  if (status != Status::kOk) return status;
  made.factors_ = arena.take<float>(static_cast<std::size_t>(num_components));
  made.doubted_ = arena.take<float>(kBlockVoxels);
  made.omega_ = config.diffusion.omega;
  made.prior_ = config.diffusion.prior;
  made.last_class_ = num_components - 2;
  made.observers_ = arena.take<std::uint8_t>(kBlockVoxels);
  made.scratch_ = scratch;
  made.taken_ = arena.take<VoxelCoord>(kBlockVoxels);
  made.next_ = arena.take<std::int16_t>(kBlockVoxels);
  made.taken_in_ = arena.take<std::uint8_t>(kBlockVoxels);
  made.first_ = arena.take<std::int16_t>(kBlockVoxels);
  made.free_weight_ = config.map.free_weight;
  made.holders_ = arena.take<std::uint8_t>(kBlockVoxels);
  made.weights_ = arena.take<float>(kBlockVoxels);
  made.objectors_ = arena.take<std::uint8_t>(kBlockVoxels);
  const std::span<Turned> turned = arena.take<Turned>(1);
  if (turned.empty()) return Status::kResourceExhausted;
  made.turned_ = turned.data();
  return made;
}

namespace {

std::uint16_t count_voxels(const VoxelMask& mask) noexcept {
  int count = 0;
  for (const std::uint64_t slice : mask) count += count_ones(slice);
  return static_cast<std::uint16_t>(count);
}

}  // namespace

template <class Adder>
std::uint64_t BlockSums::add_replica(const Source& source, const Replicas::Replica& replica,
                                     RowTargets& targets, Adder& adder,
                                     TurnedPasses* passes) noexcept {
  targets.set_layers(replica.live);
  if (any_objections_) count_objectors(source, replica);
  turned_->centroids.fill({});
  VoxelMask labelled{};
  std::span<const RowTargets::Target> of_voxel;
  const auto counts = [this](int row, int target) {
    return !any_objections_ || !is_objected(row, target);
  };
  const auto begin_voxel = [&](int row, Centroid centroid) {
    add_row(labelled, row);
    turned_->centroids[static_cast<std::size_t>(row)] = centroid;
    of_voxel = targets.of(row, centroid);
    for (const RowTargets::Target& target : of_voxel) {
      if (target.part > 0.0F) adder.observe(target.row);
      if (counts(row, target.row)) passes->add_surface(target);
    }
  };
  const auto add_labels = [&](int row, int component, float count) {
    for (const RowTargets::Target& target : of_voxel)
      if (target.part > 0.0F && counts(row, target.row))
        adder.add_labels(target.row, component, target.part * count);
  };
  const auto add_passes = [&](int row, unsigned count) {
    const bool is_new = !has_row(labelled, row);
    for (const RowTargets::Target& target :
         targets.of(row, turned_->centroids[static_cast<std::size_t>(row)])) {
      if (is_new || !(target.part > 0.0F)) adder.observe(target.row);
      passes->add(target, count, counts(row, target.row));
    }
  };
  const std::uint64_t looked = any_objections_ ? source.replicas.objections().size() : 0;
  // A turned voxel goes to several.
  const std::uint64_t each = source.contribution.T_global_local.shift_only() ? 1 : 2;
  return looked + each * unpack_block(source.replicas.read(replica, scratch_), begin_voxel,
                                      add_labels, add_passes);
}

/// Parts in the order of their lowest layers, which is no matter of when they came.
template <class Adder>
std::uint64_t BlockSums::add_local_block(const Source& source, Slot slot, BlockCoord local,
                                         Adder& adder, TurnedPasses* passes) noexcept {
  const Result<BlockKey> key = pack(local);
  const Replicas::Replica* const first = key.ok() ? source.replicas.find(slot, *key) : nullptr;
  if (first == nullptr) return 1;
  adder.enter();
  const auto for_parts = [&](auto&& add) {
    std::uint64_t work = 1;
    for (int layer = 0; layer < kBlockLayers; ++layer) {
      for (const Replicas::Replica* part = first; part != nullptr;
           part = source.replicas.next_part(*part))
        if (part->bytes != 0 && std::countr_zero(part->live) == layer) work += add(*part);
    }
    return work;
  };
  const GridTransform& T_global_local = source.contribution.T_global_local;
  if (!any_objections_ && T_global_local.shift_only())
    return for_parts(
        [&](const Replicas::Replica& part) { return add_shifted(source, part, local, adder); });
  RowTargets targets(*this, adder.hidden(), T_global_local, local, source.block);
  return for_parts([&](const Replicas::Replica& part) {
    return add_replica(source, part, targets, adder, passes);
  });
}

template <class Adder>
std::uint64_t BlockSums::add_blocks(const Source& source, Slot slot, Adder& adder,
                                    TurnedPasses* passes) noexcept {
  const GridTransform::BlockRange range =
      source.contribution.T_global_local.local_blocks(source.block);
  if (!source.contribution.may_have(range)) return 1;
  if (!source.contribution.T_global_local.shift_only()) {
    source.contribution.T_global_local.to_local(source.block, taken_);
    for (std::size_t row = 0; row < taken_.size(); ++row)
      taken_in_[row] = place_in(range.first, block_of(taken_[row]));
  }
  std::uint64_t work = 0;
  for (std::int32_t z = range.first.z; z <= range.last.z; ++z)
    for (std::int32_t y = range.first.y; y <= range.last.y; ++y)
      for (std::int32_t x = range.first.x; x <= range.last.x; ++x)
        work += add_local_block(source, slot, {x, y, z}, adder, passes);
  return work;
}

template <class Adder>
std::uint64_t BlockSums::add_contribution(const Source& source, Slot slot, Adder& adder) noexcept {
  if (!source.contribution.counts()) return 0;
  TurnedPasses passes(*this);
  const std::uint64_t work = add_blocks(source, slot, adder, &passes);
  passes.give(adder);
  return work;
}

/// Robots that have each voxel occupied; all map sessions together are one.
void BlockSums::count_holders(const Replicas& replicas, BlockCoord block, Added& added) noexcept {
  std::fill(holders_.begin(), holders_.end(), std::uint8_t{0});
  objected_ = disputed_ = {};
  any_objections_ = false;  // what they have, whoever objects
  const std::span<const Slot> all = replicas.in_order();
  const auto count = [&](std::span<const Slot> contributions, bool of_sessions) {
    VoxelMask any{};
    ToHolders adder(*this, any);
    for (const Slot slot : contributions) {
      const Replicas::Contribution& one = replicas.contribution(slot);
      if (one.hidden) continue;
      const bool is_session = MapSession::is(one.id.submap) && one.session.weight != 0;
      if (of_sessions ? is_session : is_map(one.id))
        added.work += add_contribution({replicas, one, block}, slot, adder);
    }
    for_rows(any, [this](int row) {
      const auto at = static_cast<std::size_t>(row);
      if (weights_[at] > 0.0F) ++holders_[at];
    });
  };
  for (std::size_t first = 0, next = 0; first < all.size(); first = next) {
    const std::uint32_t robot = replicas.contribution(all[first]).id.robot;
    while (next < all.size() && replicas.contribution(all[next]).id.robot == robot) ++next;
    count(all.subspan(first, next - first), false);
  }
  count(all, true);
  any_objections_ = true;
}

/// Calls use(slot, is_oldest) for all of one robot, given by ascending id: its newest epoch first.
/// Before each epoch begin(); is_oldest: it is of the last one.
template <class Begin, class Use>
void BlockSums::by_epochs(const Replicas& replicas, std::span<const Slot> contributions,
                          Begin&& begin, Use&& use) noexcept {
  const auto epoch = [&](std::size_t at) {
    return replicas.contribution(contributions[at]).id.epoch;
  };
  for (std::size_t last = contributions.size(); last != 0;) {
    std::size_t first = last - 1;
    while (first != 0 && epoch(first - 1) == epoch(first)) --first;
    begin();
    for (const Slot slot : contributions.subspan(first, last - first)) use(slot, first == 0);
    last = first;
  }
}

/// What one robot has. contributions: all of it, by ascending id.
std::uint64_t BlockSums::gather_robot(const Replicas& replicas, std::span<const Slot> contributions,
                                      BlockCoord block, std::uint64_t& robots) noexcept {
  std::uint64_t work = 0;
  ToRobot adder(*this);
  share_.begin_robot();
  by_epochs(
      replicas, contributions, [&] { share_.begin_epoch(); },
      [&](Slot slot, bool is_oldest) {
        const Replicas::Contribution& one = replicas.contribution(slot);
        if (!is_map(one.id) || one.hidden) return;
        work += share_.begin_submap(one.id.submap);
        work += add_contribution({replicas, one, block}, slot, adder);
        if (!is_oldest) share_.end_submap(one.id.submap);
      });
  const unsigned bit = replicas.contribution(contributions.front()).robot_bit;
  robots |= std::uint64_t{adder.labelled() ? 1U : 0U} << bit;
  return work + share_.end_robot();
}

/// Of one robot, as above: that of a newer epoch counts before what an earlier start had of it.
std::uint64_t BlockSums::add_sessions(const Replicas& replicas, std::span<const Slot> contributions,
                                      BlockCoord block) noexcept {
  std::uint64_t work = 0;
  by_epochs(
      replicas, contributions, [] {},
      [&](Slot slot, bool) {
        const Replicas::Contribution& one = replicas.contribution(slot);
        if (!MapSession::is(one.id.submap) || one.session.weight == 0 || one.hidden) return;
        work += sessions_.begin(one.session);
        ToSessions adder(sessions_);
        work += add_contribution({replicas, one, block}, slot, adder);
        sessions_.end();
      });
  return work;
}

BlockSums::Added BlockSums::add_up(const Replicas& replicas, const RobotWeights& weights,
                                   BlockCoord block, BlockContent& content) noexcept {
  std::memset(observers_.data(), 0, observers_.size());
  const std::span<const Slot> all = replicas.in_order();
  Added added;
  any_objections_ = false;
  if (!replicas.objections().empty()) {
    for (const Slot slot : all)
      added.work += look_for_objections({replicas, replicas.contribution(slot), block}, slot,
                                        any_objections_);
    if (any_objections_) count_holders(replicas, block, added);
  }
  sessions_.begin_block();
  opinions_.begin_block();
  any_doubted_ = false;
  for (std::size_t first = 0, next = 0; first < all.size(); first = next) {
    const std::uint32_t robot = replicas.contribution(all[first]).id.robot;
    bool has_sessions = false;
    for (; next < all.size() && replicas.contribution(all[next]).id.robot == robot; ++next)
      has_sessions = has_sessions || MapSession::is(replicas.contribution(all[next]).id.submap);
    const std::span<const Slot> of_robot = all.subspan(first, next - first);
    added.work += gather_robot(replicas, of_robot, block, added.robots);
    if (share_.entered()) added.classes |= share_.content().components();
    add_robot(weights, replicas.contribution(of_robot.front()).robot_bit, content);
    if (has_sessions) added.work += add_sessions(replicas, of_robot, block);
  }
  bool labelled = false;
  added.work += sessions_.end_block(content, omega_, last_class_, labelled);
  if (labelled) added.robots |= added.robots + 1;
  if (any_doubted_) add_doubted(content);
  added.tallies = opinions_.tally();
  added.work += opinions_.robots() * kBlockOctets + added.tallies.size();
  if (any_objections_) {
    added.objected = count_voxels(objected_);
    added.disputed = count_voxels(disputed_);
  }
  return added;
}

void BlockSums::add_priors(BlockContent& content) const noexcept {
  const auto prior = prior_ * omega_;
  for (int row = 0; row < kBlockVoxels; ++row) {
    const auto observers = static_cast<float>(observers_[static_cast<std::size_t>(row)]);
    bool node = false;
    for (int l = 1; l <= last_class_; ++l) node = node || content.count(l, row) > 0.0F;
    for (int l = 1; node && l <= last_class_; ++l) content.add(l, row, prior * observers);
  }
}

}  // namespace tessera
