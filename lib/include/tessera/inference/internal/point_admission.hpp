// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Admission one by one, for a scan that does not fit as a whole. Bounds here are never under what
// the scan takes in the end; the tiles, ray blocks and blocks of the map that are made here stay.
// So filling the scratch for what was admitted finds all that it needs.
#pragma once

#include <array>

#include "tessera/inference/internal/kernel_reach.hpp"
#include "tessera/inference/internal/scan_points.hpp"
#include "tessera/inference/internal/scan_scratch.hpp"
#include "tessera/inference/internal/storage_needs.hpp"
#include "tessera/inference/internal/wanted_units.hpp"

namespace tessera {

/// Of one scan; what it is given must outlive it.
class PointAdmission {
 public:
  PointAdmission(LocalMap& map, ScanPoints& points, ScanScratch& scratch,
                 const InferenceConfig& config, KernelReach reach) noexcept
      : map_(map), points_(points), scratch_(scratch), config_(config), reach_(reach) {}

  /// Admits a point and its ray together, or neither, in order_of_admission(); drops the others and
  /// counts each by its reason. Ends at the first that the limit of work does not cover; passes
  /// over what does not fit the memory. spread: as AdmissionScene. The scratch must be empty.
  /// O(points log points), a step for each block on a ray, for each unit of points a look-up of its
  /// tile and of the blocks of up to 4 tiles (kernel: of all tiles in reach, three times).
  void admit(ScanWork& limit, bool spread, ScanReport& report) noexcept;
  /// A bound on the ray steps of what was admitted.
  [[nodiscard]] std::uint64_t rays_predicted() const noexcept { return rays_predicted_; }
  /// What the admitted ones need of the map beside blocks, which are open.
  [[nodiscard]] const SlabPool::Counts& reserved() const noexcept { return reserved_; }
  /// True: the map's index refused a block, and some may be open for nothing.
  [[nodiscard]] bool index_refused() const noexcept { return index_refused_; }

 private:
  /// What a point did not fit in.
  enum class Refusal : std::uint8_t { kNone, kStorage, kTiles, kRayBlocks };
  /// Units of a tile that evidence of a point may come to.
  struct UnitsOfTile {
    std::uint32_t tile = 0;
    std::uint64_t units = 0;
  };
  /// A point in a unit in which no admitted point lies yet; other points of a unit need nothing
  /// more.
  struct NewUnit {
    ScanTiles::Place place;
    std::uint32_t tile = 0;  ///< Its number plus one; 0: there is none yet.
  };
  /// What a point and its ray need of the map beyond what is reserved for those before.
  struct PointPlan {
    SlabPool::Counts wanted{};  ///< Items of storage, those reserved before included.
    std::uint32_t own = 0;      ///< The point's tile, if its unit is a new one.
    /// Where its evidence may come to, except in the kernel mode: its own tile and those at the
    /// faces that its unit touches.
    std::array<UnitsOfTile, 4> reached{};
    std::size_t reached_count = 0;
  };
  [[nodiscard]] static std::uint32_t& refusal_counter(ScanReport& report, Refusal refusal) noexcept;
  template <class Visit>
  bool for_units_reached(std::uint32_t own, const ScanTiles::Place& place, Visit&& visit) noexcept;
  /// Calls visit(number of a tile, its units) for all units of a plan.
  template <class Visit>
  bool for_units_planned(const ScanTiles::Place& place, const PointPlan& plan,
                         Visit&& visit) noexcept;
  bool plan_units(const NewUnit& unit, PointPlan& plan) noexcept;
  Refusal plan_ray(const ScanPoint& end, PointPlan& plan) noexcept;
  Refusal plan_point(const ScanPoint& point, const NewUnit* new_unit, PointPlan& plan) noexcept;
  bool open_plan(const NewUnit* new_unit, const PointPlan& plan) noexcept;
  /// Reserves everything that the point and its ray may need, or nothing.
  Refusal reserve(const ScanPoint& point, bool is_point) noexcept;

  LocalMap& map_;
  ScanPoints& points_;
  ScanScratch& scratch_;
  const InferenceConfig& config_;
  KernelReach reach_;
  SlabPool::Counts reserved_{};  ///< Items of storage for those admitted so far.
  std::uint64_t rays_predicted_ = 0;
  bool index_refused_ = false;
};

}  // namespace tessera
