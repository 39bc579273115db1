// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/image_carver.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "carve_slabs.hpp"

namespace tessera {

namespace {

/// Voxels whose centres are nearer along a face's axis are left.
constexpr double kNearest_voxels = 0.01;
/// Shells around the sensor, each twice as far as the one before.
constexpr int kShells = 5;
constexpr int kMostLevels = 20;
/// Nodes of one path from a root to a block, and those beside it.
constexpr std::size_t kMostTreeNodes = 7 * kMostLevels + 1;

/// Tangents of a box that lies between two depths, on one axis.
struct Tangents {
  double low = 0.0;
  double high = 0.0;
};
Tangents tangents_of(double low, double high, double nearest, double farthest) noexcept {
  return {low / (low < 0.0 ? nearest : farthest), high / (high > 0.0 ? nearest : farthest)};
}

}  // namespace

struct ImageCarver::KeptSlabs {
  std::int32_t at = 0;
  int face = -1;  ///< None.
  std::array<CarveSlab, kBlockEdge> slabs{};
};

Result<ImageCarver> ImageCarver::make(Arena& arena, LaneWidth lanes) noexcept {
  const Result<CarveImage> image = CarveImage::make(arena, lanes);
  if (!image.ok()) return image.status();
  ImageCarver made;
  made.image_ = *image;
  static_assert(sizeof(KeptSlabs) * kKept <= kKeptBytes);
  const std::span<KeptSlabs> kept = arena.take<KeptSlabs>(kKept);
  if (kept.empty()) return Status::kResourceExhausted;
  made.kept_ = kept.data();
  const CompareSlabs eights =
      lanes == LaneWidth::kWidest && has_avx2() ? compare_slabs_by_eights() : nullptr;
  made.compare_ = eights == nullptr ? compare_slabs_by_fours() : eights;
  return made;
}

bool ImageCarver::carve(const Lattice& lattice, const FreeSpaceConfig& config,
                        FreeSpace& free_space, ScanWork& work, std::uint64_t to_write,
                        std::uint64_t most_steps) noexcept {
  resolution_m_ = lattice.resolution_m();
  margin_m_ = static_cast<double>(config.margin_voxels) * resolution_m_;
  steps_ = 0;
  asked_ = 0;
  // One that was never made has none.
  for (std::size_t i = 0; kept_ != nullptr && i < kKept; ++i) kept_[i].face = -1;
  // Near shells first. Where scans are cut off, faces and the sides of cubes take turns.
  double inner_m = 0.0;
  for (int shell = kShells - 1; shell >= 0; --shell) {
    const double outer_m = range_m_ / std::int32_t{1 << shell};
    for (int i = 0; i < CubeFace::kCount; ++i) {
      const int face = static_cast<int>((turn_ + static_cast<unsigned>(i)) % CubeFace::kCount);
      if (carve_face(face, {inner_m, outer_m}, free_space, work, to_write, most_steps)) continue;
      ++turn_;
      return false;
    }
    inner_m = outer_m;
  }
  return true;
}

bool ImageCarver::carve_face(int face, const Shell& shell, FreeSpace& free_space, ScanWork& work,
                             std::uint64_t to_write, std::uint64_t most_steps) noexcept {
  if (!image_.rows(face).any()) return true;
  const double block_m = kBlockEdge * resolution_m_;
  int level = 0;
  while (block_m * (1 << level) < shell.outer_m && level < kMostLevels) ++level;
  const double node_m = block_m * (1 << level);
  const auto node_of = [&](const Point3d& p) {
    return BlockCoord{floor_to_int(p.x() / node_m), floor_to_int(p.y() / node_m),
                      floor_to_int(p.z() / node_m)};
  };
  const Point3d reach_m = Point3d(1.0, 1.0, 1.0) * shell.outer_m;
  const BlockCoord low = node_of(origin_map_ - reach_m);
  const BlockCoord high = node_of(origin_map_ + reach_m);
  const auto part = [&](std::int32_t from, std::int32_t to, std::int32_t i, unsigned bit) {
    return (turn_ >> bit & 1U) != 0 ? to - i : from + i;
  };
  for (std::int32_t k = 0; k <= high.z - low.z; ++k) {
    for (std::int32_t j = 0; j <= high.y - low.y; ++j) {
      for (std::int32_t i = 0; i <= high.x - low.x; ++i) {
        const Node root{
            {part(low.x, high.x, i, 0), part(low.y, high.y, j, 1), part(low.z, high.z, k, 2)},
            level};
        if (!carve_node(face, root, shell, free_space, work, to_write, most_steps)) return false;
      }
    }
  }
  return true;
}

bool ImageCarver::meets_grid(const Node& node) noexcept {
  const auto meets = [&node](std::int32_t at) {
    const std::int64_t low = std::int64_t{at} * (std::int64_t{1} << node.level);
    return low < kBlockLimit && low + (std::int64_t{1} << node.level) > -kBlockLimit;
  };
  return meets(node.at.x) && meets(node.at.y) && meets(node.at.z);
}

bool ImageCarver::carve_node(int face, const Node& root, const Shell& shell, FreeSpace& free_space,
                             ScanWork& work, std::uint64_t to_write,
                             std::uint64_t most_steps) noexcept {
  std::array<Node, kMostTreeNodes> nodes;
  std::size_t count = 0;
  nodes[count++] = root;
  while (count > 0) {
    const Node node = nodes[--count];
    if (steps_ >= most_steps) return false;
    if (++steps_ - asked_ >= kStepBatch) {
      asked_ = steps_;
      if (!work.in_time(to_write + work.to_write(free_space.blocks().size()))) return false;
    }
    if (!meets_grid(node) || !may_be_free(face, box_of(node), shell)) continue;
    if (node.level > 0) {
      for (unsigned i = 0; i < 8; ++i) {
        const unsigned child = i ^ (turn_ & 7U);
        nodes[count++] = {{2 * node.at.x + static_cast<std::int32_t>(child & 1U),
                           2 * node.at.y + static_cast<std::int32_t>(child >> 1U & 1U),
                           2 * node.at.z + static_cast<std::int32_t>(child >> 2U)},
                          node.level - 1};
      }
      continue;
    }
    if (steps_ + kBlockSteps > most_steps) return false;
    steps_ += kBlockSteps;
    if (!carve_block(face, node.at, free_space)) return false;
  }
  return true;
}

ImageCarver::Box ImageCarver::box_of(const Node& node) const noexcept {
  const double edge_m = kBlockEdge * resolution_m_ * (1 << node.level);
  const Point3d low = Point3d(node.at.x, node.at.y, node.at.z) * edge_m - origin_map_;
  return {low, low + Point3d(edge_m, edge_m, edge_m)};
}

/// Centres of voxels are half a voxel within the box. What is asked first costs least.
bool ImageCarver::may_be_free(int face, const Box& box, const Shell& shell) const noexcept {
  const CubeFace cube = CubeFace::of(face);
  const double half_m = 0.5 * resolution_m_;
  const double near_m = (cube.negative ? -box.high[cube.axis] : box.low[cube.axis]) + half_m;
  const double far_m = (cube.negative ? -box.low[cube.axis] : box.high[cube.axis]) - half_m;
  if (far_m <= 0.0) return false;
  const std::array<int, 2> across = axes_across(cube.axis);
  for (const int axis : across) {
    if (box.low[axis] + half_m > far_m || box.high[axis] - half_m < -far_m) return false;
  }
  // A block is of the shell that its nearest voxel is in.
  double square_m2 = 0.0;
  double farthest_m2 = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double outside = std::max(std::max(box.low[axis], -box.high[axis]) + half_m, 0.0);
    const double farthest = std::max(-box.low[axis], box.high[axis]);
    square_m2 += outside * outside;
    farthest_m2 += farthest * farthest;
  }
  if (square_m2 >= shell.outer_m * shell.outer_m) return false;
  const bool is_block = box.high.x() - box.low.x() < 1.5 * kBlockEdge * resolution_m_;
  if ((is_block ? square_m2 : farthest_m2) < shell.inner_m * shell.inner_m) return false;
  const double nearest_m = std::max(near_m, kNearest_voxels * resolution_m_);
  std::array<std::array<int, 2>, 2> pixels{};
  for (std::size_t k = 0; k < 2; ++k) {
    const Tangents tangents =
        tangents_of(box.low[across[k]] + half_m, box.high[across[k]] - half_m, nearest_m, far_m);
    // A pixel more: centres are computed as floats.
    pixels[k] = {static_cast<int>(CarveImage::pixel(std::max(tangents.low, -1.0))) - 1,
                 static_cast<int>(CarveImage::pixel(std::min(tangents.high, 1.0))) + 1};
  }
  const std::int32_t least = image_.threshold(nearest_m + margin_m_);
  const int widest = CarveImage::level_of(nearest_m / resolution_m_);
  for (int level = CarveImage::level_of(far_m / resolution_m_); level <= widest; ++level) {
    if (image_.may_reach(face, level, least, pixels[0], pixels[1])) return true;
  }
  return false;
}

template <class Choose>
void ImageCarver::choose_slabs(int face, const Box& box, Choose&& choose,
                               CarveSlab* slabs) const noexcept {
  const CubeFace cube = CubeFace::of(face);
  const double first_m = box.low[cube.axis] + 0.5 * resolution_m_;
  for (int i = 0; i < kBlockEdge; ++i) {
    const double depth_m = cube.depth(first_m + i * resolution_m_);
    if (!(depth_m > kNearest_voxels * resolution_m_)) continue;
    slabs[i] = choose(depth_m);
    slabs[i].inverse_depth = static_cast<float>(1.0 / depth_m);
  }
}

void ImageCarver::compare(int face, const Box& box, CarveSlabs& slabs,
                          std::array<std::uint64_t, kBlockEdge>& words) const noexcept {
  const int axis = CubeFace::of(face).axis;
  const std::array<int, 2> across = axes_across(axis);
  const Point3d first_m = box.low + Point3d(0.5, 0.5, 0.5) * resolution_m_;
  for (int i = 0; i < kBlockEdge; ++i) {
    slabs.at_column[i] = static_cast<float>(first_m[across[0]] + i * resolution_m_);
    slabs.at_row[i] = static_cast<float>(first_m[across[1]] + i * resolution_m_);
  }
  slabs.first_row = image_.rows(face).first;
  slabs.last_row = image_.rows(face).last;
  slabs.slope = CarveImage::kSlope;
  slabs.bend = CarveImage::kBend;
  slabs.middle = CarveImage::kMiddle;
  slabs.words = words.data();
  compare_(slabs);
  if (squared_norm(box.low.cwiseAbs().cwiseMax(box.high.cwiseAbs())) > range_m_ * range_m_)
    keep_in_range(first_m, axis, words);
}

const ImageCarver::KeptSlabs& ImageCarver::slabs_of(int face, std::int32_t at,
                                                    const Box& box) noexcept {
  KeptSlabs& kept = kept_[static_cast<std::uint32_t>(at) % kKept];
  if (kept.face == face && kept.at == at) return kept;
  kept = {.at = at, .face = face};
  const auto choose = [&](double depth_m) {
    const int level = CarveImage::level_of(depth_m / resolution_m_);
    return CarveSlab{.values = image_.level(face, level),
                     .shift = CarveLayout::shift_of(level),
                     .edge = CarveLayout::edge_of(level),
                     .least = static_cast<std::int16_t>(image_.threshold(depth_m + margin_m_) - 1)};
  };
  choose_slabs(face, box, choose, kept.slabs.data());
  return kept;
}

bool ImageCarver::carve_block(int face, BlockCoord block, FreeSpace& free_space) noexcept {
  std::array<std::uint64_t, kBlockEdge> words{};
  const Box box = box_of({block, 0});
  const std::array<std::int32_t, 3> at{block.x, block.y, block.z};
  CarveSlabs slabs;
  const auto axis_at = static_cast<std::size_t>(CubeFace::of(face).axis);
  const KeptSlabs& kept = slabs_of(face, at[axis_at], box);
  slabs.slab = kept.slabs.data();
  free_space.prefetch(block);
  compare(face, box, slabs, words);
  std::uint64_t any = 0;
  for (const std::uint64_t word : words) any |= word;
  if (any == 0) return true;
  const int axis = CubeFace::of(face).axis;
  std::uint64_t* const passed = free_space.words_of(block, axis);
  if (passed == nullptr) return false;
  for (std::size_t slab = 0; slab < kBlockEdge; ++slab) passed[slab] |= words[slab];
  return true;
}

VoxelMask ImageCarver::seen_through(BlockCoord block, SeenBy by,
                                    float margin_voxels) const noexcept {
  const Box box = box_of({block, 0});
  const double margin_m = static_cast<double>(margin_voxels) * resolution_m_;
  RayBlock seen;
  for (int face = 0; face < CubeFace::kCount; ++face) {
    const CubeFace cube = CubeFace::of(face);
    const double far_m = cube.negative ? -box.low[cube.axis] : box.high[cube.axis];
    const std::array<int, 2> across = axes_across(cube.axis);
    const auto beside = [&](int axis) { return box.low[axis] > far_m || box.high[axis] < -far_m; };
    if (far_m <= 0.0 || !image_.rows(face).any() || beside(across[0]) || beside(across[1]))
      continue;
    std::array<std::uint64_t, kBlockEdge> words{};
    const auto choose = [&](double depth_m) {
      return CarveSlab{
          .values = image_.seen(face, by),
          .edge = CarveImage::kEdge,
          .least = static_cast<std::int16_t>(image_.threshold(depth_m + margin_m) - 1)};
    };
    std::array<CarveSlab, kBlockEdge> chosen;
    choose_slabs(face, box, choose, chosen.data());
    CarveSlabs slabs;
    slabs.slab = chosen.data();
    compare(face, box, slabs, words);
    seen.turn(cube.axis);
    for (std::size_t slab = 0; slab < kBlockEdge; ++slab) seen.passed[slab] |= words[slab];
  }
  seen.turn(2);
  return seen.passed;
}

}  // namespace tessera
