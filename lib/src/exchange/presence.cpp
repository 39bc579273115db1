// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/presence.hpp"

#include <algorithm>
#include <cmath>

#include "tessera/base/internal/quaternion.hpp"

namespace tessera {

namespace {

constexpr double kPositionSteps = 1024.0;  // To 1 m.
constexpr std::int32_t kQuaternionSteps = 1 << 14;
constexpr double kUnit_m = 0.01;
constexpr int kMostUnits = 127;
constexpr unsigned kWidestUnit = 3;  ///< 2^3 times kUnit_m.
constexpr std::uint32_t kAgeStep_ms = 4;
constexpr std::uint16_t kPart = 0x7fff;
constexpr std::uint16_t kFlag = 0x8000;

double unit_of(unsigned width) noexcept { return kUnit_m * static_cast<double>(1U << width); }

/// A corner in steps, outwards.
int steps_of(float corner_m, double unit_m, bool up) noexcept {
  const double steps = static_cast<double>(corner_m) / unit_m;
  return static_cast<int>(up ? std::ceil(steps) : std::floor(steps));
}

bool fits(const BodyBox& box, unsigned width) noexcept {
  for (std::size_t i = 0; i < 3; ++i) {
    if (steps_of(box.low[i], unit_of(width), false) < -kMostUnits ||
        steps_of(box.high[i], unit_of(width), true) > kMostUnits)
      return false;
  }
  return true;
}

/// Which part is left out is in the highest bits of the first two.
void write_rotation(ByteWriter& to, const Matrix34d& T) noexcept {
  const Quaternion q = rotation_of(T);
  const ThreeParts parts = without_part(q, largest_of(q), kQuaternionSteps);
  for (unsigned i = 0; i < 3; ++i) {
    const auto low = static_cast<std::uint16_t>(static_cast<unsigned>(parts.steps[i]) & kPart);
    to.u16(static_cast<std::uint16_t>(low | ((parts.largest >> i & 1U) != 0 ? kFlag : 0U)));
  }
}

bool read_rotation(ByteReader& from, Quaternion& q) noexcept {
  ThreeParts parts;
  unsigned largest = 0;
  for (unsigned i = 0; i < 3; ++i) {
    const unsigned word = from.u16();
    largest |= (word >> 15U) << i;
    const unsigned part = word & kPart;
    parts.steps[i] = static_cast<int>(part) - ((part & 0x4000U) != 0 ? 0x8000 : 0);
  }
  parts.largest = static_cast<std::uint8_t>(largest);
  return with_largest(parts, kQuaternionSteps, q);
}

}  // namespace

bool Presence::is_plausible(const BodyBox& box) noexcept {
  for (std::size_t i = 0; i < 3; ++i) {
    const double edge_m = static_cast<double>(box.high[i]) - static_cast<double>(box.low[i]);
    if (!(edge_m > 0.0 && edge_m <= kMostEdge_m)) return false;
  }
  return true;
}

bool Presence::is_sendable(const BodyBox& box) noexcept {
  const auto is_near = [](float corner) {
    return std::abs(static_cast<double>(corner)) <= kFarthest_m;
  };
  return is_plausible(box) && std::all_of(box.low.begin(), box.low.end(), is_near) &&
         std::all_of(box.high.begin(), box.high.end(), is_near) && fits(box, kWidestUnit);
}

bool write_presence(ByteWriter& to, const Presence& presence) noexcept {
  const Matrix34d& T = presence.T_global_body;
  if (to.room() < Presence::kBytes || check_rigid(T) != Status::kOk ||
      !Presence::is_sendable(presence.box) || presence.stamp_ms < 0 ||
      presence.stamp_ms > Presence::kMostStamp_ms)
    return false;
  for (int row = 0; row < 3; ++row) {
    if (!(std::abs(T(row, 3)) <= Presence::kMostMetres)) return false;
  }
  unsigned width = 0;
  while (!fits(presence.box, width)) ++width;
  const unsigned speed = std::min(presence.speed_m_per_s, Presence::kMostSpeed_mps);
  to.u8(static_cast<std::uint8_t>(width | speed << 2U));
  to.u8(static_cast<std::uint8_t>(std::min(presence.age_ms, Presence::kMostAge_ms) / kAgeStep_ms));
  const auto stamp = static_cast<std::uint64_t>(presence.stamp_ms);
  to.u32(static_cast<std::uint32_t>(stamp & 0xffffffffU));
  to.u16(static_cast<std::uint16_t>(stamp >> 32U));
  for (int row = 0; row < 3; ++row) to.i32(nearest_step(T(row, 3) * kPositionSteps));
  write_rotation(to, T);
  for (const bool up : {false, true}) {
    for (const float corner : up ? presence.box.high : presence.box.low)
      to.u8(static_cast<std::uint8_t>(steps_of(corner, unit_of(width), up) & 0xff));
  }
  return true;
}

bool read_presence(ByteReader& from, Presence& presence) noexcept {
  const unsigned flags = from.u8();
  presence.speed_m_per_s = static_cast<std::uint8_t>(flags >> 2U);
  presence.age_ms = from.u8() * kAgeStep_ms;
  const std::uint64_t low_stamp = from.u32();
  presence.stamp_ms = static_cast<std::int64_t>(low_stamp | std::uint64_t{from.u16()} << 32U);
  Point3d translation;
  for (Eigen::Index i = 0; i < 3; ++i)
    translation[i] = static_cast<double>(from.i32()) / kPositionSteps;
  Quaternion q{};
  const bool is_rotation = read_rotation(from, q);
  for (std::array<float, 3>* const side : {&presence.box.low, &presence.box.high}) {
    for (float& corner : *side) {
      const int byte = from.u8();
      const int steps = byte < 128 ? byte : byte - 256;
      corner = static_cast<float>(steps * unit_of(flags & kWidestUnit));
    }
  }
  if (!from.ok() || !is_rotation) return false;
  presence.T_global_body = transform_of(q, translation);
  return true;
}

}  // namespace tessera
