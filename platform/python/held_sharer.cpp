// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "held_sharer.hpp"

#include <array>

#include "link/session.hpp"

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

HeldSharer::~HeldSharer() {
  if (queue_ != nullptr) map_->share_by(nullptr);
}

void HeldSharer::open_submap() {
  if (!sharer_->submap_due()) return;
  const std::unique_lock alone(map_->gate().mutex);
  Mapper& mapper = map_->mapper();
  // If it cannot be opened, nothing changes, and the report says so.
  if (sharer_->open_submap(mapper.map()) != Status::kOk) return;
  if (queue_ != nullptr) queue_->take_notes();  // there is room for another one then
  static_cast<void>(mapper.clear());
}

std::vector<std::string> HeldSharer::tick(std::int64_t now_us) {
  std::vector<std::string> datagrams;
  const py::gil_scoped_release released;
  const std::unique_lock alone(gate_->mutex);
  if (const LastScan last = map_->last_scan(); last.number != scans_seen_) {
    scans_seen_ = last.number;
    sharer_->set_focus(last.p_map);
  }
  // The map may be written to meanwhile: this reads it as a MapReader.
  static_cast<void>(sharer_->tick(map_->stored()->map, now_us));
  open_submap();
  std::array<std::byte, kMostDatagramBytes> datagram;
  while (const std::size_t size = sharer_->send(now_us, datagram))
    datagrams.emplace_back(reinterpret_cast<const char*>(datagram.data()), size);
  return datagrams;
}

}  // namespace tessera::python
