// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A sharer that Python holds: what a robot sends about its map and receives about others', as
// bytes.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "held_map.hpp"
#include "link/fleet_keys.hpp"
#include "settings/sharing_setup.hpp"
#include "tessera/robot/sharer.hpp"

namespace tessera::python {

class HeldSharer {
 public:
  /// epoch: of this start. Raises InputError iff an option is out of its range, T_global_map is not
  /// a frame, the budget is too small for a map or a file does not have the keys; Error iff the
  /// system does not give the memory.
  static std::shared_ptr<HeldSharer> make(std::shared_ptr<HeldLocalMap> map,
                                          const SharingOptions& options,
                                          const Matrix34d& T_global_map, std::uint32_t epoch,
                                          const KeyFiles& keys);

  ~HeldSharer();
  HeldSharer(const HeldSharer&) = delete;
  HeldSharer& operator=(const HeldSharer&) = delete;

  /// Publishes what has changed in the map and returns the datagrams to send now.
  std::vector<std::string> tick(std::int64_t now_us);
  /// Calls change(sharer) while no other thread uses it, without the GIL.
  template <class Change>
  auto change(Change&& change) const {
    const py::gil_scoped_release released;
    const std::unique_lock alone(gate_->mutex);
    return change(*sharer_);
  }
  /// The next scan is the first of another submap. Fails as Robot::new_submap; kUnsupported iff the
  /// map is not in submaps.
  Status new_submap(const std::optional<Matrix34d>& T_global_map);
  /// As Sharer::correct, for the map's files too.
  CorrectionReport correct(const CorrectedTrajectory& trajectory, std::uint32_t revision);
  /// The global map, for reading; keeps the sharer's memory alive.
  [[nodiscard]] const std::shared_ptr<HeldMap>& global() const { return global_; }
  [[nodiscard]] const RobotConfig& config() const { return config_; }

 private:
  HeldSharer(std::shared_ptr<HeldLocalMap> map, RobotConfig config)
      : map_(std::move(map)), config_(std::move(config)) {}
  void note_frames();
  void share_submaps();
  void share_window(Arena& arena);

  std::shared_ptr<HeldLocalMap> map_;
  RobotConfig config_;
  std::optional<FleetKeys> keys_;
  std::shared_ptr<ArenaMemory> memory_;
  Sharer* sharer_ = nullptr;
  EvictionQueue* queue_ = nullptr;  ///< In memory_, of a map with a window.
  std::shared_ptr<Gate> gate_ = std::make_shared<Gate>();
  std::shared_ptr<HeldMap> global_;
  std::uint64_t scans_seen_ = 0;
  std::vector<WatchedPoint> watched_;  ///< Scratch.
  std::uint32_t last_submap_ = 0;
  std::uint32_t corrections_ = 0;
  bool shares_submaps_ = false;
};

void add_sharer(py::module_& module);

}  // namespace tessera::python
