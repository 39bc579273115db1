// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/robot/mapper.hpp"

#include "tessera/base/internal/put_in_place.hpp"

namespace tessera {

/// The archive as the window sees it. Named, so that the gate of the stack knows who calls them.
struct MapperArchive {
  static bool evict(void* mapper, const LocalMap& /*map*/, const Block& block) {
    return static_cast<Mapper*>(mapper)->evict(block);
  }
  static const RegionMask* archived(void* mapper, BlockCoord region) {
    const BlockArchive& archive = static_cast<Mapper*>(mapper)->archive_;
    return archive.archived(archive.context, region);
  }
  static Status reload(void* mapper, LocalMap& /*map*/, BlockKey key) {
    return static_cast<Mapper*>(mapper)->reload(key);
  }
};

Result<Mapper*> Mapper::make(Arena& arena, const RobotConfig& config, const ClassTable& classes,
                             const Clock& clock) noexcept {
  if (!arena.aligned()) return Status::kResourceExhausted;
  const std::span<Mapper> place = arena.take<Mapper>(1);
  if (place.empty()) return Status::kResourceExhausted;
  Mapper& mapper = place.front();
  Status status =
      put_in_place(mapper.map_, [&] { return LocalMap::make(arena, config.map, classes); });
  if (status == Status::kOk) {
    status = put_in_place(mapper.integrator_,
                          [&] { return Integrator::make(arena, config.inference, config.scan); });
  }
  if (status == Status::kOk && config.window) {
    status = put_in_place(mapper.window_, [&] {
      return MovingWindow::make(*config.window, config.map.resolution_m);
    });
    mapper.reserve_ = config.window->reserve;
    mapper.has_window_ = true;
  }
  if (status != Status::kOk) return status;
  mapper.deadline_ = Deadline(clock);
  mapper.deadline_us_ = config.deadline_us;
  mapper.scratch_bytes_ = Integrator::required_bytes(config.scan, config.inference);
  return &mapper;
}

ScanReport Mapper::integrate(const ScanView& scan, std::int64_t now_us) noexcept {
  if (deadline_us_ != 0) return integrate_until(scan, now_us + deadline_us_);
  step_window(scan);
  return integrator_.integrate(map_, scan);
}

ScanReport Mapper::integrate_until(const ScanView& scan, std::int64_t due_us) noexcept {
  step_window(scan);
  return integrator_.integrate(map_, scan, deadline_, due_us);
}

bool Mapper::clear() noexcept {
  if (has_window_ && archive_.evict != nullptr) {
    if (archive_.clear == nullptr || (evictions_ != nullptr && !evictions_->note_cleared()))
      return false;
    archive_.clear(archive_.context);
  }
  map_.clear();
  return true;
}

/// A scan whose pose is none is refused, and the window stays where it is.
void Mapper::step_window(const ScanView& scan) noexcept {
  if (!has_window_ || check_rigid(scan.T_map_sensor) != Status::kOk) return;
  if (evictions_ != nullptr) evictions_->begin_step();
  BlockArchive by_mapper{.context = this, .evict = MapperArchive::evict};
  if (archive_.archived != nullptr) {
    by_mapper.archived = MapperArchive::archived;
    by_mapper.reload = MapperArchive::reload;
  }
  window_report_.add(window_.step(map_, scan.T_map_sensor.col(3), by_mapper));
}

/// A block that others have is to be as they have it when it leaves, unless memory is short.
bool Mapper::evict(const Block& block) noexcept {
  const BlockKey key{block.key};
  if (archive_.evict == nullptr) {
    if (evictions_ != nullptr) return false;
    ++window_report_.lost_blocks;
    return true;
  }
  if (evictions_ == nullptr) return archive_.evict(archive_.context, map_, block);
  const bool is_new = !is_archived(key);
  if (!evictions_->has_room() || (is_new && !evictions_->may_archive())) return false;
  const EvictionQueue::Answer answer = evictions_->answer_to(key, block.stamp);
  const bool is_published = answer == EvictionQueue::Answer::kPublished;
  if (answer == EvictionQueue::Answer::kNone && map_.fits(reserve_)) {
    evictions_->ask(key, block.stamp);
    return false;
  }
  if (!archive_.evict(archive_.context, map_, block)) return false;
  window_report_.unpublished_blocks += is_published ? 0U : 1U;
  // A block without evidence is taken, and nothing of it is kept.
  if (archive_.archived == nullptr || is_archived(key))
    evictions_->note_archived(key, is_new, is_published);
  return true;
}

bool Mapper::is_archived(BlockKey key) const noexcept {
  if (archive_.archived == nullptr) return false;
  const BlockCoord block = unpack(key);
  const RegionMask* const mask = archive_.archived(archive_.context, region_of(block));
  if (mask == nullptr) return false;
  const auto bit = static_cast<unsigned>((block.y & 7) * 8 + (block.x & 7));
  return ((*mask)[static_cast<std::size_t>(block.z & 7)] >> bit & 1U) != 0;
}

Status Mapper::reload(BlockKey key) noexcept {
  if (evictions_ != nullptr && !evictions_->has_room()) return Status::kResourceExhausted;
  const Status status = archive_.reload(archive_.context, map_, key);
  if (status == Status::kOk && evictions_ != nullptr) evictions_->note_reloaded(key);
  return status;
}

}  // namespace tessera
