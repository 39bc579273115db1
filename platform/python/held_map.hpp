// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Maps that Python holds. Any thread may call anything: readers wait for writers, with the GIL
// released, so that other threads of Python run meanwhile.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <shared_mutex>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "arrays.hpp"
#include "class_table.hpp"
#include "held_submaps.hpp"
#include "label_arrays.hpp"
#include "maps/held_mapper.hpp"
#include "maps/stored_map.hpp"
#include "maps/window_totals.hpp"
#include "scans/scan_losses.hpp"
#include "settings/map_options.hpp"

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
  /// Of all of the map. Raises Error iff a part of it cannot be read.
  [[nodiscard]] virtual std::uint64_t content_digest() const;
  /// Raises Error or InputError iff it cannot be written.
  virtual void save(const std::string& path) const;
  /// All of the map is in memory.
  [[nodiscard]] virtual bool is_whole() const { return true; }

  /// Calls read(map) while no thread writes, without the GIL.
  template <class Read>
  auto read(Read&& read) const {
    const py::gil_scoped_release released;
    if (gate_->settle) {
      const std::unique_lock alone(gate_->mutex);
      gate_->settle();
      return read(current());
    }
    const std::shared_lock together(gate_->mutex);
    return read(current());
  }

  /// The map that is read: of submaps another one after each that ends. For who has the gate.
  [[nodiscard]] virtual const LocalMap& current() const { return *map_; }

 private:
  std::shared_ptr<void> owner_;
  const LocalMap* map_;
  MapIdentity identity_;
  std::shared_ptr<Gate> gate_;
  std::shared_ptr<StoredMap> stored_;
};

/// The map of any map file, for reading. Raises InputError iff it cannot be read; Error iff the
/// system does not give the memory.
[[nodiscard]] std::shared_ptr<HeldMap> load_held(const std::filesystem::path& path);

/// Result of one call of integrate.
struct IntegrationReport {
  ScanReport scan;
  UnknownRawIds unknown;
  std::size_t too_high = 0;  ///< Labels as components that no component has.
  Outcome<void> kept{};      ///< Whether a submap that had ended could be written.
};

/// What a map warns of once, beside that nothing was mapped, for each reason.
enum class LabelWarning { kUnknownIds, kHighLabels };
using ScanWarning = std::variant<NothingMapped, LabelWarning>;

/// The last scan, for sharers of the map.
struct LastScan {
  std::uint64_t number = 0;  ///< Scans so far.
  std::uint32_t submap = 0;  ///< That it was mapped into.
  std::int64_t stamp_us = 0;
  Matrix34d T_map_sensor = Matrix34d::Identity();
  Matrix34d T_map_body = Matrix34d::Identity();
  std::vector<WatchedPoint> watched;  ///< What it told of them.
};

class HeldLocalMap final : public HeldMap {
 public:
  /// An empty map. max_points: 1 .. ScanCapacity::kMaxPoints. Raises InputError iff an option is
  /// out of its range, the budget is too small for a map or the archive holds blocks; Error iff the
  /// system does not give the memory.
  static std::shared_ptr<HeldLocalMap> make(const MapOptions& options, const Classes& classes,
                                            const std::optional<Matrix34d>& T_global_map,
                                            std::size_t max_points);
  /// The map of a file, to continue. Options that are fixed for the life of a map are the file's.
  /// Raises as make and load_map, and InputError iff it is a global map, classes differ from the
  /// file's, or the budget is too small for it.
  static std::shared_ptr<HeldLocalMap> load(const std::string& path, MapOptions options,
                                            const std::optional<Classes>& classes,
                                            std::size_t max_points);
  /// The archive goes with the map.
  ~HeldLocalMap() override;
  HeldLocalMap(const HeldLocalMap&) = delete;
  HeldLocalMap& operator=(const HeldLocalMap&) = delete;
  HeldLocalMap(HeldLocalMap&&) = delete;
  HeldLocalMap& operator=(HeldLocalMap&&) = delete;

  /// weights: null, or one per point. The arrays must not be written to meanwhile.
  IntegrationReport integrate(ScanView scan, const LabelsView& labels,
                              std::optional<std::int64_t> stamp_us);
  /// Of all scans since the map was made, loaded or cleared.
  [[nodiscard]] ScanTotals totals() const;
  /// True the first time. Needs the GIL.
  [[nodiscard]] bool is_first(ScanWarning warning) { return warned_.insert(warning).second; }
  /// Raises Error iff a sharer has to take notice of something before.
  void clear();
  /// Calls write(mapper) while no other thread reads or writes, without the GIL.
  template <class Write>
  auto write(Write&& write) {
    const py::gil_scoped_release released;
    const std::unique_lock alone(gate().mutex);
    return write(*parts_.mapper);
  }
  /// For who has the gate alone.
  [[nodiscard]] Mapper& mapper() { return *parts_.mapper; }
  /// Blocks leave the window by way of the sharer's queue from now on, which knows all that are
  /// archived; nullptr: they just leave. Raises InputError iff another sharer has the map.
  void share_by(EvictionQueue* queue);
  /// Blocks that the archive may hold; 0: there is none.
  [[nodiscard]] std::size_t archive_blocks() const;
  /// For who has the gate alone; null: the map is not in submaps.
  [[nodiscard]] HeldSubmaps* submaps() { return parts_.submaps.get(); }
  [[nodiscard]] bool in_submaps() const { return parts_.submaps != nullptr; }

  [[nodiscard]] std::uint64_t content_digest() const override;
  void save(const std::string& path) const override;
  [[nodiscard]] bool is_whole() const override { return !parts_.setup.window && !in_submaps(); }
  /// Nothing without a window.
  [[nodiscard]] std::optional<WindowTotals> window() const;
  [[nodiscard]] Classes class_table() const override { return parts_.classes; }
  [[nodiscard]] const MapSetup& setup() const { return parts_.setup; }
  [[nodiscard]] std::size_t scratch_bytes() const { return parts_.mapper->scratch_bytes(); }
  /// Most points of a scan; of a larger one a part is left out.
  [[nodiscard]] std::size_t max_points() const { return parts_.max_points; }
  [[nodiscard]] LastScan last_scan() const;
  /// What scans are to tell of from now on, in the frame of a submap.
  void watch(std::span<const WatchedPoint> points, std::uint32_t submap);

 private:
  struct Parts {
    HeldMapper mapper;
    std::shared_ptr<StoredMap> stored;  ///< The mapper's map.
    std::optional<HeldArchive> archive;
    std::unique_ptr<HeldSubmaps> submaps;
    MapSetup setup;
    Classes classes;
    std::size_t max_points = 0;
  };
  explicit HeldLocalMap(Parts parts) : HeldMap(parts.stored), parts_(std::move(parts)) {}
  [[nodiscard]] const LocalMap& current() const override { return parts_.mapper->map(); }
  static Parts make_parts(const MapOptions& options, MapSetup setup, const Classes& classes,
                          const MapIdentity& identity, std::size_t max_points);

  Parts parts_;
  bool is_shared_ = false;                ///< By a queue.
  std::vector<std::uint8_t> components_;  ///< Scratch of integrate.
  std::vector<WatchedPoint> watched_;     ///< By the scan that is being integrated.
  mutable std::mutex last_mutex_;         ///< Of the members below.
  std::vector<WatchedPoint> to_watch_;
  std::uint32_t watched_in_ = 0;
  LastScan last_;
  ScanTotals totals_;
  std::set<ScanWarning> warned_;
};

/// Updates the header's content and storage from the map. Called exclusively.
void measure_content(StoredMap& stored);

void add_map(py::module_& module);
void add_local_map(py::module_& module);

}  // namespace tessera::python
