// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <bit>
#include <optional>

#include "tessera/base/internal/rigid_code_io.hpp"
#include "tessera/exchange/internal/frames.hpp"
#include "tessera/exchange/internal/record_proof.hpp"
#include "wire_numbers.hpp"

namespace tessera {

using namespace wire;

namespace {

/// Flag of a datagram.
constexpr std::uint8_t kAreRelayed = 1;
/// Flags of a frame.
constexpr std::uint8_t kHasMatrix = 1;
constexpr std::uint8_t kHasNoBlocks = 2;

bool has_bits_of(const Matrix34d& a, const Matrix34d& b) noexcept {
  for (Eigen::Index i = 0; i < a.size(); ++i) {
    if (std::bit_cast<std::uint64_t>(a.data()[i]) != std::bit_cast<std::uint64_t>(b.data()[i]))
      return false;
  }
  return true;
}

/// The code that a transform is written as: one that stands for all of its bits.
std::optional<RigidCode> code_of(const Matrix34d& T) noexcept {
  const Result<RigidCode> code = encode_rigid(T);
  if (!code.ok()) return std::nullopt;
  const Result<Matrix34d> decoded = decode_rigid(*code);
  if (!decoded.ok() || !has_bits_of(*decoded, T)) return std::nullopt;
  return *code;
}

/// Modulo 2^32, so that any number follows any other.
void write_step(ByteWriter& to, std::uint32_t number, std::uint32_t before) noexcept {
  write_varint(to, zigzag(static_cast<std::int32_t>(number - before)));
}
bool read_step(ByteReader& from, std::uint32_t before, std::uint32_t& number) noexcept {
  std::uint32_t step = 0;
  if (!read_varint(from, step)) return false;
  number = before + static_cast<std::uint32_t>(unzigzag(step));
  return true;
}

void write_transform(ByteWriter& to, const Matrix34d& T,
                     const std::optional<RigidCode>& code) noexcept {
  if (code) {
    write_rigid_code(to, *code);
    return;
  }
  for (Eigen::Index row = 0; row < 3; ++row) {
    for (Eigen::Index column = 0; column < 4; ++column) to.f64(T(row, column));
  }
}

bool read_transform(ByteReader& from, bool has_matrix, Matrix34d& T) noexcept {
  if (has_matrix) {
    for (Eigen::Index row = 0; row < 3; ++row) {
      for (Eigen::Index column = 0; column < 4; ++column) T(row, column) = from.f64();
    }
    return from.ok() && !code_of(T);
  }
  const RigidCode code = read_rigid_code(from);
  const Result<Matrix34d> decoded = decode_rigid(code);
  if (!from.ok() || !decoded.ok()) return false;
  T = *decoded;
  return code_of(T) == code;
}

void write_extent(ByteWriter& to, const BlockExtent& extent) noexcept {
  const auto [low, high] = extent;
  for (const std::int32_t part : {low.x, low.y, low.z}) write_varint(to, zigzag(part));
  for (const std::int32_t size : {high.x - low.x, high.y - low.y, high.z - low.z})
    write_varint(to, static_cast<std::uint32_t>(size));
}

bool read_extent(ByteReader& from, BlockExtent& extent) noexcept {
  for (std::int32_t* const part : {&extent.low.x, &extent.low.y, &extent.low.z}) {
    std::uint32_t number = 0;
    if (!read_varint(from, number)) return false;
    *part = unzigzag(number);
  }
  if (!in_grid(extent.low)) return false;
  extent.high = extent.low;
  for (std::int32_t* const part : {&extent.high.x, &extent.high.y, &extent.high.z}) {
    std::uint32_t size = 0;
    if (!read_varint(from, size) || size > 2U * kBlockLimit) return false;
    *part += static_cast<std::int32_t>(size);
  }
  return in_grid(extent.high);
}

void write_session(ByteWriter& to, const MapSession& session) noexcept {
  to.u64(session.digest);
  to.u64(static_cast<std::uint64_t>(session.date_s));
  to.u16(session.weight);
}

bool read_session(ByteReader& from, MapSession& session) noexcept {
  session.digest = from.u64();
  session.date_s = static_cast<std::int64_t>(from.u64());
  session.weight = from.u16();
  return from.ok() && session.weight <= MapSession::kFullWeight;
}

}  // namespace

void write_frames_header(ByteWriter& to, const FramesHeader& header) noexcept {
  to.u8(header.relayed ? kAreRelayed : 0);
  to.u32(header.robot);
}

bool read_frames_header(ByteReader& from, FramesHeader& header) noexcept {
  const std::uint8_t flags = from.u8();
  header.relayed = (flags & kAreRelayed) != 0;
  header.robot = from.u32();
  return from.ok() && flags <= kAreRelayed;
}

bool FrameWriter::write(const FrameBody& frame, std::span<const std::byte> proof) noexcept {
  if (count_ == kMostFrames) return false;
  ByteWriter trial = to_;
  const std::optional<RigidCode> code = code_of(frame.T_global_map);
  const bool has_blocks = frame.extent.any();
  trial.u8(static_cast<std::uint8_t>((code ? 0 : kHasMatrix) | (has_blocks ? 0 : kHasNoBlocks)));
  write_step(trial, frame.id.epoch, before_.epoch);
  write_step(trial, frame.id.submap, before_.submap);
  write_step(trial, frame.revision, before_.revision);
  write_transform(trial, frame.T_global_map, code);
  if (has_blocks) write_extent(trial, frame.extent);
  if (MapSession::is(frame.id.submap)) write_session(trial, frame.session);
  trial.bytes(proof);
  if (!trial.ok()) return false;
  to_ = trial;
  before_ = {frame.id.epoch, frame.id.submap, frame.revision};
  ++count_;
  return true;
}

bool FrameReader::read(FrameBody& frame, std::span<const std::byte>& proof) noexcept {
  if (count_ == kMostFrames) return false;
  ++count_;
  const std::uint8_t flags = from_.u8();
  frame.id.robot = robot_;
  if (flags > (kHasMatrix | kHasNoBlocks) || !read_step(from_, before_.epoch, frame.id.epoch) ||
      !read_step(from_, before_.submap, frame.id.submap) ||
      !read_step(from_, before_.revision, frame.revision) || frame.revision == 0 ||
      !read_transform(from_, (flags & kHasMatrix) != 0, frame.T_global_map))
    return false;
  frame.extent = {};
  if ((flags & kHasNoBlocks) == 0 && !read_extent(from_, frame.extent)) return false;
  frame.session = {};
  if (MapSession::is(frame.id.submap) && !read_session(from_, frame.session)) return false;
  before_ = {frame.id.epoch, frame.id.submap, frame.revision};
  proof = proofs_ ? read_proof(from_) : std::span<const std::byte>{};
  return from_.ok();
}

bool write_frame(ByteWriter& to, const FrameBody& frame) noexcept {
  ByteWriter trial = to;
  write_frames_header(trial, {.robot = frame.id.robot});
  if (!trial.ok() || !FrameWriter(trial).write(frame)) return false;
  to = trial;
  return true;
}

}  // namespace tessera
