// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The points of a scan: registered in the map frame and quantised once, thinned, then those that
// are admitted. Finite and in the grid from registration on.
#pragma once

#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/base/internal/lane_width.hpp"
#include "tessera/base/internal/radix_sort.hpp"
#include "tessera/inference/inference_config.hpp"
#include "tessera/inference/internal/scan_work.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera {

class ScanPoints {
 public:
  /// Returns registered from one reading of the clock to the next.
  static constexpr std::size_t kReturnBatch = 4096;

  [[nodiscard]] static constexpr std::size_t required_bytes(std::size_t capacity) noexcept {
    return 2 * arena_bytes<ScanPoint>(capacity) + arena_bytes<KeyedIndex>(2 * capacity);
  }
  /// capacity: most returns of a scan, at least 1. The arena must have required_bytes().
  /// The bits are the same for all widths of lanes.
  [[nodiscard]] static ScanPoints make(Arena& arena, std::size_t capacity,
                                       LaneWidth lanes = LaneWidth::kWidest) noexcept;
  /// No memory: every return of a scan is over capacity.
  ScanPoints() noexcept = default;

  /// Begins a scan seen from origin_map, metres. False: that is outside the grid, and there are no
  /// points. O(1).
  [[nodiscard]] bool begin(const Lattice& lattice, const Point3d& origin_map) noexcept;
  /// Registers the returns, in the map frame, and counts each. More than fit are sampled evenly, so
  /// that what is left is still all around the sensor. component: of a return without a known
  /// class. Where the time is up they are all left out. O(returns).
  void register_returns(const Lattice& lattice, const ScanView& scan, const InferenceConfig& config,
                        std::uint8_t unlabelled, ScanWork& work, ScanReport& report) noexcept;
  /// Thins what was registered of that scan; that is admitted from here on. Sorts it:
  /// O(registered).
  void thin(const Lattice& lattice, const ScanView& scan, const InferenceConfig& config,
            std::uint8_t unlabelled) noexcept;

  /// All returns within the range limit, before thinning, with their best label. Where labels have
  /// weights, label_weights is the number of the return.
  [[nodiscard]] std::span<const ScanPoint> returns() const noexcept {
    return registered_.first(registered_count_);
  }
  /// Those beyond the range limit, moved to that limit, and the ends of what did not come back.
  [[nodiscard]] std::span<const ScanPoint> returns_beyond() const noexcept {
    return registered_.last(far_count_);
  }
  /// In the order in which they are added to the map.
  [[nodiscard]] std::span<const ScanPoint> admitted() const noexcept {
    return thinned_.first(admitted_count_);
  }
  /// Ends of rays to returns beyond the range limit, at that limit.
  [[nodiscard]] std::span<const ScanPoint> rays() const noexcept { return rays_.first(ray_count_); }
  /// Of both: where ray i ends, first of the points.
  [[nodiscard]] const ScanPoint& end_of_ray(std::size_t i) const noexcept {
    return i < admitted_count_ ? thinned_[i] : rays_[i - admitted_count_];
  }
  [[nodiscard]] float largest_weight() const noexcept { return largest_weight_; }
  [[nodiscard]] const Point3d& origin_map() const noexcept { return origin_map_; }
  /// That origin_map() lies in once rounded to float.
  [[nodiscard]] const VoxelCoord& origin_voxel() const noexcept { return origin_voxel_; }

  /// Numbers i of end_of_ray(), for rays and points or for points alone, in order_of_admission().
  /// Valid until the next call of anything but refuse() and the reading functions. O(points).
  [[nodiscard]] std::span<const KeyedIndex> in_order(int unit_edge, bool with_rays,
                                                     bool spread) noexcept;
  /// Marks number i; drop_refused() takes the marked ones out.
  void refuse(std::size_t i) noexcept {
    (i < admitted_count_ ? thinned_[i] : rays_[i - admitted_count_]).component = kRefused;
  }
  /// The others stay in their order, so that sums run as they would without the refused ones.
  /// O(points).
  void drop_refused() noexcept;
  void drop_all() noexcept { admitted_count_ = ray_count_ = 0; }
  /// Scratch of two entries a return, for those who sort the points between other calls.
  [[nodiscard]] std::span<KeyedIndex> scratch() const noexcept { return sort_; }

 private:
  /// Returns in range from the front, ray ends of returns beyond the range from the back.
  std::span<ScanPoint> registered_;
  std::span<ScanPoint> thinned_;  ///< Points, then ray ends.
  std::span<ScanPoint> rays_;     ///< The ray ends in thinned_.
  std::span<KeyedIndex> sort_;
  std::size_t registered_count_ = 0;
  std::size_t far_count_ = 0;
  std::size_t admitted_count_ = 0;
  std::size_t ray_count_ = 0;
  float largest_weight_ = 0.0F;  ///< Of the thinned points.
  bool by_fours_ = false;        ///< Returns are placed as machines with AVX2 can.
  Point3d origin_map_ = Point3d::Zero();
  VoxelCoord origin_voxel_{};
};

}  // namespace tessera
