// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/robot/sharer.hpp"

#include <algorithm>

#include "tessera/base/internal/put_in_place.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {

Status Sharer::set_up(Arena& arena, const RobotConfig& config, const ClassTable& classes,
                      const RobotKeys& keys) noexcept {
  const int components = classes.num_components();
  Status status = put_in_place(
      publisher_, [&] { return Publisher::make(arena, config.publisher, config.map, components); });
  if (status == Status::kOk) status = global_.set_up(arena, global_of(config), classes);
  if (status == Status::kOk)
    status = exchange_.set_up(arena, config.exchange, store_of(global_), keys.authenticator,
                              classes, keys.signatures);
  if (status != Status::kOk) return status;
  // Where frames are found, an earlier start's map has another one, unless this start continues it.
  const bool is_new = config.frames.mode != FrameMode::kGiven && config.submaps_before == 0;
  const std::uint32_t floor = config.floor == 0 && is_new ? config.epoch : config.floor;
  if (floor != 0) exchange_.set_floor(floor);
  const std::optional<BodyBox> body = config.inference.body.hull();
  tells_place_ = body && exchange_.set_body(body) == Status::kOk;
  Result<SubmapFrames> frames = SubmapFrames::make(arena, most_frames(config), config.first_submap);
  if (!frames.ok()) return frames.status();
  frames_ = *frames;
  if (config.submaps_before != 0) {
    const Result<BlockContent> block = BlockContent::make(arena, components);
    if (!block.ok()) return block.status();
    earlier_ = *block;
  }
  status = exchange_.open(config.epoch, config.first_submap, config.T_global_map);
  if (status != Status::kOk) return status;
  const Result<MapSessions> sessions = MapSessions::make(
      arena, exchange_, global_, components, config.keep_sessions, knows_own_frame(config.frames));
  if (!sessions.ok()) return sessions.status();
  sessions_ = *sessions;
  if (!config.keep_sessions) sessions_.end_earlier();
  const Result<SharedFrames*> shared = SharedFrames::make(
      arena, config.frames, config.T_global_map.col(3), exchange_, global_, classes);
  if (!shared.ok()) return shared.status();
  shared_ = *shared;
  return put_in_place(
      objections_, [&] { return Objections::make(arena, config.objections, exchange_, global_); });
}

Result<Sharer*> Sharer::make(Arena& arena, const RobotConfig& config, const ClassTable& classes,
                             const RobotKeys& keys) noexcept {
  if (!arena.aligned()) return Status::kResourceExhausted;
  const std::span<Sharer> place = arena.take<Sharer>(1);
  if (place.empty()) return Status::kResourceExhausted;
  Sharer& sharer = place.front();
  if (config.submap_ticks == 0 || !(config.reach_m >= 0.0) ||
      !(config.teammate_margin_m >= 0.0 && config.teammate_margin_m <= 2.0) ||
      config.objections > Objection::kPlaces ||
      (config.reach_m > 0.0 &&
       (config.exchange.far_contributions == 0 || config.frames.mode != FrameMode::kGiven)))
    return Status::kInvalidArgument;
  const Status status = sharer.set_up(arena, config, classes, keys);
  if (status != Status::kOk) return status;
  sharer.budget_ = config.budget;
  sharer.frame_ = sharer.T_global_world_ = config.T_global_map;
  sharer.resolution_m_ = config.map.resolution_m;
  sharer.work_per_tick_ = config.work_per_tick;
  sharer.near_first_ = config.near_first;
  sharer.reach_m_ = config.reach_m;
  sharer.teammate_margin_m_ = config.teammate_margin_m;
  sharer.submap_ticks_ = config.submap_ticks;
  sharer.submaps_before_ = config.submaps_before;
  sharer.submap_.epoch = config.epoch;
  sharer.submap_.submap = sharer.first_in_epoch_ = config.first_submap;
  sharer.first_of_start_ = config.first_submap;
  const int components = classes.num_components();
  sharer.scratch_bytes_ = Publisher::required_bytes(config.publisher, components) +
                          Exchange::required_bytes(config.exchange, components) +
                          SubmapFrames::required_bytes(most_frames(config)) +
                          Objections::required_bytes(config.objections, components);
  return &sharer;
}

void Sharer::note_scan(const LocalMaps& maps, std::uint32_t submap, std::int64_t stamp_us,
                       const Matrix34d& T_map_sensor) noexcept {
  ticks_since_scan_ = 0;
  follow(maps);
  const Point3d p_map = T_map_sensor.col(3);
  const auto voxel = Lattice(resolution_m_).voxel_of(round_to_float(p_map));
  if (!voxel.ok()) return;
  publisher_.set_focus(block_of(*voxel));
  frames_.note(submap, stamp_us, T_map_sensor);
  p_world_ = apply(frames_.has(submap) ? frame_of(submap) : frame_, p_map);
  const Point3d p_global = shared_ != nullptr ? apply(shared_->own_frame(), p_world_) : p_world_;
  places_.front() = p_global;
  has_place_ = true;
  set_reach();
  if (!near_first_) return;
  const auto global = global_.map().lattice().voxel_of(round_to_float(p_global));
  if (global.ok()) global_.set_focus(block_of(*global));
}

void Sharer::set_route(std::span<const Point3d> p_global) noexcept {
  route_ = std::min(p_global.size(), kMostRoute);
  std::copy_n(p_global.begin(), route_, places_.begin() + 1);
  set_reach();
}

void Sharer::set_reach() noexcept {
  if (reach_m_ == 0.0) return;
  const std::size_t first = has_place_ ? 0 : 1;
  exchange_.set_reach(std::span(places_).subspan(first, route_ + 1 - first),
                      reach_m_ + global_.dependence_m());
}

/// A submap has its frame from when it begins, so that it can be moved before it is opened.
void Sharer::follow(const LocalMaps& maps) noexcept {
  if (frames_.follow(maps, T_world_map_next_)) T_world_map_next_.reset();
}

Matrix34d Sharer::frame_of(std::uint32_t submap) const noexcept {
  return product(T_global_world_, frames_.frame(submap));
}

PublisherReport Sharer::tick(LocalMaps& maps, std::int64_t now_us) noexcept {
  ++ticks_since_scan_;
  now_ = Instant::at_us(now_us);
  work_left_ = work_per_tick_;
  follow(maps);
  if (continues_ && ++ticks_ % kTicksOfEarlier == 0) move_earlier();
  if (!submap_.ending && maps.number() != submap_.submap) {
    submap_.ending = true;
    ticks_left_ = submap_ticks_;
  }
  sessions_.tick();
  const LocalMap& map = maps.of(submap_.submap);
  PublisherReport report;
  if (!submap_.ending || ticks_left_ != 0) report = publish(map, now_us);
  if (submap_.ending) {
    ticks_left_ -= ticks_left_ != 0 ? 1U : 0U;
    if (ticks_left_ == 0 || is_published(map)) open_next(maps);
  }
  object(maps);
  fuse();
  if (shared_ != nullptr)
    shared_->tick(p_world_, now_);
  else
    leave_out_other_worlds();
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

/// Nothing writes to it any more: a round that began after its last stamp has seen all.
bool Sharer::is_published(const LocalMap& map) noexcept {
  return publisher_.noted_stamp() == MapReader(map).stamp() && publisher_.waiting() == 0;
}

void Sharer::open_next(LocalMaps& maps) noexcept {
  const LocalMap& ended = maps.of(submap_.submap);
  ticks_left_ = 0;
  follow(maps);  // it may have begun within this tick
  Matrix34d T_global_map = frame_of(submap_.submap + 1);
  // A correction may have moved it out of the grid.
  if (!GridTransform::make(T_global_map, resolution_m_).ok()) {
    T_global_map = frame_;
    ++submap_.refused_frames;
  }
  // If there is no place for it, the next tick tries again; nothing is published meanwhile.
  submap_.last = exchange_.open(submap_.epoch, submap_.submap + 1, T_global_map);
  if (submap_.last != Status::kOk) return;
  const std::optional<std::uint64_t> unnoted = publisher_.unnoted(ended);
  submap_.lost_blocks += publisher_.waiting() + unnoted.value_or(0);
  submap_.cut_short += publisher_.noted_stamp() != MapReader(ended).stamp() || !unnoted ? 1U : 0U;
  publisher_.clear();
  ++submap_.submap;
  ++submap_.opened;
  submap_.ending = false;
  frame_ = T_global_map;
  maps.note_done(LocalMaps::User::kPublishing);
}

Status Sharer::reopen(std::uint32_t epoch, std::uint32_t floor) noexcept {
  exchange_.set_floor(floor);
  const Status status = exchange_.open(epoch, submap_.submap, frame_);
  if (status != Status::kOk) return status;
  submap_.epoch = epoch;
  if (submap_.ending) ticks_left_ = submap_ticks_;
  first_in_epoch_ = submap_.submap;
  ++submap_.reopened;
  publisher_.clear();
  sessions_.begin_epoch();
  objections_.begin_epoch();
  if (evictions_ != nullptr) evictions_->begin_epoch();
  return status;
}

Status Sharer::set_next_frame(const LocalMaps& maps, const Matrix34d& T_global_map) noexcept {
  follow(maps);
  const Matrix34d T_world_map = product(inverse(T_global_world_), T_global_map);
  if (!GridTransform::make(T_global_map, resolution_m_).ok() || !encode_rigid(T_world_map).ok())
    return Status::kInvalidArgument;
  T_world_map_next_ = T_world_map;
  return Status::kOk;
}

Status Sharer::set_frame(std::uint32_t submap, const Matrix34d& T_global_map) noexcept {
  if (!frames_.has(submap) || !GridTransform::make(T_global_map, resolution_m_).ok())
    return Status::kInvalidArgument;
  if (submap < first_in_epoch_) return Status::kInvalidArgument;
  // One that has begun and is not opened yet is announced with its frame then.
  if (submap <= submap_.submap) {
    const Status status = exchange_.move(submap_.epoch, submap, T_global_map);
    if (status != Status::kOk) return status;
  }
  if (submap == submap_.submap) frame_ = T_global_map;
  return frames_.set(submap, product(inverse(T_global_world_), T_global_map));
}

CorrectionReport Sharer::correct(const CorrectedTrajectory& trajectory,
                                 std::uint32_t revision) noexcept {
  const CorrectionReport report = frames_.correct(trajectory, revision);
  take(report);
  return report;
}

CorrectionReport Sharer::correct(const CorrectedFrames& frames, std::uint32_t revision) noexcept {
  const CorrectionReport report = frames_.correct(frames, revision);
  take(report);
  return report;
}

void Sharer::take(const CorrectionReport& report) noexcept {
  if (report.status != Status::kOk) {
    ++submap_.refused_corrections;
    return;
  }
  ++submap_.corrections;
  submap_.revision = report.revision;
  submap_.corrected_most_m = report.most_m;
  for (std::uint32_t submap = frames_.first(); submap <= submap_.submap; ++submap) {
    if (!frames_.moved(submap)) continue;
    if (submap < first_of_start_) {  // published again, or else below
      static_cast<void>(exchange_.move(submap_.epoch, submap, frame_of(submap)));
      continue;
    }
    if (submap < first_in_epoch_) {  // of an epoch that was left: no longer this process's
      ++submap_.refused_frames;
      continue;
    }
    const Matrix34d T_global_map = frame_of(submap);
    if (exchange_.move(submap_.epoch, submap, T_global_map) != Status::kOk) {
      ++submap_.refused_frames;
    } else if (submap == submap_.submap) {
      frame_ = T_global_map;
    }
  }
  if (continues_) move_earlier();
}

void Sharer::fuse() noexcept {
  if (work_left_ == 0 || !global_.busy()) return;
  const std::uint64_t work = global_.step(work_left_);
  fusion_work_ += work;
  work_left_ -= std::min(work_left_, work);
}

bool Sharer::fuse_in_spare_time() noexcept {
  if (!global_.busy()) return shared_ != nullptr && shared_->step(now_);
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
