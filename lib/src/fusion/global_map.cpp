// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/global_map.hpp"

#include "tessera/base/internal/put_in_place.hpp"

namespace tessera {

namespace {

bool in_range(const DiffusionConfig& config) noexcept {
  const int least = config.mode == DiffusionMode::kPaper ? 1 : 0;
  return config.mode <= DiffusionMode::kNone && config.edge <= EdgeTerm::kConfidence &&
         config.iterations >= least && config.iterations <= DiffusionConfig::kMostHalo &&
         config.length_m > 0.0F && config.length_m <= 1e6F && config.alpha > 0.0F &&
         config.alpha < 1.0F && config.omega >= 1e-6F && config.omega <= 1000.0F &&
         config.prior >= 0.0F && config.prior <= 1e6F;
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
  // `none` and `paper` are the paper's, to the letter.
  if (config_.diffusion.mode != DiffusionMode::kContractive)
    config_.map.probabilities = Probabilities::kShares;
  const Status status = put_in_place(maps_, [&] { return TwoMaps::make(arena, config_, classes); });
  return status == Status::kOk ? set_up_replicas(arena, maps_.map().num_components()) : status;
}

Status GlobalMap::set_up_replicas(Arena& arena, int components) noexcept {
  Status status = put_in_place(
      replicas_, [&] { return Replicas::make(arena, config_.replicas, config_.map.hash_seed); });
  if (status == Status::kOk)
    status = put_in_place(moves_,
                          [&] { return FrameMoves::make(arena, config_.replicas.contributions); });
  if (status == Status::kOk)
    status = put_in_place(records_, [&] {
      return GlobalRecords::make(arena, config_.blocks, config_.map.hash_seed);
    });
  return status == Status::kOk ? set_up_fusion(arena, components) : status;
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
  return status;
}

// --- What arrives --------------------------------------------------------------------------------

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
  if (Objection::is(replicas_.contribution(slot).id.submap))
    return put_objection(slot, key, version, packed, wire);
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
  const auto mark = [this](const Objection& one) {
    const Result<Slot> against = replicas_.find(one.against);
    if (against.ok()) static_cast<void>(moves_.mark_change(replicas_, records_, *against, one.key));
  };
  if (had_one) mark(before);
  mark(objection);
  return change;
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
  moves_.begin();
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
  if (replicas_.in_order().size() < before && any_refused_) try_refused_again();
  return work;
}

/// What has left may have made room.
void GlobalMap::try_refused_again() noexcept {
  any_refused_ = false;
  records_.mark_refused();
}

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
  const BlockSums::Added added = adder_.add_up(replicas_, block, content);
  record.robots = added.robots;
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
  if (empty) records_.close(number);
  return added.work + 1 + kBlockOctets;
}

/// Of a block that is diffused. False iff there is no room: counted, and it is undiffused then.
bool GlobalMap::keep_sums(std::uint32_t number, BlockCoord block) noexcept {
  GlobalRecord& record = records_.at(number);
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
