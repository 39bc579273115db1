// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Queries of other processes and their replies: lcmtypes/tessera_query.lcm and tessera_reply.lcm,
// without the types of LCM. docs/reference/queries.md has the protocol.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "tessera/base/geometry.hpp"
#include "tessera/grid/lattice.hpp"
#include "tessera/semantics/estimate.hpp"

namespace tessera {

inline constexpr const char* kQueryChannel = "TESSERA_QUERY";
inline constexpr const char* kReplyChannel = "TESSERA_REPLY";
inline constexpr std::int32_t kQueryVersion = 1;

enum class QueryKind : std::uint8_t { kPoints = 0, kRegion = 1, kRay = 2, kNearest = 3 };
enum class QueryMap : std::uint8_t { kLocal = 0, kGlobal = 1 };

/// A query as received: every number may be anything.
struct MapQuery {
  static constexpr std::size_t kMostPoints = 32;

  std::int32_t version = kQueryVersion;
  std::int32_t request = 0;
  std::int64_t client = 0;
  std::int32_t kind = 0;
  std::int32_t map = 0;
  bool stop_at_unknown = false;
  std::int32_t count = 0;
  std::int32_t cell_voxels = 1;
  std::int32_t cursor = 0;
  std::uint64_t class_mask = 0;
  double length_m = 0.0;
  // Eigen does not initialise them by default.
  std::array<Point3f, kMostPoints> points = [] {
    std::array<Point3f, kMostPoints> zeros;
    zeros.fill(Point3f::Zero());
    return zeros;
  }();
};

enum class QueryError : std::uint8_t {
  kNone = 0,
  kBadVersion = 1,
  kBadKind = 2,
  kNoMap = 3,        ///< This node does not have the map.
  kBadArgument = 4,  ///< A number is out of its range or not finite.
  kOutOfGrid = 5,    ///< A point, or the end of a ray or box, is outside the map's grid.
  kTooOften = 6,     ///< Over the node's limit of requests per second.
  kBusy = 7,         ///< The map was changed during every try; ask again.
};

struct MapReply {
  static constexpr std::size_t kMostCells = 1024;

  std::int32_t request = 0;
  std::int64_t client = 0;
  std::int32_t kind = 0;
  std::int32_t map = 0;
  QueryError error = QueryError::kNone;
  bool incomplete = false;  ///< The work of one request was used up; see searched_m, next_cursor.
  bool found = false;
  bool at_unknown = false;
  std::uint64_t generation = 0;
  double resolution_m = 0.0;
  std::int32_t work = 0;
  std::int32_t count = 0;
  std::int32_t next_cursor = -1;
  std::array<std::int32_t, 3> size_cells{};
  VoxelCoord voxel{};
  float distance_m = 0.0F;
  float searched_m = 0.0F;
  std::array<float, MapQuery::kMostPoints> probability{};
  std::array<float, MapQuery::kMostPoints> variance{};
  std::array<std::uint8_t, kMostCells> cells{};
};

/// A cell of a reply: state in the upper two bits, label (0 .. 62, 0: none) below.
[[nodiscard]] constexpr std::uint8_t cell_of(VoxelState state, int label) noexcept {
  return static_cast<std::uint8_t>(static_cast<unsigned>(state) << 6U |
                                   (static_cast<unsigned>(label) & 63U));
}
[[nodiscard]] constexpr VoxelState state_of_cell(std::uint8_t cell) noexcept {
  return static_cast<VoxelState>(cell >> 6U);
}
[[nodiscard]] constexpr int label_of_cell(std::uint8_t cell) noexcept { return cell & 63; }

inline constexpr std::size_t kReplyBytes = 1380;

/// False iff the bytes are not a tessera_query of this version of the type.
[[nodiscard]] bool decode_query(std::span<const std::byte> message, MapQuery& query) noexcept;
/// Returns the bytes of a tessera_reply.
[[nodiscard]] std::array<std::byte, kReplyBytes> encode_reply(const MapReply& reply) noexcept;

}  // namespace tessera
