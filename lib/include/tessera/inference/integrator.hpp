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
#include "tessera/inference/internal/image_carver.hpp"
#include "tessera/inference/internal/label_writer.hpp"
#include "tessera/inference/internal/ray_tracer.hpp"
#include "tessera/inference/internal/scan_points.hpp"
#include "tessera/inference/internal/scan_scratch.hpp"
#include "tessera/inference/scan_report.hpp"
#include "tessera/map/local_map.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera {

class Integrator {
 public:
  /// Bytes of arena that make takes: less without free space, and outside the kernel mode.
  [[nodiscard]] static constexpr std::size_t required_bytes(
      const ScanCapacity& capacity, const InferenceConfig& config) noexcept {
    return ScanPoints::required_bytes(capacity.points) + ScanTiles::required_bytes(capacity) +
           LabelWriter::required_bytes(config.mode) +
           (config.free_space.enabled
                ? FreeSpace::required_bytes(capacity, config.free_space.carving)
                : 0) +
           (config.free_space.uses_image() ? ImageCarver::required_bytes() : 0);
  }

  /// An integrator with scratch memory from the arena. In the lattice mode its maps should keep
  /// votes (MapConfig::label_votes): see InferenceMode. Fails with kInvalidArgument iff a value of
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
  /// unit edge e (multi-entropy; lattice, and of each tile LabelField::look() beside them, which
  /// are no evaluations), n (2 D + 2)^3 with D in voxels (kernel); ray steps n (range in
  /// voxels * sqrt(3) + 4). Where not all fits: twice the ray steps in the first scan of which
  /// memory refuses some, else once; a step for each block on a ray; for each unit of points a
  /// look-up of its tile and of the blocks of up to 4 tiles (kernel: (D / 8 + 2)^3 tiles, three
  /// times); and always O(scratch tables), as they are cleared.
  /// With Carving::kImage no ray is walked: what all returns in range show, admitted or not, is
  /// freed. Steps are ImageCarver's, and one more quantum is its image: O(returns + pixels).
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
  /// steps each; kRayBatch rays traced, likewise; all votes of the lattice mode, O(points + tiles);
  /// one tile written, at most 7 e^3 evaluations for each of its points and those of its faces
  /// (multi-entropy; lattice, with LabelField::look()), or those of all points in reach times its
  /// 512 voxels (kernel); kBlockBatch blocks carved, of 512 voxels. After it comes a look-up for
  /// each tile and ray block of the scan, as blocks opened in vain are closed; if the map's index
  /// refused one, the whole index is walked instead.
  ScanReport integrate(LocalMap& map, const ScanView& scan, Deadline& deadline,
                       std::int64_t due_us) noexcept;
  static constexpr std::size_t kReturnBatch = ScanPoints::kReturnBatch;
  static constexpr std::size_t kPointBatch = ScanWork::kPointBatch;
  static constexpr std::size_t kRayBatch = RayTracer::kRayBatch;
  static constexpr std::size_t kRaySweeps = RayTracer::kRaySweeps;
  static constexpr std::size_t kBlockBatch = 32;

  /// The points of the last scan that were integrated, thinned, in the order in which they were
  /// added: for tests and for those who want to see what the map learnt from.
  [[nodiscard]] std::span<const ScanPoint> admitted() const noexcept { return points_.admitted(); }
  /// Ends of the last scan's rays to returns beyond the range limit, likewise.
  [[nodiscard]] std::span<const ScanPoint> admitted_rays() const noexcept { return points_.rays(); }
  /// Of scans from now on; 0: no limit.
  void set_work_budget(std::uint64_t work) noexcept { config_.work_budget = work; }
  [[nodiscard]] const InferenceConfig& config() const noexcept { return config_; }

 private:
  ScanReport integrate_scan(LocalMap& map, const ScanView& scan, Deadline* deadline) noexcept;
  /// Registers and thins; false: the time is up, and all was left out.
  bool register_scan(const LocalMap& map, const ScanView& scan, ScanReport& report) noexcept;
  /// Admits points and fills the scratch for them, up to where writing can begin. True: all of
  /// them, and nothing was opened in vain. Ends where the deadline comes.
  bool admit(LocalMap& map, ScanReport& report) noexcept;
  /// Leaves out the points whose labels could not be written in time, by order_of_admission.
  void shed_points(ScanReport& report) noexcept;
  /// Whether the bounds on the admitted points' work stay within the limit.
  [[nodiscard]] bool within_limit(ScanReport& report) noexcept;
  /// Empties the tables of tiles and ray blocks.
  void begin_scratch(const LocalMap& map) noexcept;
  /// Fills tiles and ray blocks for the admitted points. False: one of them does not fit, or the
  /// deadline came.
  bool fill_scratch(const LocalMap& map) noexcept;
  /// Carving by the image: marks what the scan saw to be free.
  void carve(const LocalMap& map) noexcept;
  /// Marks the map's blocks that may hold what moves to be looked at, with none of it free; ends
  /// where carving by the image would. O(blocks that the map lists).
  void look_at_moving(const LocalMap& map, std::uint64_t to_write,
                      std::uint64_t most_steps) noexcept;
  /// Tells of points whether the scan saw through them, or met something there. O(points).
  void look_at_watched(const Lattice& lattice, std::span<WatchedPoint> watched) noexcept;
  /// Contradicts labels of a block that the scan saw through, and counts passes of what of carved
  /// they did not occupy.
  void contradict(LocalMap& map, SlabHandle handle, const RayBlock& seen, const VoxelMask& carved,
                  ScanReport& report) noexcept;
  /// Forgets marks in blocks that the map has no room for beside what is reserved, nearest first.
  void drop_what_does_not_fit(LocalMap& map, ScanReport& report) noexcept;
  /// True iff the map has room for all that the scratch wants.
  bool fits_whole(const LocalMap& map) noexcept;
  /// Opens the map's blocks that the scratch wants. False: the map's index refused one.
  bool open_blocks(LocalMap& map) noexcept;
  void admit_one_by_one(LocalMap& map, ScanReport& report) noexcept;
  void refuse_all(const LocalMap& map, ScanReport& report) noexcept;
  /// The deadline came before anything was written.
  void leave_out_all(ScanReport& report) noexcept;
  void write_free_space(LocalMap& map, ScanReport& report) noexcept;
  /// all_written: nothing was opened for rays in vain.
  void close_unwritten_blocks(LocalMap& map, bool all_written) noexcept;

  InferenceConfig config_{};
  ScanPoints points_{};
  ScanScratch scratch_{};
  RayTracer tracer_{};
  ImageCarver carver_{};
  LabelWriter labels_{};
  ScanWork work_{};
  KernelReach reach_{};               ///< Of the current scan.
  SlabPool::Counts reserved_{};       ///< Of the map, for labels admitted one by one.
  std::uint64_t carve_steps_ = 0;     ///< Of the current scan.
  bool image_made_ = false;           ///< Of the current scan.
  bool carving_cut_ = false;          ///< Some of the current scan's free space was left out.
  bool emptied_ = false;              ///< Of a block all labels went, and there were no passes.
  std::uint64_t rays_predicted_ = 0;  ///< Ray steps of all admitted, at most.
  bool over_limit_ = false;           ///< The scan as a whole takes more than the limit of work.
  bool open_failed_ = false;  ///< The map's index refused a block: some may be open in vain.
  /// Memory refused some of the last scan, so the next is not tried as a whole.
  bool memory_was_short_ = false;
};

}  // namespace tessera
