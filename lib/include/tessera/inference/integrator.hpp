// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Turns a scan into evidence in a map: register, thin, admit, write, carve. Points are admitted
// before anything is written, so the map afterwards is what integrating the admitted points alone
// would have made it. No heap, no clock.
#pragma once

#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/inference/deadline.hpp"
#include "tessera/inference/inference_config.hpp"
#include "tessera/inference/internal/free_space.hpp"
#include "tessera/inference/internal/kernel_strip.hpp"
#include "tessera/inference/internal/scan_tiles.hpp"
#include "tessera/inference/internal/tile_evidence.hpp"
#include "tessera/inference/scan_report.hpp"
#include "tessera/map/local_map.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera {

class Integrator {
 public:
  /// What a point did not fit in.
  enum class Refusal : std::uint8_t { kNone, kStorage, kTiles, kRayBlocks };

  /// Bytes of arena that make takes: less without free space, and outside the kernel mode.
  [[nodiscard]] static constexpr std::size_t required_bytes(
      const ScanCapacity& capacity, const InferenceConfig& config) noexcept {
    return 2 * arena_bytes<ScanPoint>(capacity.points) +
           arena_bytes<KeyedIndex>(2 * std::size_t{capacity.points}) +
           ScanTiles::required_bytes(capacity) + arena_bytes<OctetEvidence>(1) +
           (config.mode == InferenceMode::kKernel ? KernelStrip::required_bytes() : 0) +
           (config.free_space.enabled ? FreeSpace::required_bytes(capacity) : 0);
  }

  /// An integrator with scratch memory from the arena. Fails with kInvalidArgument iff a value of
  /// config is outside its documented range, a capacity is zero, or points is over
  /// ScanCapacity::kMaxPoints; kResourceExhausted iff the arena is too small or not aligned to
  /// kArenaAlignment.
  [[nodiscard]] static Result<Integrator> make(Arena& arena, const InferenceConfig& config,
                                               const ScanCapacity& capacity) noexcept;
  /// No scratch memory: every return of a scan is over capacity.
  Integrator() noexcept = default;
  /// Moves only, as LocalMap.
  Integrator(const Integrator&) = delete;
  Integrator& operator=(const Integrator&) = delete;
  Integrator(Integrator&&) noexcept = default;
  Integrator& operator=(Integrator&&) noexcept = default;
  ~Integrator() = default;

  /// Integrates one scan. Never fails: what was refused or left out is in the report, counted by
  /// reason.
  ///
  /// All points are admitted if what they need fits the work budget, the scratch memory and the
  /// map's free storage. If not, or if memory refused some of the scan before, they are admitted
  /// one by one, a point and its ray together or not at all. Over the work budget: near before far
  /// and sparse before dense (order_of_admission), until the first that the budget does not cover.
  /// Within it: nearest first, passing over what does not fit the memory.
  ///
  /// Worst-case work with n points, at most: sorts O(n); evaluations n (counting), 7 n e^3 with
  /// unit edge e (multi-entropy), n (2 D + 2)^3 with D in voxels (kernel); ray steps n (range in
  /// voxels * sqrt(3) + 4). Where not all fits: twice the ray steps in the first scan of which
  /// memory refuses some, else once; a step for each block on a ray; for each unit of points a
  /// look-up of its tile and of the blocks of up to 4 tiles (kernel: (D / 8 + 2)^3 tiles, three
  /// times); and always O(scratch tables), as they are cleared.
  ScanReport integrate(LocalMap& map, const ScanView& scan) noexcept;
  /// The same, to be done at due_us on the policy's clock. With time enough the map is the same to
  /// the bit; ScanReport::evaluations may differ in the kernel mode, which writes tile by tile
  /// then.
  ///
  /// Time is spent as work. Of the points, by order_of_admission, those are admitted whose labels
  /// fit the time left (Deadline::begin_work). Then the clock is held against it: rays are traced,
  /// spread over all directions, as long as what was admitted can still be written in time
  /// (admission one by one, where memory is short, ends likewise); and where the time is up all
  /// the same, what is not begun is left out: tiles and then blocks of free space are written in
  /// rings of doubling distance around the sensor, nearest first, labels before free space.
  ///
  /// Law: call a tile's label evidence, or a block's free evidence, a part. With all admitted
  /// points and all rays that were traced, each part is as if there had been no deadline, or as it
  /// was before the scan: never between. Where tiles_cut, rays_cut and ray_blocks_cut are 0, the
  /// map is what integrating the admitted points alone makes of it. Where the time is up before
  /// writing, no part is changed.
  ///
  /// The clock is read before every quantum, and when time is up at most the quantum at hand is
  /// finished. A quantum is at most one of: kReturnBatch returns registered; three O(n) passes over
  /// the points (thinning, sorting, marking hits) or O(scratch tables) passes (clearing, entropies,
  /// opening blocks); kPointBatch points admitted, at most (range in voxels * sqrt(3) + 4) ray
  /// steps each; kRayBatch rays traced, likewise; one tile written, at most 7 e^3 evaluations for
  /// each of its points and those of its faces (multi-entropy), or those of all points in reach
  /// times its 512 voxels (kernel); kBlockBatch blocks carved, of 512 voxels. After it comes a
  /// look-up for each tile and ray block of the scan, as blocks opened in vain are closed; if the
  /// map's index refused one, the whole index is walked instead.
  ScanReport integrate(LocalMap& map, const ScanView& scan, Deadline& deadline,
                       std::int64_t due_us) noexcept;
  static constexpr std::size_t kReturnBatch = 4096;
  static constexpr std::size_t kPointBatch = 64;
  static constexpr std::size_t kRayBatch = 64;
  /// Parts of a scan's rays, each spread over all directions, that are traced one after the other.
  static constexpr std::size_t kRaySweeps = 16;
  static constexpr std::size_t kBlockBatch = 32;

  /// The points of the last scan that were integrated, thinned, in the order in which they were
  /// added: for tests and for those who want to see what the map learnt from.
  [[nodiscard]] std::span<const ScanPoint> admitted() const noexcept {
    return admitted_.first(admitted_count_);
  }
  /// Ends of the last scan's rays to returns beyond the range limit, likewise.
  [[nodiscard]] std::span<const ScanPoint> admitted_rays() const noexcept {
    return rays_.first(ray_count_);
  }
  /// Of scans from now on; 0: no limit.
  void set_work_budget(std::uint64_t work) noexcept { config_.work_budget = work; }
  [[nodiscard]] const InferenceConfig& config() const noexcept { return config_; }

 private:
  void register_points(const LocalMap& map, const ScanView& scan, ScanReport& report) noexcept;
  void thin_points(const LocalMap& map, ScanReport& report) noexcept;
  /// Empties the tables of tiles and ray blocks.
  void begin_scratch(const LocalMap& map) noexcept;
  ScanReport integrate_scan(LocalMap& map, const ScanView& scan) noexcept;
  /// Sets where the scan is seen from. False: outside the grid.
  [[nodiscard]] bool place_sensor(const Lattice& lattice, const Point3d& origin_map) noexcept;
  /// Admits points and fills the scratch for them, up to where writing can begin. True: all of
  /// them, and nothing was opened in vain. Ends where the deadline comes.
  bool admit(LocalMap& map, ScanReport& report) noexcept;
  void refuse_all(const LocalMap& map, ScanReport& report) noexcept;
  /// Without a deadline, true. Else reads the clock, unless the time was up already: whether so
  /// much work still fits.
  [[nodiscard]] bool in_time(std::uint64_t work = 0) noexcept;
  void set_work_limit(ScanReport& report) noexcept;
  /// Leaves out the points whose labels could not be written in time, by order_of_admission.
  void shed_points(ScanReport& report) noexcept;
  /// The work that was done since set_work_limit(), as Deadline counts it.
  [[nodiscard]] std::uint64_t work_done(const ScanReport& report) const noexcept;
  void learn_from(const ScanReport& report) noexcept;
  /// Evaluations for a point that time is kept for: at most evaluations_per_point().
  [[nodiscard]] std::uint64_t foreseen_per_point() const noexcept;
  /// Moves the points that were not refused to the front, in their order, so that sums run as they
  /// would without the refused ones; returns their number.
  [[nodiscard]] static std::size_t keep_admitted(std::span<ScanPoint> points) noexcept;
  /// The deadline came before anything was written.
  void leave_out_all(ScanReport& report) noexcept;
  /// Calls write(item), or leave(item) for those that the deadline leaves out: in the order of
  /// items, or with a deadline by rings around the coordinates centre, the clock read every batch
  /// items.
  template <class Item, class Write, class Leave>
  void write_in_time(std::span<const Item> items, const BlockCoord& centre, std::size_t batch,
                     Write&& write, Leave&& leave) noexcept;
  /// The block that the sensor is in; the tile, if blocks is false.
  [[nodiscard]] BlockCoord sensor_place(bool blocks) const noexcept;
  void count_cut_tile(const Tile& tile, ScanReport& report) const noexcept;
  /// Whether the bounds on the admitted points' work stay within the limit.
  [[nodiscard]] bool within_limit(ScanReport& report) noexcept;
  /// Fills tiles and ray blocks for the admitted points. False: one of them does not fit, or the
  /// deadline came.
  bool fill_scratch(const LocalMap& map) noexcept;
  /// True iff the map has room for all that the scratch wants.
  bool fits_whole(const LocalMap& map) noexcept;
  bool want_units(const LocalMap& map) noexcept;
  bool want_kernel_units() noexcept;
  bool trace_rays() noexcept;
  [[nodiscard]] std::span<RayBlock> ray_blocks() noexcept {
    return config_.free_space.enabled ? free_space_.blocks() : std::span<RayBlock>{};
  }
  /// Where ray i ends: of the thinned points, then of the far rays.
  [[nodiscard]] const Point3f& ray_end(std::size_t i) const noexcept {
    return i < admitted_count_ ? admitted_[i].p_map : rays_[i - admitted_count_].p_map;
  }
  /// Whether so much work is over the limit, or the time is up but for what is to be written.
  bool is_spent(std::uint64_t work, std::uint64_t to_write, std::size_t& asked) noexcept;
  /// Opens the map's blocks that the scratch wants. False: the map's index refused one.
  bool open_blocks(LocalMap& map) noexcept;
  bool open_tile(LocalMap& map, Tile& tile, std::uint64_t units) noexcept;
  /// Adds to wanted a bound on what writing units takes beyond what the map has, and notes the
  /// blocks that are open; counted: units counted before.
  void count_tile(const LocalMap& map, Tile& tile, std::uint64_t units, std::uint64_t counted,
                  SlabPool::Counts& wanted) const noexcept;
  /// The same for a ray block.
  static void count_ray_block(const LocalMap& map, RayBlock& ray_block,
                              SlabPool::Counts& wanted) noexcept;
  [[nodiscard]] std::uint64_t evaluations_per_point() const noexcept;
  /// Admission one by one, in order_of_admission.
  void admit_one_by_one(LocalMap& map, ScanReport& report) noexcept;
  /// Counts what the work limit leaves out: the budget's or the deadline's.
  [[nodiscard]] std::uint32_t* work_counter(ScanReport& report, bool is_point) const noexcept;
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
    /// Where its evidence may come to, but in the kernel mode: its own tile and those at the faces
    /// that its unit touches.
    std::array<UnitsOfTile, 4> reached{};
    std::size_t reached_count = 0;
  };
  template <class Visit>
  bool for_units_reached(std::uint32_t own, const ScanTiles::Place& place, Visit&& visit) noexcept;
  /// Calls visit(number of a tile, its units) for all that a plan is of.
  template <class Visit>
  bool for_units_planned(const ScanTiles::Place& place, const PointPlan& plan,
                         Visit&& visit) noexcept;
  [[nodiscard]] std::uint64_t receiving_units(const Tile& tile,
                                              std::uint64_t reached) const noexcept;
  bool plan_units(const LocalMap& map, const NewUnit& unit, PointPlan& plan) noexcept;
  Refusal plan_ray(LocalMap& map, const ScanPoint& end, PointPlan& plan) noexcept;
  Refusal plan_point(LocalMap& map, const ScanPoint& point, const NewUnit* new_unit,
                     PointPlan& plan) noexcept;
  bool open_plan(LocalMap& map, const NewUnit* new_unit, const PointPlan& plan) noexcept;
  /// Reserves everything that the point and its ray may need, or nothing. reserved: items for those
  /// before, and then for this one too.
  Refusal reserve(LocalMap& map, const ScanPoint& point, bool is_point,
                  SlabPool::Counts& reserved) noexcept;
  void write(LocalMap& map, ScanReport& report) noexcept;
  void write_labels(LocalMap& map, ScanReport& report) noexcept;
  void write_units(LocalMap& map, const Tile& tile, EvidenceWork& work,
                   ScanReport& report) noexcept;
  void write_octet(LocalMap& map, SlabHandle block, int octet, ScanReport& report) noexcept;
  void write_strips(LocalMap& map, EvidenceWork& work, ScanReport& report) noexcept;
  void sum_strip(const LocalMap& map, std::span<const Tile* const> strip,
                 EvidenceWork& work) noexcept;
  void write_strip(LocalMap& map, std::span<const Tile* const> strip, EvidenceWork& work,
                   ScanReport& report) noexcept;
  void add_row_to_strip(std::span<const Tile* const> strip, std::span<const Tile* const> row,
                        int dy, int dz, const KernelShape& kernel, EvidenceWork& work) noexcept;
  void add_to_strip(const Tile* from, const std::array<int, 3>& offset, int tiles,
                    const KernelShape& kernel, EvidenceWork& work) noexcept;
  void write_free_space(LocalMap& map, ScanReport& report) noexcept;
  /// all_written: nothing was opened for rays in vain.
  void close_unwritten_blocks(LocalMap& map, bool all_written) noexcept;
  [[nodiscard]] KernelShape shape(float length_voxels) const noexcept {
    return {1.0F / (length_voxels * length_voxels), config_.kernel_scale, config_.min_weight};
  }
  [[nodiscard]] int unit_edge() const noexcept {
    return config_.mode == InferenceMode::kMultiEntropy ? config_.entropy.block_edge : 2;
  }
  /// Sets the two below for the scan's weights.
  void measure_kernel(double resolution_m) noexcept;

  InferenceConfig config_{};
  /// Returns in range from the front, ray ends of returns beyond the range from the back.
  std::span<ScanPoint> registered_;
  std::span<ScanPoint> admitted_;  ///< Thinned points, then thinned ray ends.
  std::span<ScanPoint> rays_;      ///< The ray ends in admitted_.
  std::span<KeyedIndex> sort_;
  std::span<OctetEvidence> octet_;  ///< Sums of the octet at hand.
  ScanTiles tiles_{};
  KernelStrip strip_{};
  FreeSpace free_space_{};
  std::size_t registered_count_ = 0;
  std::size_t far_count_ = 0;
  std::size_t admitted_count_ = 0;
  std::size_t ray_count_ = 0;
  Deadline* deadline_ = nullptr;  ///< Of the scan at hand.
  bool cut_ = false;              ///< Its time is up.
  bool over_limit_ = false;       ///< The scan as a whole takes more than the limit of work.
  bool limit_is_deadline_ = false;
  /// Steps that opening and carving a ray block takes as long as, about.
  static constexpr std::uint64_t kBlockWork = 128;
  static constexpr std::uint64_t kNoLimit = ~std::uint64_t{0};
  std::uint64_t work_limit_ = kNoLimit;
  std::uint64_t rays_predicted_ = 0;  ///< Ray steps of all admitted, at most.
  std::uint64_t seen_per_point_ = 0;  ///< Of the scans with a deadline; 0: nothing yet.
  std::size_t rays_cut_ = 0;
  std::size_t first_sweep_ = 0;  ///< That rays are traced in.
  /// Memory refused some of the last scan, so the next is not tried as a whole.
  bool memory_was_short_ = false;
  bool open_failed_ = false;  ///< The map's index refused a block: some may be open for nothing.
  float largest_weight_ = 0.0F;
  float kernel_radius_ =
      0.0F;  ///< Distance beyond which no contribution counts, voxels (kernel mode).
  int kernel_reach_units_ =
      0;  ///< Most units from a point's unit to one it contributes to, on an axis (kernel mode).
  Point3d origin_map_ = Point3d::Zero();
  VoxelCoord origin_voxel_{};  ///< That origin_map_ lies in once rounded to float.
};

}  // namespace tessera
