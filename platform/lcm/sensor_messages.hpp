// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Sensors' messages out of bytes from anybody into memory that is there. What LCM generates makes
// room for as many elements as the message claims before it looks whether they are there; here
// every count is checked against the message's length and the memory before anything is written.
// Numbers of the sensor itself (coordinates, weights, depths) are handed on as they are, finite or
// not: the core refuses and counts those.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "tessera/base/geometry.hpp"

namespace tessera {

/// Why a message was not taken.
enum class MessageFault : std::uint8_t {
  kNone,
  kTooShort,   ///< Ends before its arrays.
  kOtherType,  ///< Its fingerprint is of another type, or of another version of the type.
  kCounts,     ///< Negative, or they do not fit each other or the message's length.
  kTooLarge,   ///< More than there is memory for.
  kValue,      ///< A number that has no meaning: a size of 0, a time too far from the stamp, a pose
               ///< that is not finite, nor its deviations, or whose rotation has not the length 1
               ///< within 1e-3.
};

/// Where a cloud's numbers go. The spans' sizes are what there is room for: xyz for three floats a
/// point, the others for one each.
struct CloudMemory {
  std::span<float> xyz;
  std::span<std::uint8_t> components;
  std::span<float> weights;
  std::span<float> times_s;
};

struct CloudHeader {
  std::int64_t stamp_us = 0;
  std::int32_t sensor = 0;
  std::uint32_t count = 0;
  bool has_components = false;
  bool has_weights = false;
  bool has_times = false;
  std::int32_t first_us = 0;  ///< Of the points' times, from the stamp on; 0 without times.
  std::int32_t last_us = 0;
};

/// Farthest that a point's time may be from its stamp.
inline constexpr std::int32_t kMostSweep_us = 1'000'000;

/// Decodes a tessera_semantic_cloud or a tessera_cloud. On a fault into.header means nothing, and
/// memory is as it was but for kValue. O(bytes).
[[nodiscard]] MessageFault decode_semantic_cloud(std::span<const std::byte> message,
                                                 const CloudMemory& memory,
                                                 CloudHeader& header) noexcept;
[[nodiscard]] MessageFault decode_cloud(std::span<const std::byte> message,
                                        const CloudMemory& memory, CloudHeader& header) noexcept;

struct ImageHeader {
  std::int64_t stamp_us = 0;
  std::int32_t camera = 0;
  std::int32_t width_px = 0;
  std::int32_t height_px = 0;
};

/// Decodes a tessera_label_image: a byte a pixel. On a fault nothing is written. O(bytes).
[[nodiscard]] MessageFault decode_label_image(std::span<const std::byte> message,
                                              std::span<std::uint8_t> components,
                                              ImageHeader& header) noexcept;

/// Decodes a tessera_depth_image: metres a pixel, 0 where it said 0 millimetres. On a fault nothing
/// is written. O(bytes).
[[nodiscard]] MessageFault decode_depth_image(std::span<const std::byte> message,
                                              std::span<float> depth_m,
                                              ImageHeader& header) noexcept;

enum class PoseQuality : std::uint8_t { kInvalid = 0, kDegraded = 1, kGood = 2 };

struct PoseMessage {
  std::int64_t stamp_us = 0;
  std::int32_t sequence = 0;
  PoseQuality quality = PoseQuality::kInvalid;
  Matrix34d T_map_body = Matrix34d::Identity();  ///< Rigid.
  Point3d position_sigma_m = Point3d::Zero();    ///< Negative: not known.
  double rotation_sigma_rad = 0.0;               ///< Negative: not known.
};

/// Decodes a tessera_pose. A pose of quality kInvalid may have any numbers; T_map_body is the
/// identity then. O(1).
[[nodiscard]] MessageFault decode_pose(std::span<const std::byte> message,
                                       PoseMessage& pose) noexcept;

}  // namespace tessera
