// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/robot.hpp"

#include <algorithm>
#include <utility>

#include "tessera/base/arena.hpp"

namespace tessera {

namespace {

template <class Part>
Status put_in_place(Result<Part> made, Part& into) {
  if (made.ok()) into = std::move(*made);
  return made.status();
}

}  // namespace

std::size_t RobotConfig::required_bytes(int num_components) const noexcept {
  return tessera::required_bytes(map) + Integrator::required_bytes(scan, inference) +
         Publisher::required_bytes(publisher, num_components) +
         Exchange::required_bytes(exchange, num_components) +
         GlobalMap::required_bytes(global, num_components);
}

Outcome<std::unique_ptr<Robot>> Robot::make(const RobotConfig& config, const ClassTable& classes,
                                            const RobotKeys& keys, const Clock& clock) {
  std::unique_ptr<Robot> robot(new Robot(config, clock));
  Outcome<ArenaMemory> memory =
      ArenaMemory::allocate(config.required_bytes(classes.num_components()));
  if (!memory.ok()) return memory.failure();
  robot->memory_ = std::move(*memory);
  Arena arena(robot->memory_.span());
  const Status status = robot->set_up(arena, classes, keys);
  if (status != Status::kOk)
    return Failure{std::string("the robot cannot be set up: ") + to_string(status)};
  return robot;
}

Status Robot::set_up(Arena& arena, const ClassTable& classes, const RobotKeys& keys) {
  const int components = classes.num_components();
  Status status = put_in_place(LocalMap::make(arena, config_.map, classes), map_);
  if (status == Status::kOk) {
    status = put_in_place(Integrator::make(arena, config_.inference, config_.scan), integrator_);
  }
  if (status == Status::kOk) {
    status = put_in_place(Publisher::make(arena, config_.publisher, config_.map, components),
                          publisher_);
  }
  if (status == Status::kOk)
    status = put_in_place(GlobalMap::make(arena, config_.global, classes), global_);
  if (status == Status::kOk) {
    status = put_in_place(Exchange::make(arena, config_.exchange, store_of(global_),
                                         keys.authenticator, classes, keys.signatures),
                          exchange_);
  }
  if (status == Status::kOk) status = exchange_.open(config_.epoch, 0, config_.T_global_map);
  return status;
}

ScanReport Robot::integrate(const ScanView& scan, std::int64_t now_us) noexcept {
  ticks_since_scan_ = 0;
  const Eigen::Vector3d p_map = scan.T_map_sensor.col(3);
  if (const auto voxel = map_.lattice().voxel_of(p_map.cast<float>()); voxel.ok())
    publisher_.set_focus(block_of(*voxel));
  if (config_.near_first) {
    const Eigen::Vector3d p_global =
        config_.T_global_map.leftCols<3>() * p_map + config_.T_global_map.col(3);
    const auto voxel = global_.map().lattice().voxel_of(p_global.cast<float>());
    if (voxel.ok()) global_.set_focus(block_of(*voxel));
  }
  if (config_.deadline_us == 0) return integrator_.integrate(map_, scan);
  return integrator_.integrate(map_, scan, deadline_, now_us + config_.deadline_us);
}

PublisherReport Robot::tick(std::int64_t now_us) noexcept {
  ++ticks_since_scan_;
  work_left_ = config_.work_per_tick;
  // The publisher's time begins with it: what was before the first tick is not stale for long.
  if (first_tick_us_ == kNone) first_tick_us_ = now_us;
  const PublisherReport report =
      publisher_.tick(map_, now_us - first_tick_us_, config_.budget, publication_of(exchange_));
  fuse();
  return report;
}

void Robot::fuse() noexcept {
  if (work_left_ == 0 || !global_.busy()) return;
  const std::uint64_t work = global_.step(work_left_);
  fusion_work_ += work;
  work_left_ -= std::min(work_left_, work);
}

bool Robot::fuse_in_spare_time() noexcept {
  if (!global_.busy()) return false;
  fusion_work_ += global_.step(kSpareWork);
  return true;
}

std::size_t Robot::used_bytes() const noexcept {
  const int components = map_.num_components();
  return map_.usage().used_bytes + global_.report().used_bytes +
         Integrator::required_bytes(config_.scan, config_.inference) +
         Publisher::required_bytes(config_.publisher, components) +
         Exchange::required_bytes(config_.exchange, components);
}

}  // namespace tessera
