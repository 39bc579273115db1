// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Maps that Python holds. Any thread may call anything: what reads waits for who writes, with the
// GIL released, so that other threads of Python run meanwhile.
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
#include "mapping/map_options.hpp"
#include "mapping/stored_map.hpp"
#include "tessera/inference/integrator.hpp"

namespace tessera::python {

/// Who may read and who may write. Whoever takes it has released the GIL.
struct Gate {
  std::shared_mutex mutex;
  /// To be called, alone, before anything is read; none: nothing is to be done.
  std::function<void()> settle;
};

class HeldMap {
 public:
  /// map: lives in what owner holds.
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
  /// With what labels may be given as; of a file without raw ids.
  [[nodiscard]] virtual Classes class_table() const { return {map_->classes(), nullptr}; }
  /// Null where the map is not one of its own, as that of a sharer.
  [[nodiscard]] const std::shared_ptr<StoredMap>& stored() const { return stored_; }
  [[nodiscard]] Gate& gate() const { return *gate_; }

  /// read(map) while nobody writes, without the GIL.
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

/// What one call of integrate did.
struct IntegrationReport {
  ScanReport scan;
  UnknownRawIds unknown;
};

/// Where the last scan was taken, for those who share the map.
struct LastScan {
  std::uint64_t number = 0;  ///< Scans so far.
  Point3d p_map = Point3d::Zero();
};

class HeldLocalMap final : public HeldMap {
 public:
  /// An empty map. Raises InputError iff an option is out of its range or the budget holds no map,
  /// Error iff the system does not give the memory.
  static std::shared_ptr<HeldLocalMap> make(const MapOptions& options, const Classes& classes,
                                            const std::optional<Matrix34d>& T_global_map,
                                            std::size_t max_points);
  /// That of a file, to go on with. What of the options is fixed for a map's life is the file's.
  /// Raises as make and load_map, and InputError iff it is a global map, classes are others than
  /// the file's, or the budget is too small for it.
  static std::shared_ptr<HeldLocalMap> load(const std::string& path, MapOptions options,
                                            const std::optional<Classes>& classes,
                                            std::size_t max_points);

  /// weights: null, or one a point. The arrays must not be written to meanwhile.
  IntegrationReport integrate(ScanView scan, const LabelsView& labels);
  void clear();
  /// write(map) while nobody else reads or writes, without the GIL.
  template <class Write>
  auto write(Write&& write) {
    const py::gil_scoped_release released;
    const std::unique_lock alone(gate().mutex);
    return write(stored()->map);
  }

  [[nodiscard]] Classes class_table() const override { return classes_; }
  [[nodiscard]] const MapSetup& setup() const { return setup_; }
  [[nodiscard]] std::size_t scratch_bytes() const { return scratch_bytes_; }
  /// Of a scan; of more a part is left out.
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

/// Brings the header's content and storage up to what the map holds. Alone at the map.
void measure_content(StoredMap& stored);

void add_map(py::module_& module);
void add_local_map(py::module_& module);

}  // namespace tessera::python
