// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a scan saw, as images on the six faces of a cube around the sensor: how far along its axis
// each face's pixels are free (docs/design/theory.md, Carving by the image of the scan).
#pragma once

#include <array>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/base/geometry.hpp"
#include "tessera/base/internal/lane_width.hpp"
#include "tessera/inference/internal/seen_image.hpp"
#include "tessera/inference/internal/slab_walk.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera {

/// A face of the cube: an axis of the map and a direction on it. Its columns and rows are the other
/// two axes, in the order of axes_across().
struct CubeFace {
  static constexpr int kCount = 6;
  int axis = 0;
  bool negative = false;
  [[nodiscard]] static constexpr CubeFace of(int number) noexcept {
    return {number >> 1, (number & 1) != 0};
  }
  /// Along the face's axis: positive before the sensor on this side.
  template <class Scalar>
  [[nodiscard]] constexpr Scalar depth(Scalar along) const noexcept {
    return negative ? -along : along;
  }
};

/// How the images lie in memory: by level, then face, then row.
struct CarveLayout {
  /// Across a face, from -1 to 1 of the tangents.
  static constexpr int kFacePixels = 512;
  /// More on each side, so that windows at a face's edge see what is beyond it.
  static constexpr int kPad = 16;
  static constexpr int kEdge = kFacePixels + 2 * kPad;
  static constexpr int kLevels = 5;
  /// Maxima of each level over squares of 4 pixels; each further step doubles the square.
  static constexpr int kFarSteps = 8;

  /// Pixels of a level are 2^shift_of(level) pixels wide.
  [[nodiscard]] static constexpr int shift_of(int level) noexcept {
    return level == 0 ? 0 : level - 1;
  }
  [[nodiscard]] static constexpr int edge_of(int level) noexcept {
    return kEdge >> shift_of(level);
  }
  [[nodiscard]] static constexpr int far_edge_of(int level, int step) noexcept {
    return (edge_of(level) + (4 << step) - 1) / (4 << step);
  }
  [[nodiscard]] static constexpr std::size_t square(int edge) noexcept {
    return static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge);
  }
  [[nodiscard]] static constexpr std::size_t begin_of(int face, int level) noexcept {
    std::size_t begin = static_cast<std::size_t>(face) * square(edge_of(level));
    for (int i = 0; i < level; ++i) begin += CubeFace::kCount * square(edge_of(i));
    return begin;
  }
  /// By level, then step, then face.
  [[nodiscard]] static constexpr std::size_t far_begin_of(int face, int level, int step) noexcept {
    std::size_t begin = static_cast<std::size_t>(face) * square(far_edge_of(level, step));
    for (int i = 0; i < level * kFarSteps + step; ++i)
      begin += CubeFace::kCount * square(far_edge_of(i / kFarSteps, i % kFarSteps));
    return begin;
  }
};

class CarveImage {
 public:
  static constexpr int kFacePixels = CarveLayout::kFacePixels;
  static constexpr int kPad = CarveLayout::kPad;
  static constexpr int kEdge = CarveLayout::kEdge;
  /// The nearer a voxel, the wider the windows that it is compared with: level 0 from kLevelVoxels
  /// voxels of depth on, each further one from half of the depth of the one before.
  static constexpr int kLevels = CarveLayout::kLevels;
  static constexpr int kLevelVoxels = 128;
  /// The most pixels on each side in which a nearer return counts.
  static constexpr int kMostNeighbours = 8;
  /// Less than any threshold: no return in the window.
  static constexpr std::int16_t kUnseen = -32768;

  [[nodiscard]] static constexpr std::size_t required_bytes() noexcept {
    return arena_bytes<std::int16_t>(kImage) + 2 * arena_bytes<std::int16_t>(kFace) +
           arena_bytes<std::int16_t>(kFarthest + kReadBeyond) +
           CubeFace::kCount * SeenImage::required_bytes(kEdge);
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<CarveImage> make(Arena& arena,
                                               LaneWidth lanes = LaneWidth::kWidest) noexcept;
  CarveImage() noexcept = default;

  /// An image without returns, for depths up to range_m. neighbours: 0 .. kMostNeighbours pixels.
  /// O(pixels of the rows used before).
  void begin(double range_m, int neighbours) noexcept;
  /// Adds a return at d (metres from the sensor, finite and not zero). is_hit: false: nothing was
  /// met up to range_m. O(1).
  void add(const Point3d& d, bool is_hit) noexcept;
  /// The same of hits, seen from origin_map. O(hits).
  void add_hits(std::span<const ScanPoint> hits, const Point3d& origin_map) noexcept;
  /// After the last add(): makes the levels. O(pixels of the rows with returns).
  void finish() noexcept;

  /// The pixel of a tangent, which counts from the outer edge of the padding.
  /// tangent * (kSlope - kBend * |tangent|) + kMiddle, so that pixels are nearly equal angles.
  static constexpr float kSlope = 1.25F * kFacePixels / 2;
  static constexpr float kBend = 0.25F * kFacePixels / 2;
  static constexpr float kMiddle = 0.5F * kFacePixels + kPad;
  [[nodiscard]] static constexpr double pixel(double tangent) noexcept {
    const double size = tangent < 0.0 ? -tangent : tangent;
    return tangent * (static_cast<double>(kSlope) - static_cast<double>(kBend) * size) +
           static_cast<double>(kMiddle);
  }
  [[nodiscard]] static constexpr int level_of(double depth_voxels) noexcept {
    int level = 0;
    while (level + 1 < kLevels && depth_voxels < static_cast<double>(kLevelVoxels >> level))
      ++level;
    return level;
  }
  /// A voxel at depth_m is free in a window whose value is at least this.
  [[nodiscard]] std::int32_t threshold(double depth_m) const noexcept {
    const double depth = depth_m * per_m_;
    return depth < static_cast<double>(kMostDepth) ? static_cast<std::int32_t>(depth) + 1 - kDepths
                                                   : std::int32_t{kBeyond};
  }
  /// The values of a level of a face: CarveLayout::edge_of(level) a row. Only rows() are set.
  [[nodiscard]] const std::int16_t* level(int face, int level) const noexcept {
    return image_.data() + kBegin[static_cast<std::size_t>(face * kLevels + level)];
  }
  /// The same of a face's finest pixels, as evidence is contradicted.
  [[nodiscard]] const std::int16_t* seen(int face, SeenBy by) const noexcept {
    return seen_images_[static_cast<std::size_t>(face)].values(by);
  }
  /// First and last of some rows.
  struct Rows {
    int first = kEdge;
    int last = -1;
    [[nodiscard]] bool any() const noexcept { return first <= last; }
  };
  /// Pixel rows of a face, beyond which no window sees anything.
  [[nodiscard]] const Rows& rows(int face) const noexcept {
    return rows_[static_cast<std::size_t>(face)];
  }
  /// False: no value of the level is as much as least within pixels first .. last of columns and
  /// rows, which are clamped to the image. At most 16 reads.
  [[nodiscard]] bool may_reach(int face, int level, std::int32_t least, std::array<int, 2> columns,
                               std::array<int, 2> rows) const noexcept;

 private:
  /// Depths are whole numbers from -kDepths on.
  static constexpr std::int32_t kDepths = 32767;
  static constexpr std::int32_t kMostDepth = 65'000;
  /// In an image that is not finished: no return.
  static constexpr std::int16_t kNone = 32767;
  static constexpr std::int16_t kBeyond = 32766;
  static constexpr std::size_t kFace = CarveLayout::square(kEdge);
  static constexpr std::size_t kImage = CarveLayout::begin_of(0, kLevels);
  static constexpr std::array<std::size_t, std::size_t{CubeFace::kCount}* kLevels> kBegin = [] {
    std::array<std::size_t, std::size_t{CubeFace::kCount} * kLevels> begin{};
    for (int i = 0; i < CubeFace::kCount * kLevels; ++i)
      begin[static_cast<std::size_t>(i)] = CarveLayout::begin_of(i / kLevels, i % kLevels);
    return begin;
  }();
  static constexpr std::size_t kFarthest = CarveLayout::far_begin_of(0, kLevels, 0);
  /// may_reach() reads four values of a row, wherever it ends.
  static constexpr std::size_t kReadBeyond = 3;
  static constexpr auto kFarBegin = [] {
    constexpr int kSteps = CarveLayout::kFarSteps;
    std::array<std::size_t, std::size_t{CubeFace::kCount} * kLevels * kSteps> begin{};
    for (int i = 0; i < CubeFace::kCount * kLevels * kSteps; ++i)
      begin[static_cast<std::size_t>(i)] =
          CarveLayout::far_begin_of(i / kSteps / kLevels, i / kSteps % kLevels, i % kSteps);
    return begin;
  }();

  [[nodiscard]] std::int16_t* level_of_face(int face, int level) noexcept {
    return image_.data() + kBegin[static_cast<std::size_t>(face * kLevels + level)];
  }
  [[nodiscard]] static constexpr std::size_t far_begin(int face, int level, int step) noexcept {
    return kFarBegin[static_cast<std::size_t>((face * kLevels + level) * CarveLayout::kFarSteps +
                                              step)];
  }
  void put(int axis, bool negative, int row, int column, std::int16_t value) noexcept;
  void make_farthest(int face, int level) noexcept;
  void make_levels(int face) noexcept;

  const ImageRows* row_functions_ = nullptr;
  bool by_fours_ = false;  ///< Hits are added as machines with AVX2 can.
  std::span<std::int16_t> image_;
  std::span<std::int16_t> nearest_;
  std::span<std::int16_t> seen_;
  std::span<std::int16_t> farthest_;
  std::array<SeenImage, CubeFace::kCount> seen_images_{};
  std::array<Rows, CubeFace::kCount> rows_{};
  double per_m_ = 1.0;
  int neighbours_ = 0;
};

}  // namespace tessera
