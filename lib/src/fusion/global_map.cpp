// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/global_map.hpp"

#include "tessera/base/internal/put_in_place.hpp"
#include "tessera/frames/frame_statements.hpp"

namespace tessera {

namespace {

bool in_range(const DiffusionConfig& config) noexcept {
  const int least = config.mode == DiffusionMode::kPaper ? 1 : 0;
  return config.mode <= DiffusionMode::kNone && config.edge <= EdgeTerm::kConfidence &&
         config.iterations >= least && config.iterations <= DiffusionConfig::kMostHalo &&
         config.length_m > 0.0F && config.length_m <= 1e6F && config.alpha > 0.0F &&
         config.alpha < 1.0F && config.omega >= 1e-6F && config.omega <= 1000.0F &&
         config.prior >= 0.0F && config.prior <= 1e6F && config.reliability_alarm >= 0.0F &&
         config.reliability_alarm <= 1.0F;
}

/// Not in the frame of set_up(), below which all others are.
[[gnu::noinline]] bool can_be_made(const GlobalMapConfig& config) noexcept {
  const bool capped = config.max_evidence >= 0.0F && config.max_evidence <= 1e6F;
  if (!in_range(config.diffusion) || !tessera::in_range(config.map) || !capped) return false;
  const DiffusionStencil stencil(static_cast<double>(config.diffusion.length_m) /
                                 config.map.resolution_m);
  return DiffusionBrick::halo_of(config.diffusion, stencil) <= DiffusionConfig::kMostHalo;
}

}  // namespace

Result<GlobalMap> GlobalMap::make(Arena& arena, const GlobalMapConfig& config,
                                  const ClassTable& classes) noexcept {
  Result<GlobalMap> made = GlobalMap();
  const Status status = made->set_up(arena, config, classes);
  if (status != Status::kOk) made = status;
  return made;
}

Status GlobalMap::set_up(Arena& arena, const GlobalMapConfig& config,
                         const ClassTable& classes) noexcept {
  config_ = config;
  if (!can_be_made(config_)) return Status::kInvalidArgument;
  config_.map.label_votes = false;
  // `none` and `paper` are the paper's, to the letter.
  if (config_.diffusion.mode != DiffusionMode::kContractive)
    config_.map.probabilities = Probabilities::kShares;
  const Status status = put_in_place(maps_, [&] { return TwoMaps::make(arena, config_, classes); });
  return status == Status::kOk ? set_up_replicas(arena, maps_.map().num_components()) : status;
}

Status GlobalMap::set_up_replicas(Arena& arena, int components) noexcept {
  Status status = put_in_place(
      replicas_, [&] { return Replicas::make(arena, config_.replicas, config_.map.hash_seed); });
  if (status == Status::kOk) status = set_up_moves(arena);
  if (status == Status::kOk)
    status = put_in_place(records_, [&] {
      return GlobalRecords::make(arena, config_.blocks, config_.map.hash_seed);
    });
  return status == Status::kOk ? set_up_fusion(arena, components) : status;
}

Status GlobalMap::set_up_moves(Arena& arena) noexcept {
  RobotPlaces places;
  const Status status = put_in_place(places, [&] {
    return RobotPlaces::make(arena, config_.map.resolution_m, !config_.place_robots);
  });
  if (status != Status::kOk) return status;
  return put_in_place(
      moves_, [&] { return FrameMoves::make(arena, config_.replicas.contributions, places); });
}

Status GlobalMap::set_up_fusion(Arena& arena, int components) noexcept {
  const std::span<std::byte> scratch = arena.take<std::byte>(most_packed_bytes(components));
  if (scratch.empty()) return Status::kResourceExhausted;
  Status status =
      put_in_place(adder_, [&] { return BlockSums::make(arena, config_, components, scratch); });
  if (status == Status::kOk)
    status =
        put_in_place(sums_, [&] { return SumStore::make(arena, config_.sum_segments, scratch); });
  if (status == Status::kOk)
    status = put_in_place(job_, [&] {
      return OutputJob::make(arena, config_.diffusion, config_.map.resolution_m, components);
    });
  if (status == Status::kOk)
    status = put_in_place(fused_, [&] { return FusedBlock::make(arena, config_, components); });
  if (status == Status::kOk)
    status = put_in_place(weights_, [&] {
      return RobotWeights::make(arena, most_robots(config_.replicas), components,
                                config_.diffusion);
    });
  return status;
}

// --- What arrives --------------------------------------------------------------------------------

Result<GlobalMap::Slot> GlobalMap::open(const ContributionId& id,
                                        const GridTransform& T_global_local) noexcept {
  if (const Result<Slot> known = replicas_.find(id); known.ok()) return known;
  const Result<Slot> slot = replicas_.open(id);
  if (slot.ok()) moves_.open(replicas_, *slot, T_global_local);
  return slot;
}

Result<Replicas::Change> GlobalMap::put(Slot slot, BlockKey key, const PartVersion& version,
                                        std::span<const std::byte> packed,
                                        std::span<const std::byte> wire) noexcept {
  if (Objection::is(replicas_.contribution(slot).id.submap))
    return put_objection(slot, key, version, packed, wire);
  if (FrameStatements::is(replicas_.contribution(slot).id.submap))
    return put_frame_statement(slot, key, version, packed, wire);
  if (!packed.empty() && check_packed(packed, maps_.map().num_components()) != Status::kOk)
    return Status::kCorrupt;
  const Replicas::Contribution& contribution = replicas_.contribution(slot);
  if (!contribution.present) return Status::kInvalidArgument;
  if (contribution.leaving || moves_.leaving(slot)) return Status::kBusy;
  if (replicas_.news(slot, key, version) != 0 &&
      !moves_.mark_change(replicas_, records_, slot, key))
    return Status::kResourceExhausted;
  return replicas_.put(slot, key, version, packed, wire);
}

/// What is in the place is marked, and what was. Where a block has no place in the global grid
/// there is nothing to object to.
Result<Replicas::Change> GlobalMap::put_objection(Slot slot, BlockKey place,
                                                  const PartVersion& version,
                                                  std::span<const std::byte> packed,
                                                  std::span<const std::byte> wire) noexcept {
  Objection objection;
  if (!objection.read(packed) || Objection::place_of(objection.against, objection.key) != place)
    return Status::kCorrupt;
  const Replicas::Contribution& contribution = replicas_.contribution(slot);
  if (!contribution.present) return Status::kInvalidArgument;
  if (contribution.leaving || moves_.leaving(slot)) return Status::kBusy;
  if (replicas_.news(slot, place, version) == 0)
    return replicas_.put(slot, place, version, packed, wire);
  Objection before;
  const bool had_one = read_objection(replicas_, replicas_.find(slot, place), before);
  const Result<Replicas::Change> change = replicas_.put(slot, place, version, packed, wire);
  if (!change.ok()) return change;
  if (had_one) moves_.mark_change(replicas_, records_, slot, before);
  moves_.mark_change(replicas_, records_, slot, objection);
  return change;
}

/// No block depends on it.
Result<Replicas::Change> GlobalMap::put_frame_statement(Slot slot, BlockKey place,
                                                        const PartVersion& version,
                                                        std::span<const std::byte> packed,
                                                        std::span<const std::byte> wire) noexcept {
  const Replicas::Contribution& contribution = replicas_.contribution(slot);
  if (!is_frame_statement(contribution.id, place, packed)) return Status::kCorrupt;
  if (!contribution.present) return Status::kInvalidArgument;
  if (contribution.leaving || moves_.leaving(slot)) return Status::kBusy;
  return replicas_.put(slot, place, version, packed, wire);
}

void GlobalMap::remove(Slot slot) noexcept {
  const Replicas::Contribution& contribution = replicas_.contribution(slot);
  // What has nothing takes nothing with it.
  if (contribution.present && contribution.first_block == 0 && moves_.forget(slot)) {
    replicas_.close(slot);
  } else {
    moves_.remove(replicas_, slot);
  }
}

void GlobalMap::remove_before(std::uint32_t robot, std::uint32_t epoch) noexcept {
  for (std::size_t i = 0; i < replicas_.in_order().size();) {
    const Slot slot = replicas_.in_order()[i];
    const ContributionId& id = replicas_.contribution(slot).id;
    if (id.robot == robot && id.epoch < epoch) remove(slot);
    // One that had nothing is gone already.
    if (i < replicas_.in_order().size() && replicas_.in_order()[i] == slot) ++i;
  }
}

// --- Work ----------------------------------------------------------------------------------------

std::uint64_t GlobalMap::step(std::uint64_t budget) noexcept {
  if (busy()) maps_.map().begin_revision();
  std::uint64_t work = 0;
  while (work < budget && busy()) {
    if (job_.busy()) {
      work += work_on_job();
      continue;
    }
    work += work_on_moves(budget - work);
    // Marks are complete before anything is brought up to date by them.
    if (moves_.phase() == Phase::kMarking || work >= budget) continue;
    work += weigh_robots(budget - work);
    if (work >= budget) continue;
    work += update_first();
    const bool complete = records_.moving() == 0 && !job_.busy();
    if (moves_.phase() == Phase::kStaging && complete) {
      moves_.begin_merging();
      maps_.show_staged();
    }
  }
  return work;
}

std::uint64_t GlobalMap::work_on_moves(std::uint64_t budget) noexcept {
  moves_.begin(replicas_);
  if (moves_.phase() == Phase::kMarking) return moves_.mark(replicas_, records_, budget);
  // Half of it, if something else waits.
  if (moves_.phase() == Phase::kMerging)
    return merge((budget + 1) / (records_.waiting() != 0 ? 2 : 1));
  return 0;
}

/// However small the budget, the cursor goes on, or a block of each that leaves is dropped.
std::uint64_t GlobalMap::merge(std::uint64_t budget) noexcept {
  const TwoMaps::Merged merged = maps_.merge(fused_.content(), records_, budget);
  counted_.refused_outputs += merged.refused;
  any_refused_ = any_refused_ || merged.refused != 0;
  if (!merged.complete) return merged.work;
  const std::size_t before = replicas_.in_order().size();
  const std::uint64_t work =
      merged.work + moves_.finish(replicas_, merged.work < budget ? budget - merged.work : 1);
  const bool has_hidden = moves_.has_hidden() && moves_.phase() == Phase::kSettled;
  if ((has_hidden || replicas_.in_order().size() < before) && any_refused_) try_refused_again();
  return work;
}

/// What has left, or has no place any more, may have made room.
void GlobalMap::try_refused_again() noexcept {
  any_refused_ = false;
  records_.mark_refused();
}

}  // namespace tessera
