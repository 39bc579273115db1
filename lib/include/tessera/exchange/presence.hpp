// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where a robot says that it is, and how large: so that others do not take it for an obstacle. 32
// bytes of fixed-point numbers, none of which can be NaN (docs/reference/wire-format.md).
#pragma once

#include <cstdint>

#include "tessera/base/internal/byte_io.hpp"
#include "tessera/base/robot_body.hpp"

namespace tessera {

struct Presence {
  static constexpr std::size_t kBytes = 32;
  /// No side of a box is longer: what one robot can say of itself hides no more than that.
  static constexpr double kMostEdge_m = 16.0;
  /// Of a corner from the body's origin, on each axis.
  static constexpr double kFarthest_m = 10.16;
  static constexpr std::uint8_t kMostSpeed_mps = 63;
  static constexpr std::uint32_t kMostAge_ms = 1'020;
  /// Of a translation, on each axis.
  static constexpr double kMostMetres = 2'097'151.0;
  static constexpr std::int64_t kMostStamp_ms = (std::int64_t{1} << 48U) - 1;

  Matrix34d T_global_body = Matrix34d::Identity();
  BodyBox box{};              ///< In the body's frame.
  std::int64_t stamp_ms = 0;  ///< Of that place, on the sender's clock; not below 0.
  std::uint32_t age_ms = 0;   ///< From then to when it was sent.
  /// Of the fastest corner, rounded up; the highest: that or more. 0: the robot stands.
  std::uint8_t speed_m_per_s = 0;

  /// low < high, and no side is longer than kMostEdge_m.
  [[nodiscard]] static bool is_plausible(const BodyBox& box) noexcept;
  /// It is plausible, and no corner is farther than kFarthest_m: it can be sent.
  [[nodiscard]] static bool is_sendable(const BodyBox& box) noexcept;
};

/// Rounded: the place to 0.5 mm and 0.1 mrad, the box outwards to steps of 1 cm, or of 2, 4 or 8 cm
/// where a corner is over 1.27, 2.54 or 5.08 m from 0, the age and the stamp down. False, and
/// nothing is written: it does not fit, T_global_body is not rigid or beyond kMostMetres, the box
/// is not sendable, or the stamp is out of its range. O(1).
bool write_presence(ByteWriter& to, const Presence& presence) noexcept;
/// False iff the bytes are none: the box may still be one that is not plausible. O(1).
bool read_presence(ByteReader& from, Presence& presence) noexcept;

}  // namespace tessera
