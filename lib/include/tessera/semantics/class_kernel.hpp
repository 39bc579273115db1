// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How far what points say of a class counts, by its shape: flat ground, upright walls, what is
// small. Two numbers a class; docs/design/theory.md, Four modes.
#pragma once

#include <array>
#include <string_view>

#include "tessera/semantics/internal/class_name.hpp"

namespace tessera {

/// What a cell's points said of a class counts 1 - d / length on each axis, d from the cell's
/// middle to the octet's.
struct ClassKernel {
  static constexpr float kLeast_m = 1e-3F;
  static constexpr float kMost_m = 1e3F;

  float reach_m = 0.8F;    ///< Length on x and y; taken as 1.5 to 11 voxels.
  float height_m = 0.24F;  ///< On z; beyond the next layers of two voxels nothing counts.

  /// Both from kLeast_m to kMost_m.
  [[nodiscard]] constexpr bool is_valid() const noexcept {
    return reach_m >= kLeast_m && reach_m <= kMost_m && height_m >= kLeast_m && height_m <= kMost_m;
  }
  friend constexpr bool operator==(const ClassKernel&, const ClassKernel&) = default;
};

/// The kernel of a class, by its name. Names of common data sets; others have ClassKernel's
/// defaults. As `tessera fit-kernels` found it (docs/measured/choices.md, Kernels by class).
/// O(names).
[[nodiscard]] constexpr ClassKernel kernel_by_name(std::string_view name) noexcept {
  struct Named {
    std::string_view name;
    ClassKernel kernel;
  };
  constexpr ClassKernel kVehicle{0.5F, 0.24F};
  constexpr ClassKernel kPerson{0.8F, 0.4F};
  constexpr ClassKernel kFlat{0.8F, 0.2F};
  constexpr ClassKernel kWall{1.1F, 2.0F};
  constexpr ClassKernel kFence{1.1F, 0.4F};
  constexpr ClassKernel kPole{0.25F, 2.0F};
  constexpr ClassKernel kSign{1.1F, 0.24F};
  constexpr std::array<Named, 31> kNamed{{
      {"bicycle", {1.1F, 0.4F}}, {"barrier", kFence},       {"bicyclist", kPerson},
      {"building", kWall},       {"bus", kVehicle},         {"car", kVehicle},
      {"fence", kFence},         {"guard-rail", kFence},    {"house", kWall},
      {"motorcycle", kVehicle},  {"motorcyclist", kPerson}, {"other-vehicle", kVehicle},
      {"parking", {1.1F, 0.2F}}, {"pedestrian", kPerson},   {"person", kPerson},
      {"pole", kPole},           {"post", kPole},           {"rider", kPerson},
      {"sidewalk", kFlat},       {"terrain", kFlat},        {"grass", kFlat},
      {"traffic-sign", kSign},   {"traffic-light", kSign},  {"trailer", kVehicle},
      {"tram", kVehicle},        {"truck", kVehicle},       {"trunk", {0.5F, 0.2F}},
      {"van", kVehicle},         {"vehicle", kVehicle},     {"wall", kWall},
      {"worker", kPerson},
  }};
  for (const Named& one : kNamed) {
    if (detail::is_name(name, one.name)) return one.kernel;
  }
  return {};
}

}  // namespace tessera
