// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/frames/frame_link.hpp"

#include "covariance_code.hpp"
#include "six_by_six.hpp"
#include "tessera/base/internal/byte_io.hpp"
#include "tessera/base/internal/quaternion.hpp"
#include "tessera/base/internal/rigid_code_io.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {

namespace {

constexpr std::uint8_t kWithdrawnFlag = 1;

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

LinkMotion motion_between(const FrameLink& before, const FrameLink& after) noexcept {
  const Point3d p_to = apply(inverse(after.T_from_to), after.covariance.about_a);
  const Point3d there = apply(before.T_from_to, p_to);
  const Matrix34d turn = product(inverse(before.T_from_to), after.T_from_to);
  double squares = 0.0;  // |R - I|^2 is 8 sin^2(a / 2)
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      const double off = turn(row, column) - (row == column ? 1.0 : 0.0);
      squares += off * off;
    }
  }
  return {norm(Point3d(after.covariance.about_a - there)), std::sqrt(squares / 2.0)};
}

Result<FrameLink> round_link(const FrameLink& link) noexcept {
  std::array<std::byte, FrameLink::kBytes> bytes{};
  const Status status = encode_link(link, bytes);
  if (status != Status::kOk) return status;
  return decode_link(bytes);
}

}  // namespace tessera
