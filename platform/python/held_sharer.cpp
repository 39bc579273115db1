// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "held_sharer.hpp"

#include <array>

#include "link/session.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera::python {

std::shared_ptr<HeldSharer> HeldSharer::make(std::shared_ptr<HeldLocalMap> map,
                                             const SharingOptions& options,
                                             const Matrix34d& T_global_map, std::uint32_t epoch,
                                             const KeyFiles& keys) {
  const ClassTable& classes = map->classes();
  RobotConfig config =
      value_of(set_up_sharing(options, map->setup(), classes.num_components(), epoch));
  config.T_global_map = T_global_map;
  config.window = map->setup().window;
  config.archived_blocks = static_cast<std::uint32_t>(map->archive_blocks());
  FleetKeys fleet_keys = value_of(FleetKeys::read(keys, options.robot));
  config.exchange.session = value_of(make_session(epoch));
  config.global.map.hash_seed = value_of(make_hash_seed());
  config.exchange.mission = fleet_keys.mission().number();
  if (map->in_submaps()) {
    config.first_submap = map->write([](Mapper& mapper) { return mapper.maps().number(); });
    // What it can publish from now on.
    map->write([&](Mapper& mapper) { mapper.set_most_submaps(config.most_submaps); });
  }
  const std::shared_ptr<HeldSharer> held(new HeldSharer(std::move(map), config));
  held->keys_.emplace(std::move(fleet_keys));
  const std::size_t queue_bytes =
      config.window ? EvictionQueue::required_bytes(config.archived_blocks) : 0;
  held->memory_ = std::make_shared<ArenaMemory>(value_of(ArenaMemory::allocate(
      Sharer::required_bytes(config, classes.num_components()) + queue_bytes)));
  Arena arena(held->memory_->span());
  const Result<Sharer*> sharer = Sharer::make(arena, config, classes, held->keys_->keys());
  if (!sharer.ok())
    throw InputError(std::string("the sharer cannot be set up: ") + to_string(sharer.status()));
  held->sharer_ = *sharer;
  if (config.window) held->share_window(arena);
  if (held->map_->in_submaps()) held->share_submaps();
  // Completes a move that is not copied yet.
  held->gate_->settle = [raw = held->sharer_] {
    while (!raw->global().settled()) static_cast<void>(raw->fuse_in_spare_time());
  };
  held->global_ = std::make_shared<HeldMap>(held->memory_, held->sharer_->global().map(),
                                            MapIdentity{.kind = MapKind::kGlobal}, held->gate_);
  return held;
}

void HeldSharer::share_window(Arena& arena) {
  const Result<EvictionQueue*> queue = EvictionQueue::make(arena, config_.archived_blocks);
  if (!queue.ok())
    throw InputError(std::string("the sharer cannot be set up: ") + to_string(queue.status()));
  map_->share_by(*queue);
  queue_ = *queue;
  sharer_->set_eviction_queue(queue_);
}

void HeldSharer::share_submaps() {
  constexpr LocalMaps::User kPublishing = LocalMaps::User::kPublishing;
  shares_submaps_ = map_->write([](Mapper& mapper) {
    if (mapper.maps().is_required(kPublishing)) return false;
    mapper.maps().require(kPublishing);
    return true;
  });
  if (!shares_submaps_)
    throw InputError("map is in submaps and has another sharer; one shares it at a time");
  // It may have been corrected before.
  const std::uint32_t submap = config_.first_submap;
  const Matrix34d T_world_map =
      map_->write([&](Mapper&) { return map_->submaps()->frames().frame(submap); });
  if (T_world_map == Matrix34d(Matrix34d::Identity())) return;
  if (sharer_->set_frame(submap, product(config_.T_global_map, T_world_map)) != Status::kOk)
    throw InputError("T_global_map puts the map outside of the grid");
}

HeldSharer::~HeldSharer() {
  map_->watch({}, 0);
  if (shares_submaps_)
    map_->write([](Mapper& mapper) { mapper.maps().dismiss(LocalMaps::User::kPublishing); });
  if (queue_ != nullptr) map_->share_by(nullptr);
}

void HeldSharer::note_frames() {
  const SubmapFrames& frames = sharer_->frames();
  if (frames.last() == last_submap_ && sharer_->submap().corrections == corrections_) return;
  const std::unique_lock alone(map_->gate().mutex);
  for (std::uint32_t submap = frames.first(); submap <= frames.last(); ++submap)
    static_cast<void>(map_->submaps()->frames().set(submap, frames.frame(submap)));
  last_submap_ = frames.last();
  corrections_ = sharer_->submap().corrections;
}

Status HeldSharer::new_submap(const std::optional<Matrix34d>& T_global_map) {
  if (!map_->in_submaps()) return Status::kUnsupported;
  return change([&](Sharer& sharer) {
    Mapper& mapper = map_->mapper();
    if (mapper.ends_submap()) return Status::kBusy;
    if (T_global_map) {
      const Status status = sharer.set_next_frame(mapper.maps(), *T_global_map);
      if (status != Status::kOk) return status;
    }
    mapper.end_submap(std::nullopt);
    return Status::kOk;
  });
}

CorrectionReport HeldSharer::correct(const CorrectedTrajectory& trajectory,
                                     std::uint32_t revision) {
  if (!map_->in_submaps()) return {.status = Status::kUnsupported};
  return change([&](Sharer& sharer) {
    const CorrectionReport report = sharer.correct(trajectory, revision);
    note_frames();
    return report;
  });
}

std::vector<std::string> HeldSharer::tick(std::int64_t now_us) {
  std::vector<std::string> datagrams;
  const py::gil_scoped_release released;
  const std::unique_lock alone(gate_->mutex);
  if (const LastScan last = map_->last_scan(); last.number != scans_seen_) {
    scans_seen_ = last.number;
    sharer_->note_watched(last.watched, static_cast<std::int64_t>(last.number));
    sharer_->note_scan(map_->mapper().maps(), last.submap, last.stamp_us, last.T_map_sensor);
    sharer_->note_place(last.submap, last.stamp_us, last.T_map_body, now_us);
  }
  // The map may be written to meanwhile: this reads it as a MapReader.
  static_cast<void>(sharer_->tick(map_->mapper().maps(), now_us));
  if (map_->in_submaps()) note_frames();
  watched_.resize(Objections::kMostPoints);
  const LastScan last = map_->last_scan();
  map_->watch(std::span(watched_).first(sharer_->place_watched(
                  last.submap, static_cast<std::int64_t>(last.number), watched_)),
              last.submap);
  std::array<std::byte, kMostDatagramBytes> datagram;
  while (const std::size_t size = sharer_->send(now_us, datagram))
    datagrams.emplace_back(reinterpret_cast<const char*>(datagram.data()), size);
  return datagrams;
}

}  // namespace tessera::python
