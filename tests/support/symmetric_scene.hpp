// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Places that are made to deceive: worlds that look alike where they are turned or shifted, each
// seen by two maps whose true transform is known.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "support/solid_world.hpp"

namespace tessera {

enum class SymmetricScene : std::uint8_t {
  kSquareRoom,    ///< Four equal walls and one box in the middle.
  kTwinRooms,     ///< Two rooms with the same things in them; B is most of one of them.
  kMirroredHall,  ///< One half is the mirror image of the other; each map is more than a half.
  kCorridor,      ///< Equally spaced equal doors, and no ends.
  kPillars,       ///< A ring of equal pillars on a floor.
  kEqualHouses,   ///< A street with the same house on every lot.
  kTerraces,      ///< A wide staircase: the same again, one step farther and higher.
  kTwinEnds,      ///< Twin rooms; B is one end of the second, of which A has little.
  kTurnedEnds,    ///< A hall that is the same when turned by half; each map is one end of it.
};
/// Where the right place fits at least half as well as any other.
inline constexpr std::array<SymmetricScene, 7> kSymmetricScenes{
    SymmetricScene::kSquareRoom, SymmetricScene::kTwinRooms, SymmetricScene::kMirroredHall,
    SymmetricScene::kCorridor,   SymmetricScene::kPillars,   SymmetricScene::kEqualHouses,
    SymmetricScene::kTerraces};
/// Where B fits wholly on something else in A, and at the right place by its smaller part.
inline constexpr std::array<SymmetricScene, 2> kSymmetricEnds{SymmetricScene::kTwinEnds,
                                                              SymmetricScene::kTurnedEnds};
[[nodiscard]] const char* to_string(SymmetricScene scene) noexcept;

/// How much there is that is only once, in what both maps have seen.
enum class Landmarks : std::uint8_t {
  kNone,    ///< Nothing.
  kLittle,  ///< A box of 0.3 to 0.8 m.
  kClear    ///< Walls and blocks that nobody overlooks: a pair that is to be found.
};

struct SymmetricPair {
  std::unique_ptr<WorldMap> a;
  std::unique_ptr<WorldMap> b;
  Matrix34d T_a_b = Matrix34d(Matrix34d::Identity());
  /// Of kSymmetricEnds: the place where B fits wholly.
  Matrix34d T_a_b_alike = Matrix34d(Matrix34d::Identity());
};

/// Sizes, what each map sees, and the frame of B are those that the seed draws: any heading, a tilt
/// of up to 3 degrees, up to 4 m along x and y and 1 m along z. Voxels of 0.2 m, without classes
/// that may move. Takes some 0.1 s.
[[nodiscard]] SymmetricPair symmetric_pair(SymmetricScene scene, Landmarks landmarks,
                                           std::uint64_t seed, const ClassTable& classes);

}  // namespace tessera
