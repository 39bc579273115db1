// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Random scans with special floats for the property test of integration. Every pair of levels of
// two factors occurs in the rows of covering_rows(); the rest of a case is drawn from its seed.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "support/mapper.hpp"

namespace tessera::oracle {

/// What the special returns of a scan hold.
enum class Special : std::uint8_t {
  kNone,
  kPlusZero,
  kMinusZero,
  kLeastSubnormal,
  kMinusLeastSubnormal,
  kMostSubnormal,
  kLeastNormal,
  kLargest,  ///< FLT_MAX: "no return" of some drivers.
  kMinusLargest,
  kHuge,  ///< Finite, its square is not a finite float.
  kInfinity,
  kMinusInfinity,
  kNan,
  kMinusNan,
  kLastInGrid,       ///< The last float inside the grid's upper face.
  kFirstBeyondGrid,  ///< The grid's upper face: the first float outside.
  kFirstInGrid,      ///< The grid's lower face: inside.
  kLastBelowGrid,    ///< The last float under the lower face.
  kVoxelBorder,
  kOctetBorder,
  kBlockBorder,
  kUnderBlockBorder,  ///< The last float under a border of blocks.
  kAtMinRange,
  kAtMaxRange,
  kCount,
};
enum class Part : std::uint8_t { kX, kY, kZ, kAll, kWeight, kCount };
enum class Position : std::uint8_t { kFirst, kMiddle, kLast, kEvery, kCount };
enum class Scarce : std::uint8_t {
  kNothing,
  kPoints,
  kStorage,
  kTiles,
  kRayBlocks,
  kIndex,
  kWork,
  kTime,
  kCount,
};
enum class Place : std::uint8_t {
  kOrigin,
  kQuarterTurn,  ///< Exact: axes exchanged, an offset of few binary digits.
  kAnyTurn,
  kFar,  ///< Hundreds of kilometres from the origin.
  kUpperEdge,
  kLowerEdge,
  kCount,
};
enum class Size : std::uint8_t { kOne, kTwo, kFew, kMany, kCount };

/// A level of each factor: Special, Part, Position, InferenceMode, free space, Scarce, TuplePolicy,
/// resolution, Place, Size.
inline constexpr std::array<int, 10> kLevels{static_cast<int>(Special::kCount),
                                             static_cast<int>(Part::kCount),
                                             static_cast<int>(Position::kCount),
                                             4,
                                             2,
                                             static_cast<int>(Scarce::kCount),
                                             2,
                                             3,
                                             static_cast<int>(Place::kCount),
                                             static_cast<int>(Size::kCount)};
using Row = std::array<int, kLevels.size()>;

/// Rows in which each pair of levels of two factors occurs, drawn greedily from a fixed seed.
[[nodiscard]] std::vector<Row> covering_rows();

struct Return {
  std::array<float, 3> p_sensor{};
  std::uint8_t component = 1;
  float weight = 1.0F;
};

struct ScanCase {
  std::uint64_t seed = 0;
  Row row{};
  MapConfig map{};
  InferenceConfig inference{};
  ScanCapacity capacity{};
  Matrix34d T_map_sensor = Matrix34d::Identity();
  std::int64_t due_us = 0;      ///< On a clock that advances with each reading; 0: no deadline.
  double rate = 0.0;            ///< First rate of the deadline.
  bool fill_index = false;      ///< Empty blocks are opened until the map's index refuses one.
  std::vector<Return> before;   ///< A plain scan, without the deadline.
  std::vector<Return> returns;  ///< The scan under test.

  [[nodiscard]] Special special() const { return static_cast<Special>(row[0]); }
  [[nodiscard]] Scarce scarce() const { return static_cast<Scarce>(row[5]); }
  /// Voxels from the origin to a face of the grid that points must stay in.
  [[nodiscard]] double grid_limit() const;
};

inline constexpr int kCaseClasses = 3;

[[nodiscard]] ScanCase make_case(const Row& row, std::uint64_t seed);
/// All that makes a case, floats in hexadecimal.
[[nodiscard]] std::string text_of(const ScanCase& scan_case);
[[nodiscard]] Cloud cloud_of(const std::vector<Return>& returns);

}  // namespace tessera::oracle
