// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/robot/sharer.hpp"

#include <algorithm>

#include "tessera/base/internal/put_in_place.hpp"

namespace tessera {

Status Sharer::set_up(Arena& arena, const RobotConfig& config, const ClassTable& classes,
                      const RobotKeys& keys) noexcept {
  const int components = classes.num_components();
  Status status = put_in_place(
      publisher_, [&] { return Publisher::make(arena, config.publisher, config.map, components); });
  if (status == Status::kOk) {
    status = put_in_place(global_, [&] { return GlobalMap::make(arena, config.global, classes); });
  }
  if (status == Status::kOk) {
    status = put_in_place(exchange_, [&] {
      return Exchange::make(arena, config.exchange, store_of(global_), keys.authenticator, classes,
                            keys.signatures);
    });
  }
  if (status != Status::kOk) return status;
  if (config.floor != 0) exchange_.set_floor(config.floor);
  return exchange_.open(config.epoch, 0, config.T_global_map);
}

Result<Sharer*> Sharer::make(Arena& arena, const RobotConfig& config, const ClassTable& classes,
                             const RobotKeys& keys) noexcept {
  if (!arena.aligned()) return Status::kResourceExhausted;
  const std::span<Sharer> place = arena.take<Sharer>(1);
  if (place.empty()) return Status::kResourceExhausted;
  Sharer& sharer = place.front();
  if (config.submap_ticks == 0 || !(config.submap_length_m >= 0.0)) return Status::kInvalidArgument;
  const Status status = sharer.set_up(arena, config, classes, keys);
  if (status != Status::kOk) return status;
  sharer.budget_ = config.budget;
  sharer.frame_ = config.T_global_map;
  sharer.resolution_m_ = config.map.resolution_m;
  sharer.work_per_tick_ = config.work_per_tick;
  sharer.near_first_ = config.near_first;
  sharer.submap_ticks_ = config.submap_ticks;
  sharer.cutter_ = SubmapCutter({.length_m = config.submap_length_m});
  sharer.submap_.epoch = config.epoch;
  const int components = classes.num_components();
  sharer.scratch_bytes_ = Publisher::required_bytes(config.publisher, components) +
                          Exchange::required_bytes(config.exchange, components);
  return &sharer;
}

void Sharer::set_focus(const Point3d& p_map) noexcept {
  ticks_since_scan_ = 0;
  const Lattice local(resolution_m_);
  if (const auto voxel = local.voxel_of(round_to_float(p_map)); voxel.ok()) {
    publisher_.set_focus(block_of(*voxel));
    note_way(p_map);
  }
  if (!near_first_) return;
  const Point3d p_global = frame_.leftCols<3>() * p_map + frame_.col(3);
  const auto voxel = global_.map().lattice().voxel_of(round_to_float(p_global));
  if (voxel.ok()) global_.set_focus(block_of(*voxel));
}

void Sharer::note_way(const Point3d& p_map) noexcept {
  if (!cutter_.note(p_map, 0) || submap_.ending) return;
  // One that is refused is asked for again after the same way.
  cutter_.begin();
  submap_.last = request_submap(frame_);
  flush_.keeps_frame = submap_.last == Status::kOk;
}

PublisherReport Sharer::tick(const LocalMap& map, std::int64_t now_us) noexcept {
  ++ticks_since_scan_;
  work_left_ = work_per_tick_;
  PublisherReport report;
  if (!flush_.due) {
    report = publish(map, now_us);
    note_flush(map);
  }
  fuse();
  return report;
}

PublisherReport Sharer::publish(const LocalMap& map, std::int64_t now_us) noexcept {
  PublisherBudget budget = budget_;
  budget.at_once = submap_.ending;
  Publication publication = publication_of(exchange_);
  if (evictions_ == nullptr) return publisher_.tick(map, now_us, budget, publication);
  publication.whole_context = evictions_;
  publication.whole = [](void* evictions, BlockKey key) {
    return !static_cast<EvictionQueue*>(evictions)->is_away(key);
  };
  evictions_->begin_tick([this](BlockKey key) { return publisher_.note_returned(key); });
  const PublisherReport report =
      publisher_.tick(map, now_us, budget, publication, evictions_->leaving());
  evictions_->answer();
  return report;
}

void Sharer::note_flush(const LocalMap& map) noexcept {
  if (!submap_.ending) return;
  // A round takes several ticks where the index is long: what it has passed may have changed again.
  const bool noted =
      publisher_.rounds() >= flush_.rounds && publisher_.noted_stamp() == MapReader(map).stamp();
  --flush_.ticks_left;
  const bool withdraws = evictions_ != nullptr && evictions_->is_withdrawing();
  flush_.due = flush_.ticks_left == 0 || (noted && !withdraws && publisher_.waiting() == 0);
}

Status Sharer::request_submap(const Matrix34d& T_global_map) noexcept {
  if (submap_.ending) return Status::kBusy;
  if (!GridTransform::make(T_global_map, resolution_m_).ok()) return Status::kInvalidArgument;
  if (submap_.submap == UINT32_MAX) return Status::kResourceExhausted;
  submap_.ending = true;
  cutter_.begin();
  flush_ = {.T_global_map = T_global_map,
            // The round at hand may have passed what the last scan changed.
            .rounds = publisher_.rounds() + 2,
            .ticks_left = submap_ticks_};
  return Status::kOk;
}

Status Sharer::open_submap(const LocalMap& map) noexcept {
  if (!flush_.due) return Status::kInvalidArgument;
  flush_.due = submap_.ending = false;
  submap_.last = exchange_.open(submap_.epoch, submap_.submap + 1, flush_.T_global_map);
  if (submap_.last != Status::kOk) return submap_.last;
  ++submap_.submap;
  ++submap_.opened;
  const std::optional<std::uint64_t> unnoted = publisher_.unnoted(map);
  submap_.lost_blocks += publisher_.waiting() + unnoted.value_or(0);
  if (evictions_ != nullptr) {
    submap_.lost_blocks += evictions_->unpublished();
    evictions_->begin_submap();
  }
  submap_.cut_short += publisher_.rounds() < flush_.rounds || !unnoted ? 1U : 0U;
  frame_ = flush_.T_global_map;
  publisher_.clear();
  return Status::kOk;
}

Status Sharer::reopen(std::uint32_t epoch, std::uint32_t floor) noexcept {
  exchange_.set_floor(floor);
  const Status status = exchange_.open(epoch, 0, frame_);
  if (status != Status::kOk) return status;
  submap_.epoch = epoch;
  submap_.submap = 0;
  submap_.ending = false;
  ++submap_.reopened;
  flush_ = {};
  publisher_.clear();
  if (evictions_ != nullptr) evictions_->begin_epoch();
  return status;
}

Status Sharer::set_frame(std::uint32_t submap, const Matrix34d& T_global_map) noexcept {
  const Status status = exchange_.move(submap_.epoch, submap, T_global_map);
  if (status != Status::kOk || submap != submap_.submap) return status;
  frame_ = T_global_map;
  if (submap_.ending && flush_.keeps_frame) flush_.T_global_map = T_global_map;
  return status;
}

void Sharer::fuse() noexcept {
  if (work_left_ == 0 || !global_.busy()) return;
  const std::uint64_t work = global_.step(work_left_);
  fusion_work_ += work;
  work_left_ -= std::min(work_left_, work);
}

bool Sharer::fuse_in_spare_time() noexcept {
  if (!global_.busy()) return false;
  static_cast<void>(fuse(kSpareWork));
  return true;
}

std::uint64_t Sharer::fuse(std::uint64_t work) noexcept {
  if (work == 0 || !global_.busy()) return 0;
  const std::uint64_t done = global_.step(work);
  fusion_work_ += done;
  return done;
}

std::size_t Sharer::used_bytes() const noexcept {
  return scratch_bytes_ + static_cast<std::size_t>(global_.report().used_bytes);
}

}  // namespace tessera
