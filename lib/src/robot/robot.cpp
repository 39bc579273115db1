// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/robot/robot.hpp"

#include "tessera/base/assert.hpp"

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
  robot.config_ = config;
  robot.mapper_ = *mapper;
  robot.sharer_ = *sharer;
  return &robot;
}

PublisherReport Robot::tick(std::int64_t now_us) noexcept {
  const PublisherReport report = sharer_->tick(mapper_->map(), now_us);
  if (!sharer_->submap_due() || sharer_->open_submap(map()) != Status::kOk) return report;
  const bool cleared = mapper_->clear();  // there is room for a note: the tick took all
  TESSERA_ASSERT(cleared);
  static_cast<void>(cleared);
  return report;
}

}  // namespace tessera
