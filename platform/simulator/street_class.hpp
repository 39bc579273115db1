// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The SemanticKITTI raw ids of the simulated street, and their surfaces for a laser.
#pragma once

#include <cstdint>

namespace tessera::street {

/// Raw ids as in label files. Moving ones occur only in the truth: a network on single scans cannot
/// detect motion.
enum class RawId : std::uint16_t {
  kUnlabelled = 0,
  kCar = 10,
  kBicycle = 11,
  kPerson = 30,
  kRoad = 40,
  kParking = 44,
  kSidewalk = 48,
  kBuilding = 50,
  kFence = 51,
  kVegetation = 70,
  kTrunk = 71,
  kTerrain = 72,
  kPole = 80,
  kTrafficSign = 81,
  kMovingCar = 252,
  kMovingPerson = 254,
};

/// A surface for a beam. fill < 1: a porous volume in which that share of small voxels is solid
/// (leaves). loss: share of echoes that are always lost, as from glass.
struct Surface {
  RawId id = RawId::kUnlabelled;
  double reflectivity = 0.3;
  double loss = 0.0;
  double fill = 1.0;
};

/// The usual surface of a class, solid.
constexpr Surface surface_of(RawId id) noexcept {
  switch (id) {
    case RawId::kCar:
    case RawId::kMovingCar:
      return {id, 0.25, 0.04, 1.0};
    case RawId::kBicycle:
      return {id, 0.20, 0.05, 1.0};
    case RawId::kPerson:
    case RawId::kMovingPerson:
      return {id, 0.36, 0.02, 1.0};
    case RawId::kRoad:
      return {id, 0.21, 0.02, 1.0};
    case RawId::kParking:
      return {id, 0.17, 0.02, 1.0};
    case RawId::kSidewalk:
      return {id, 0.30, 0.01, 1.0};
    case RawId::kBuilding:
      return {id, 0.26, 0.01, 1.0};
    case RawId::kFence:
      return {id, 0.22, 0.02, 1.0};
    case RawId::kVegetation:
      return {id, 0.31, 0.03, 1.0};
    case RawId::kTrunk:
      return {id, 0.34, 0.01, 1.0};
    case RawId::kTerrain:
      return {id, 0.34, 0.02, 1.0};
    case RawId::kPole:
      return {id, 0.24, 0.02, 1.0};
    case RawId::kTrafficSign:
      return {id, 0.75, 0.01, 1.0};
    case RawId::kUnlabelled:
      return {id, 0.25, 0.02, 1.0};
  }
  return {};
}

}  // namespace tessera::street
