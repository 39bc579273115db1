// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Maps that Python holds. Any thread may call anything: readers wait for writers, with the GIL
// released, so that other threads of Python run meanwhile.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <string>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "class_table.hpp"
#include "maps/stored_map.hpp"
#include "settings/map_options.hpp"
#include "tessera/inference/integrator.hpp"

namespace tessera::python {

/// The lock of a map for readers and writers. Release the GIL before locking it.
struct Gate {
  std::shared_mutex mutex;
  /// Called exclusively before anything is read; none: nothing to do.
  std::function<void()> settle;
};

class HeldMap {
 public:
  /// map: belongs to owner.
  HeldMap(std::shared_ptr<void> owner, const LocalMap& map, const MapIdentity& identity,
          std::shared_ptr<Gate> gate = std::make_shared<Gate>())
      : owner_(std::move(owner)), map_(&map), identity_(identity), gate_(std::move(gate)) {}
  explicit HeldMap(std::shared_ptr<StoredMap> stored)
      : HeldMap(stored, stored->map, stored->header.identity) {
    stored_ = std::move(stored);
  }
  HeldMap(const HeldMap&) = delete;
  HeldMap& operator=(const HeldMap&) = delete;
  HeldMap(HeldMap&&) = delete;
  HeldMap& operator=(HeldMap&&) = delete;
  virtual ~HeldMap() = default;

  /// Settings and classes, which never change.
  [[nodiscard]] const MapConfig& config() const { return map_->config(); }
  [[nodiscard]] const ClassTable& classes() const { return map_->classes(); }
  [[nodiscard]] const MapIdentity& identity() const { return identity_; }
  /// Including raw ids for labels; none for a file.
  [[nodiscard]] virtual Classes class_table() const { return {map_->classes(), nullptr}; }
  /// Null if the map is not its own, as for that of a sharer.
  [[nodiscard]] const std::shared_ptr<StoredMap>& stored() const { return stored_; }
  [[nodiscard]] Gate& gate() const { return *gate_; }

  /// Calls read(map) while no thread writes, without the GIL.
  template <class Read>
  auto read(Read&& read) const {
    const py::gil_scoped_release released;
    if (gate_->settle) {
      const std::unique_lock alone(gate_->mutex);
      gate_->settle();
      return read(*map_);
    }
    const std::shared_lock together(gate_->mutex);
    return read(*map_);
  }

 private:
  std::shared_ptr<void> owner_;
  const LocalMap* map_;
  MapIdentity identity_;
  std::shared_ptr<Gate> gate_;
  std::shared_ptr<StoredMap> stored_;
};

/// Result of one call of integrate.
struct IntegrationReport {
  ScanReport scan;
  UnknownRawIds unknown;
};

/// Place of the last scan, for sharers of the map.
struct LastScan {
  std::uint64_t number = 0;  ///< Scans so far.
  Point3d p_map = Point3d::Zero();
};

class HeldLocalMap final : public HeldMap {
 public:
  /// An empty map. Raises InputError iff an option is out of its range or the budget is too small
  /// for a map, Error iff the system does not give the memory.
  static std::shared_ptr<HeldLocalMap> make(const MapOptions& options, const Classes& classes,
                                            const std::optional<Matrix34d>& T_global_map,
                                            std::size_t max_points);
  /// The map of a file, to continue. Options that are fixed for the life of a map are the file's.
  /// Raises as make and load_map, and InputError iff it is a global map, classes differ from the
  /// file's, or the budget is too small for it.
  static std::shared_ptr<HeldLocalMap> load(const std::string& path, MapOptions options,
                                            const std::optional<Classes>& classes,
                                            std::size_t max_points);

  /// weights: null, or one per point. The arrays must not be written to meanwhile.
  IntegrationReport integrate(ScanView scan, const LabelsView& labels);
  void clear();
  /// Calls write(map) while no other thread reads or writes, without the GIL.
  template <class Write>
  auto write(Write&& write) {
    const py::gil_scoped_release released;
    const std::unique_lock alone(gate().mutex);
    return write(stored()->map);
  }

  [[nodiscard]] Classes class_table() const override { return classes_; }
  [[nodiscard]] const MapSetup& setup() const { return setup_; }
  [[nodiscard]] std::size_t scratch_bytes() const { return scratch_bytes_; }
  /// Most points of a scan; of a larger one a part is left out.
  [[nodiscard]] std::size_t max_points() const { return max_points_; }
  [[nodiscard]] LastScan last_scan() const;

 private:
  struct Parts {
    std::shared_ptr<StoredMap> stored;
    Integrator integrator;
    MapSetup setup;
    Classes classes;
    std::size_t scratch_bytes = 0;
    std::size_t max_points = 0;
  };
  explicit HeldLocalMap(Parts parts);
  static Parts make_parts(const MapOptions& options, MapSetup setup, const Classes& classes,
                          const MapIdentity& identity, std::size_t max_points);

  Integrator integrator_;
  MapSetup setup_;
  Classes classes_;
  std::size_t scratch_bytes_;
  std::size_t max_points_;
  Deadline deadline_;
  std::vector<std::uint8_t> components_;  ///< Scratch of integrate.
  mutable std::mutex last_mutex_;
  LastScan last_;
};

/// Updates the header's content and storage from the map. Called exclusively.
void measure_content(StoredMap& stored);

void add_map(py::module_& module);
void add_local_map(py::module_& module);

}  // namespace tessera::python
