// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/frames/frame_link.hpp"

#include "six_by_six.hpp"
#include "tessera/base/internal/byte_io.hpp"
#include "tessera/base/internal/quaternion.hpp"
#include "tessera/base/internal/rigid_code_io.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {

namespace {

// All steps are powers of two, so that L L^T of a decoded L is exact, and the L that is found from
// it is the same again.
constexpr double kAboutSteps = 16.0;
constexpr double kShiftSteps = 16'384.0;    // 2^14 a metre
constexpr double kTurnSteps = 1'048'576.0;  // 2^20 a radian
constexpr double kMostSteps = 8'388'607.0;  // of 24 bits with a sign
constexpr std::uint8_t kWithdrawnFlag = 1;

constexpr double steps_of_row(std::size_t row) noexcept {
  return row < 3 ? kShiftSteps : kTurnSteps;
}

void write_i24(ByteWriter& to, std::int32_t value) noexcept {
  const auto bits = static_cast<std::uint32_t>(value);
  to.u16(static_cast<std::uint16_t>(bits & 0xffffU));
  to.u8(static_cast<std::uint8_t>(bits >> 16U & 0xffU));
}

std::int32_t read_i24(ByteReader& from) noexcept {
  const std::uint32_t low = from.u16();
  const std::uint32_t high = from.u8();
  return static_cast<std::int32_t>(high << 24U | low << 8U) >> 8;
}

/// To the nearest step, halves away from 0. False: it does not fit into 24 bits.
bool to_steps(double value, std::int32_t& steps) noexcept {
  const double nearest = value < 0.0 ? value - 0.5 : value + 0.5;
  if (!(nearest > -kMostSteps && nearest < kMostSteps + 1.0)) return false;
  steps = static_cast<std::int32_t>(nearest);
  return true;
}

bool write_covariance(ByteWriter& to, const FrameCovariance& covariance) noexcept {
  SixBySix L{};
  if (!factor_six(covariance.values, L)) return false;
  for (int axis = 0; axis < 3; ++axis) {
    std::int32_t steps = 0;
    if (!to_steps(covariance.about_a(axis) * kAboutSteps, steps)) return false;
    write_i24(to, steps);
  }
  for (std::size_t row = 0; row < FrameCovariance::kSize; ++row) {
    for (std::size_t column = 0; column <= row; ++column) {
      std::int32_t steps = 0;
      const double part = L[FrameCovariance::index(row, column)] * steps_of_row(row);
      if (!to_steps(part, steps)) return false;
      if (row == column && steps < 1) steps = 1;
      write_i24(to, steps);
    }
  }
  return true;
}

/// False: not positive definite, or of a number that is never written.
bool read_covariance(ByteReader& from, FrameCovariance& covariance) noexcept {
  constexpr auto at = FrameCovariance::index;
  constexpr auto kMost = static_cast<std::int32_t>(kMostSteps);
  for (int axis = 0; axis < 3; ++axis) {
    const std::int32_t steps = read_i24(from);
    if (steps < -kMost) return false;
    covariance.about_a(axis) = static_cast<double>(steps) / kAboutSteps;
  }
  SixBySix L{};
  for (std::size_t row = 0; row < FrameCovariance::kSize; ++row) {
    for (std::size_t column = 0; column <= row; ++column) {
      const std::int32_t steps = read_i24(from);
      if (steps < -kMost || (row == column && steps < 1)) return false;
      L[at(row, column)] = static_cast<double>(steps) / steps_of_row(row);
    }
  }
  for (std::size_t row = 0; row < FrameCovariance::kSize; ++row) {
    for (std::size_t column = 0; column <= row; ++column) {
      double sum = 0.0;
      for (std::size_t k = 0; k <= column; ++k) sum += L[at(row, k)] * L[at(column, k)];
      covariance.values[at(row, column)] = sum;
    }
  }
  return true;
}

}  // namespace

FrameCovariance FrameCovariance::isotropic(const Point3d& about_a, double sigma_m,
                                           double sigma_rad) noexcept {
  FrameCovariance covariance;
  covariance.about_a = about_a;
  for (std::size_t i = 0; i < 3; ++i) {
    covariance.values[index(i, i)] = sigma_m * sigma_m;
    covariance.values[index(i + 3, i + 3)] = sigma_rad * sigma_rad;
  }
  return covariance;
}

double FrameCovariance::sigma_m() const noexcept {
  return std::sqrt(values[index(0, 0)] + values[index(1, 1)] + values[index(2, 2)]);
}

double FrameCovariance::sigma_rad() const noexcept {
  return std::sqrt(values[index(3, 3)] + values[index(4, 4)] + values[index(5, 5)]);
}

Six motion_at(const Matrix34d& E, const Point3d& x) noexcept {
  const Point3d moved = apply(E, x);
  const Quaternion q = rotation_of(E);
  const double twice = q[0] < 0.0 ? -2.0 : 2.0;
  return {moved.x() - x.x(), moved.y() - x.y(), moved.z() - x.z(),
          twice * q[1],      twice * q[2],      twice * q[3]};
}

Status encode_link(const FrameLink& link, std::span<std::byte, FrameLink::kBytes> bytes) noexcept {
  if (link.from == link.to || link.revision == 0) return Status::kInvalidArgument;
  const Result<RigidCode> code = encode_rigid(link.T_from_to);
  if (!code.ok()) return code.status();
  std::array<std::byte, FrameLink::kBytes> made{};
  ByteWriter to(made);
  for (const std::uint32_t word : {link.from, link.to, link.from_epoch, link.to_epoch,
                                   link.from_version, link.to_version, link.revision})
    to.u32(word);
  to.u8(link.withdrawn ? kWithdrawnFlag : std::uint8_t{0});
  write_rigid_code(to, *code);
  if (!write_covariance(to, link.covariance)) return Status::kInvalidArgument;
  TESSERA_ASSERT(to.ok() && to.room() == 0);
  for (std::size_t i = 0; i < FrameLink::kBytes; ++i) bytes[i] = made[i];
  return Status::kOk;
}

Result<FrameLink> decode_link(std::span<const std::byte> bytes) noexcept {
  if (bytes.size() < FrameLink::kBytes) return Status::kTruncated;
  if (bytes.size() > FrameLink::kBytes) return Status::kCorrupt;
  ByteReader from(bytes);
  FrameLink link;
  for (std::uint32_t* const word : {&link.from, &link.to, &link.from_epoch, &link.to_epoch,
                                    &link.from_version, &link.to_version, &link.revision})
    *word = from.u32();
  const std::uint8_t flags = from.u8();
  const Result<Matrix34d> T_from_to = decode_rigid(read_rigid_code(from));
  if (!T_from_to.ok() || !read_covariance(from, link.covariance)) return Status::kCorrupt;
  if (link.from == link.to || link.revision == 0 || flags > kWithdrawnFlag) return Status::kCorrupt;
  link.withdrawn = flags == kWithdrawnFlag;
  link.T_from_to = *T_from_to;
  // One link has one code, so that whoever compares or signs bytes compares and signs links.
  std::array<std::byte, FrameLink::kBytes> again{};
  if (encode_link(link, again) != Status::kOk) return Status::kCorrupt;
  for (std::size_t i = 0; i < again.size(); ++i) {
    if (again[i] != bytes[i]) return Status::kCorrupt;
  }
  return link;
}

Result<FrameLink> round_link(const FrameLink& link) noexcept {
  std::array<std::byte, FrameLink::kBytes> bytes{};
  const Status status = encode_link(link, bytes);
  if (status != Status::kOk) return status;
  return decode_link(bytes);
}

}  // namespace tessera
