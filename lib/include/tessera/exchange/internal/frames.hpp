// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Frames in a datagram (docs/reference/wire-format.md): up to 16 of one robot, each in some 35
// bytes where its transform is that of a RigidCode, as those of corrections are. Of each frame
// there is one code, and reading refuses others.
#pragma once

#include "tessera/exchange/internal/hash_tree.hpp"
#include "tessera/exchange/wire.hpp"

namespace tessera {

/// Where a contribution lies: the higher revision holds.
struct FrameBody {
  ContributionId id;
  std::uint32_t revision = 0;
  Matrix34d T_global_map = Matrix34d::Identity();
  BlockExtent extent{};  ///< Of its blocks; it may grow within a revision.
  MapSession session{};  ///< Of a contribution that is one (MapSession::is).
};

/// What all frames of a datagram have in common.
struct FramesHeader {
  static constexpr std::size_t kBytes = 1 + 4;
  std::uint32_t robot = 0;  ///< Of all contributions.
  bool relayed = false;     ///< By one that cannot sign: each has a proof, if the fleet signs.
};

/// In a datagram, at most: each is a leaf of a tree.
inline constexpr std::uint32_t kMostFrames = HashTree::kMostLeaves;
/// What is there, three numbers, a transform as it is, an extent, a session.
inline constexpr std::size_t kMostFrameBytes = 1 + 15 + 12 * sizeof(double) + 18 + 18;
static_assert(FramesHeader::kBytes + kMostFrameBytes + kMostProofBytes <= kMostBodyBytes);

/// Writes all or nothing.
void write_frames_header(ByteWriter& to, const FramesHeader& header) noexcept;
/// False iff the bytes are none.
[[nodiscard]] bool read_frames_header(ByteReader& from, FramesHeader& header) noexcept;

/// The numbers that the next frame's differ from.
struct FrameBefore {
  std::uint32_t epoch = 0;
  std::uint32_t submap = 0;
  std::uint32_t revision = 0;
};

/// Frames of one robot.
class FrameWriter {
 public:
  explicit FrameWriter(ByteWriter& to) noexcept : to_(to) {}
  /// proof: behind it, if it has one. False iff it does not fit, or there are kMostFrames: nothing
  /// was written.
  [[nodiscard]] bool write(const FrameBody& frame, std::span<const std::byte> proof = {}) noexcept;

 private:
  ByteWriter& to_;
  FrameBefore before_{};
  std::uint32_t count_ = 0;
};

/// A datagram's frames, one after the other, checked as they are read.
class FrameReader {
 public:
  /// proofs: each frame has one.
  FrameReader(ByteReader& from, std::uint32_t robot, bool proofs) noexcept
      : from_(from), robot_(robot), proofs_(proofs) {}
  /// False iff the bytes are no frame, or there were kMostFrames; the rest is invalid. proof: gets
  /// that of the frame, or none.
  [[nodiscard]] bool read(FrameBody& frame, std::span<const std::byte>& proof) noexcept;

 private:
  ByteReader& from_;
  std::uint32_t robot_;
  bool proofs_;
  FrameBefore before_{};
  std::uint32_t count_ = 0;
};

/// A body with this frame alone, as its robot sends it. All or nothing.
bool write_frame(ByteWriter& to, const FrameBody& frame) noexcept;

}  // namespace tessera
