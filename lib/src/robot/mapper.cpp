// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/robot/mapper.hpp"

#include <algorithm>

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

namespace {

constexpr std::uint32_t kMostStretch = 1024;

/// Of a robot's submaps, those that none but a jump or a request may begin.
constexpr std::uint32_t kept_for_jumps(std::uint32_t most) noexcept { return most / 8; }

bool is_valid(const RobotSettings& config) noexcept {
  const SubmapCuts& cuts = config.submap_cuts;
  const bool cuts_are = cuts.length_m >= 0.0 && cuts.jump_m >= 0.0 && cuts.time_us >= 0;
  if (config.most_submaps == 0) return cuts_are && cuts == SubmapCuts{};
  return cuts_are && config.most_submaps >= 2 && !config.window &&
         config.submaps_before <= config.first_submap &&
         config.first_submap <= UINT32_MAX - config.most_submaps;
}

}  // namespace

Result<Mapper*> Mapper::make(Arena& arena, const RobotConfig& config, const ClassTable& classes,
                             const Clock& clock) noexcept {
  if (!arena.aligned()) return Status::kResourceExhausted;
  const std::span<Mapper> place = arena.take<Mapper>(1);
  if (place.empty()) return Status::kResourceExhausted;
  if (!is_valid(config)) return Status::kInvalidArgument;
  Mapper& mapper = place.front();
  MapConfig map = config.map;
  map.label_votes = needs_votes(config.inference.mode, config.map.resolution_m);
  Status status =
      mapper.maps_.set_up(arena, map, classes, config.most_submaps != 0, config.first_submap);
  if (status == Status::kOk) {
    status = put_in_place(mapper.integrator_,
                          [&] { return Integrator::make(arena, config.inference, config.scan); });
  }
  if (status == Status::kOk && config.window) {
    status = put_in_place(mapper.window_, [&] {
      return MovingWindow::make(*config.window, config.map.resolution_m);
    });
    mapper.has_window_ = true;
  }
  if (status != Status::kOk) return status;
  mapper.cutter_ = SubmapCutter(config.submap_cuts);
  mapper.first_submap_ = config.first_submap - config.submaps_before;
  mapper.most_submaps_ = config.most_submaps;
  mapper.deadline_ = Deadline(clock);
  mapper.deadline_us_ = config.deadline_us;
  mapper.scratch_bytes_ = Integrator::required_bytes(config.scan, config.inference);
  return &mapper;
}

ScanReport Mapper::integrate(const ScanView& scan, std::int64_t now_us) noexcept {
  if (deadline_us_ != 0) return integrate_until(scan, now_us + deadline_us_);
  return integrate_at(scan, now_us, [&] { return integrator_.integrate(map(), scan); });
}

ScanReport Mapper::integrate_until(const ScanView& scan, std::int64_t due_us) noexcept {
  return integrate_at(scan, due_us,
                      [&] { return integrator_.integrate(map(), scan, deadline_, due_us); });
}

template <class Integrate>
ScanReport Mapper::integrate_at(const ScanView& scan, std::int64_t now_us,
                                Integrate&& integrate) noexcept {
  if (!take_place(scan, now_us)) return {.pose = Status::kBusy};
  const ScanReport report = integrate();
  if (report.pose == Status::kOk) {
    ++scans_;
    way_m_ = cutter_.way_m();
  }
  return report;
}

/// Moves the window, or begins the submap that is due. False: there is no map for the scan. A scan
/// whose pose is none is refused, and all stays as it is.
bool Mapper::take_place(const ScanView& scan, std::int64_t now_us) noexcept {
  if (check_rigid(scan.T_map_sensor) != Status::kOk) return true;
  if (has_window_) step_window(scan.T_map_sensor.col(3));
  if (most_submaps_ == 0) return true;
  const std::optional<SubmapEnd> cut = cutter_.note(scan.T_map_sensor.col(3), now_us, allowance());
  // A jump is remembered until its submap has begun.
  if (cut == SubmapEnd::kJump) asked_.fetch_or(kJumped, std::memory_order_relaxed);
  const std::uint32_t asked = asked_.load(std::memory_order_relaxed);
  if (asked == 0 && !cut) return true;
  const bool jumps = (asked & kJumped) != 0;
  if (!may_begin(asked != 0)) {
    submaps_.late += jumps ? 0U : 1U;
    submaps_.left_out += jumps ? 1U : 0U;
    return !jumps;
  }
  asked_.fetch_and(~asked, std::memory_order_relaxed);
  begin_submap(jumps ? SubmapEnd::kJump : cut, jumps);
  return true;
}

bool Mapper::make_room(const ScanView& scan) noexcept {
  if (!has_window_ || check_rigid(scan.T_map_sensor) != Status::kOk) return true;
  step_window(scan.T_map_sensor.col(3));
  return window_.has_room(map()) || map().block_count() == 0;
}

/// Submaps that may still begin.
std::uint32_t Mapper::places_left() const noexcept {
  const std::uint64_t used = std::uint64_t{maps_.number()} - first_submap_ + 1;
  return static_cast<std::uint32_t>(most_submaps_ - std::min<std::uint64_t>(used, most_submaps_));
}

/// Each time that half of the places that are left is used up, submaps become twice as long: a
/// robot comes to the end of its places after some five times the way that they are for.
SubmapAllowance Mapper::allowance() const noexcept {
  const std::uint32_t kept_free = kept_for_jumps(most_submaps_);
  const std::uint32_t all = most_submaps_ - kept_free;
  const std::uint32_t left = places_left() - std::min(places_left(), kept_free);
  SubmapAllowance may;
  while (may.stretch < kMostStretch && std::uint64_t{left} * may.stretch * 2 < all)
    may.stretch *= 2;
  const MapUsage usage = map().usage();
  may.is_full = usage.used_bytes > usage.capacity_bytes / 4 * 3;
  return may;
}

bool Mapper::may_begin(bool asked) const noexcept {
  return places_left() > (asked ? 0 : kept_for_jumps(most_submaps_)) && maps_.may_begin();
}

void Mapper::begin_submap(std::optional<SubmapEnd> why, bool jumps) noexcept {
  maps_.begin(!jumps, submap_note());
  cutter_.begin();
  first_scan_ = scans_;
  std::uint32_t& count = !why                        ? submaps_.by_request
                         : why == SubmapEnd::kJump   ? submaps_.by_jump
                         : why == SubmapEnd::kTime   ? submaps_.by_time
                         : why == SubmapEnd::kMemory ? submaps_.by_memory
                                                     : submaps_.by_length;
  ++count;
}

void Mapper::resume(const SubmapNote& note) noexcept {
  first_scan_ = note.first_scan;
  scans_ = note.last_scan + 1;
  cutter_.resume(note.length_m);
  way_m_ = cutter_.way_m();
}

bool Mapper::resume_next(const SubmapNote& ended, bool continues) noexcept {
  if (!maps_.may_begin()) return false;
  maps_.begin(continues, ended);
  return true;
}

bool Mapper::clear() noexcept {
  if (has_window_ && archive_.evict != nullptr) {
    if (archive_.clear == nullptr || (evictions_ != nullptr && !evictions_->note_cleared()))
      return false;
    archive_.clear(archive_.context);
  }
  map().clear();
  cutter_.begin();
  return true;
}

void Mapper::step_window(const Point3d& p_map) noexcept {
  if (evictions_ != nullptr) evictions_->begin_step();
  BlockArchive by_mapper{.context = this, .evict = MapperArchive::evict};
  if (archive_.archived != nullptr) {
    by_mapper.archived = MapperArchive::archived;
    by_mapper.reload = MapperArchive::reload;
  }
  window_report_.add(window_.step(map(), p_map, by_mapper));
}

/// A block that others have is to be as they have it when it leaves, unless memory is short.
bool Mapper::evict(const Block& block) noexcept {
  const BlockKey key{block.key};
  if (archive_.evict == nullptr) {
    if (evictions_ != nullptr) return false;
    ++window_report_.lost_blocks;
    return true;
  }
  if (evictions_ == nullptr) return archive_.evict(archive_.context, map(), block);
  const bool is_new = !is_archived(key);
  if (!evictions_->has_room() || (is_new && !evictions_->may_archive())) return false;
  const EvictionQueue::Answer answer = evictions_->answer_to(key, block.stamp);
  const bool is_published = answer == EvictionQueue::Answer::kPublished;
  if (answer == EvictionQueue::Answer::kNone && window_.has_room(map())) {
    evictions_->ask(key, block.stamp);
    return false;
  }
  if (!archive_.evict(archive_.context, map(), block)) return false;
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
  const Status status = archive_.reload(archive_.context, map(), key);
  if (status == Status::kOk && evictions_ != nullptr) evictions_->note_reloaded(key);
  return status;
}

}  // namespace tessera
