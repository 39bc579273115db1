// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where the other robots are, for threads beside the one that hears them.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "tessera/map/obstacle_sectors.hpp"
#include "tessera/robot/sharer.hpp"
#include "vehicle/vehicle_report.hpp"

namespace tessera {

/// Bytes that may be copied.
struct TeammatesState {
  static constexpr std::size_t kMost = 16;
  /// A TeammatePlace, in the map's frame.
  struct One {
    std::uint32_t robot = 0;
    std::uint8_t speed_m_per_s = 0;
    std::array<double, 12> T_map_body{};  ///< Row by row.
    std::array<double, 3> velocity{};
    BodyBox box{};
    double margin_m = 0.0;
    std::int64_t time_us = 0;
    std::int64_t until_us = 0;
  };
  std::uint32_t count = 0;
  std::array<One, kMost> all{};

  /// Of those that a sharer hears, as far as they fit; in the frame of a submap.
  void take(const Sharer& sharer, std::uint32_t submap, std::int64_t now_us) noexcept;
  /// Their boxes at a time, without those that are not heard any more; returns how many.
  [[nodiscard]] std::size_t place(std::int64_t time_us,
                                  std::span<PlacedBox, kMost> into) const noexcept;
  /// The same as obstacles of sectors around a body (add_box): they are in no map.
  void add_to(SectorsReport& sectors, const Matrix34d& T_map_body,
              const ObstacleSectorsConfig& config, std::int64_t time_us) const noexcept;
};

}  // namespace tessera
