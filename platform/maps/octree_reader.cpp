// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/octree_reader.hpp"

#include <fmt/core.h>

#include <array>
#include <bit>
#include <cmath>
#include <span>
#include <utility>

#include "base/input_file.hpp"

namespace tessera {
namespace {

/// Two bits per child: 0 none, 1 a free leaf.
constexpr std::uint32_t kOccupied = 2;
constexpr std::uint32_t kInner = 3;
constexpr const char* kTooEarly = "its tree ends too early";
constexpr const char* kTooDeep = "its tree is deeper than 16 levels";

std::uint32_t byte_at(std::string_view bytes, std::size_t place) noexcept {
  return static_cast<std::uint8_t>(bytes[place]);
}

/// Corner of the child: bit 0 of its number is x, 1 y, 2 z. level: of the child.
VoxelCoord child_corner(const VoxelCoord& corner, int child, int level) noexcept {
  const std::int32_t edge = std::int32_t{1} << level;
  return {corner.x + ((child & 1) != 0 ? edge : 0), corner.y + ((child & 2) != 0 ? edge : 0),
          corner.z + ((child & 4) != 0 ? edge : 0)};
}

}  // namespace

Octree::Walk::Walk(const OctreeHeader& header, std::string_view bytes) noexcept
    : header_(header), bytes_(bytes), place_(header.header_bytes) {}

bool Octree::Walk::refuse(const char* fault) noexcept {
  fault_ = fault;
  return false;
}

bool Octree::Walk::give(const VoxelCoord& corner, int level, bool occupied) noexcept {
  leaf_ = {corner, level, occupied};
  has_leaf_ = true;
  return true;
}

bool Octree::Walk::push(const VoxelCoord& corner, std::uint32_t children) noexcept {
  if (depth_ + 1 == kOctreeLevels) return refuse(kTooDeep);
  frames_[++depth_] = {corner, children, 0};
  return true;
}

/// A .bt file has only inner nodes; leaves are in the bits of their parents.
bool Octree::Walk::open_binary(const VoxelCoord& corner, int level) noexcept {
  if (bytes_.size() - place_ < 2) return refuse(kTooEarly);
  const std::uint32_t children = byte_at(bytes_, place_) | byte_at(bytes_, place_ + 1) << 8U;
  place_ += 2;
  if (children == 0 && level != kOctreeLevels)
    return refuse("its tree has an inner node without children");
  return push(corner, children);
}

bool Octree::Walk::open_full(const VoxelCoord& corner, int level) noexcept {
  if (bytes_.size() - place_ < header_.node_bytes + 1) return refuse(kTooEarly);
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < 4; ++i)
    bits |= byte_at(bytes_, place_ + i) << (8U * static_cast<unsigned>(i));
  const auto log_odds = std::bit_cast<float>(bits);
  const std::uint32_t present = byte_at(bytes_, place_ + header_.node_bytes);
  place_ += header_.node_bytes + 1;
  if (std::isnan(log_odds)) return refuse("its tree has log-odds that are not a number");
  if (present == 0) return give(corner, level, log_odds >= 0.0F);
  std::uint32_t children = 0;
  for (unsigned child = 0; child < 8; ++child)
    if (((present >> child) & 1U) != 0) children |= kInner << (2 * child);
  return push(corner, children);
}

bool Octree::Walk::open_node(const VoxelCoord& corner, int level) noexcept {
  ++nodes_;
  return header_.is_binary ? open_binary(corner, level) : open_full(corner, level);
}

bool Octree::Walk::next() noexcept {
  has_leaf_ = false;
  if (!begun_) {
    begun_ = true;
    constexpr std::int32_t kLow = -(std::int32_t{1} << (kOctreeLevels - 1));
    if (header_.nodes == 0) return false;
    if (!open_node({kLow, kLow, kLow}, kOctreeLevels)) return false;
  }
  while (!has_leaf_ && depth_ >= 0) {
    Frame& frame = frames_[depth_];
    if (frame.next_child == 8) {
      --depth_;
      continue;
    }
    const int child = frame.next_child++;
    const std::uint32_t kind = (frame.children >> (2U * static_cast<unsigned>(child))) & 3U;
    if (kind == 0) continue;
    const int level = kOctreeLevels - 1 - depth_;
    const VoxelCoord corner = child_corner(frame.corner, child, level);
    if (kind == kInner) {
      if (!open_node(corner, level)) return false;
    } else {
      ++nodes_;
      give(corner, level, kind == kOccupied);
    }
  }
  return has_leaf_;
}

Outcome<Octree> Octree::parse(std::string_view path, std::string bytes) {
  TESSERA_TRY_ASSIGN(const OctreeHeader header, parse_octree_header({path, bytes}));
  Octree octree(header, std::move(bytes));
  Walk walk(octree.header_, octree.bytes_);
  while (walk.next()) {
    const OctreeLeaf& leaf = walk.leaf();
    const std::uint64_t voxels = std::uint64_t{1} << (3U * static_cast<unsigned>(leaf.level));
    (leaf.occupied ? octree.occupied_ : octree.free_) += voxels;
  }
  if (walk.fault() != nullptr)
    return octree_failure(path, walk.fault(), "get a complete, intact copy");
  if (walk.nodes() != header.nodes) {
    return octree_failure(
        path, fmt::format("its header says {} nodes, but it has {}", header.nodes, walk.nodes()),
        "get an intact copy");
  }
  if (!walk.at_end())
    return octree_failure(path, "it has bytes after its tree", "get an intact copy");
  return octree;
}

Outcome<Octree> Octree::read(const std::string& path) {
  TESSERA_TRY_ASSIGN(InputFile file, InputFile::open(path));
  if (file.size_bytes() > kMostOctreeFileBytes)
    return octree_failure(path, "it is larger than 1 GiB", "give a smaller or pruned tree");
  std::string bytes(static_cast<std::size_t>(file.size_bytes()), '\0');
  TESSERA_TRY(file.read_exactly(std::as_writable_bytes(std::span(bytes))));
  return parse(path, std::move(bytes));
}

}  // namespace tessera
