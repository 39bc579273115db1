// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/robot/robot.hpp"

#include "tessera/base/rigid.hpp"

namespace tessera {

Result<Robot*> Robot::make(Arena& arena, const RobotConfig& config, const ClassTable& classes,
                           const RobotKeys& keys, const Clock& clock) noexcept {
  if (!arena.aligned()) return Status::kResourceExhausted;
  const std::span<Robot> place = arena.take<Robot>(1);
  if (place.empty()) return Status::kResourceExhausted;
  Robot& robot = place.front();
  const Result<Mapper*> mapper = Mapper::make(arena, config, classes, clock);
  if (!mapper.ok()) return mapper.status();
  const Result<Sharer*> sharer = Sharer::make(arena, config, classes, keys);
  if (!sharer.ok()) return sharer.status();
  if (config.window) {
    const Result<EvictionQueue*> evictions = EvictionQueue::make(arena, config.archived_blocks);
    if (!evictions.ok()) return evictions.status();
    (*mapper)->set_eviction_queue(*evictions);
    (*sharer)->set_eviction_queue(*evictions);
  }
  (*mapper)->maps().require(LocalMaps::User::kPublishing);
  robot.boxes_ = arena.take<PlacedBox>(config.exchange.teammates);
  if (robot.boxes_.size() != config.exchange.teammates) return Status::kResourceExhausted;
  robot.watched_ = arena.take<WatchedPoint>(watched_points(config));
  if (robot.watched_.size() != watched_points(config)) return Status::kResourceExhausted;
  robot.config_ = config;
  robot.mapper_ = *mapper;
  robot.sharer_ = *sharer;
  return &robot;
}

/// What the others say of places, if the scan does not.
ScanView Robot::with_others(const ScanView& scan, std::int64_t now_us) noexcept {
  ScanView view = scan;
  const std::uint32_t submap = mapper_->maps().number();
  if (view.teammates.empty())
    view.teammates = boxes_.first(sharer_->place_teammates(submap, now_us, boxes_));
  if (view.watched.empty()) {
    view.watched = watched_.first(sharer_->place_watched(submap, now_us, watched_));
    watched_in_ = submap;
  }
  return view;
}

ScanReport Robot::noted(const ScanView& scan, std::int64_t stamp_us,
                        const ScanReport& report) noexcept {
  if (report.pose != Status::kOk) return report;
  const std::uint32_t submap = mapper_->maps().number();
  if (submap == watched_in_) sharer_->note_watched(scan.watched, stamp_us);
  sharer_->note_scan(mapper_->maps(), submap, stamp_us, scan.T_map_sensor);
  if (sharer_->tells_place())
    sharer_->note_place(submap, stamp_us, product(scan.T_map_sensor, inverse(scan.T_body_sensor)),
                        stamp_us);
  return report;
}

Status Robot::new_submap(const Matrix34d& T_global_map) noexcept {
  if (!mapper_->maps().in_submaps()) return Status::kInvalidArgument;
  if (mapper_->ends_submap()) return Status::kBusy;
  const Status status = sharer_->set_next_frame(mapper_->maps(), T_global_map);
  if (status == Status::kOk) mapper_->end_submap(std::nullopt);
  return status;
}

}  // namespace tessera
