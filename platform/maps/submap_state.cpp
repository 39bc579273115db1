// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/submap_state.hpp"

#include <algorithm>

#include "base/atomic_file.hpp"
#include "base/input_file.hpp"
#include "tessera/base/internal/byte_io.hpp"
#include "tessera/base/internal/crc32.hpp"

namespace tessera {

namespace {

// Magic, version, robot, epoch, in submaps, boot, first, revision, frames, kept; the last note;
// each frame; each row; CRC-32C of all before.
constexpr std::uint64_t kFramesMagic = 0x1a0a0d4d'52465354U;  // "TSFRM\r\n\x1a"
constexpr std::uint32_t kFramesVersion = 1;
constexpr std::size_t kFramesHeadBytes = 8 + 4 * 4 + 8 + 4 * 4 + kJournalNoteBytes;
constexpr std::size_t kCodeBytes = 6 * 4 + 1;
constexpr std::size_t kPoseBytes = 8 + kCodeBytes;
constexpr std::size_t kFrameBytes = kCodeBytes + 4 * 4 + 1 + SubmapFrame::kPoses * kPoseBytes;
constexpr std::size_t kRowBytes = 3 * 4 + 8 + 5 * 8;
constexpr std::size_t kFramesCheckBytes = 4;

std::size_t size_of(std::size_t frames, std::size_t kept) {
  return kFramesHeadBytes + frames * kFrameBytes + kept * kRowBytes + kFramesCheckBytes;
}

void put(const RigidCode& code, ByteWriter& to) {
  for (const std::int32_t part : code.translation) to.i32(part);
  for (const std::int32_t part : code.rotation) to.i32(part);
  to.u8(code.largest);
}

RigidCode code_in(ByteReader& from) {
  RigidCode code;
  for (std::int32_t& part : code.translation) part = static_cast<std::int32_t>(from.u32());
  for (std::int32_t& part : code.rotation) part = static_cast<std::int32_t>(from.u32());
  code.largest = from.u8();
  return code;
}

void put(const SubmapFrame& frame, ByteWriter& to) {
  put(frame.frame, to);
  for (const std::uint32_t word : {frame.revision, frame.noted, frame.stride, frame.count})
    to.u32(word);
  to.u8(frame.continues ? 1 : 0);
  for (const SubmapFrame::Pose& pose : frame.poses) {
    to.u64(static_cast<std::uint64_t>(pose.stamp_us));
    put(pose.T_map_sensor, to);
  }
}

/// What is none of these SubmapFrames::restore refuses.
SubmapFrame frame_in(ByteReader& from) {
  SubmapFrame frame;
  frame.frame = code_in(from);
  for (std::uint32_t* const word : {&frame.revision, &frame.noted, &frame.stride, &frame.count})
    *word = from.u32();
  frame.continues = from.u8() != 0;
  for (SubmapFrame::Pose& pose : frame.poses) {
    pose.stamp_us = static_cast<std::int64_t>(from.u64());
    pose.T_map_sensor = code_in(from);
  }
  return frame;
}

void put(const SubmapRow& row, ByteWriter& to) {
  for (const std::uint32_t word : {row.number, row.first_scan, row.last_scan}) to.u32(word);
  to.f64(row.length_m);
  for (const std::uint64_t word :
       {row.bytes, row.digest, row.label_voxels, row.free_voxels, row.occupied})
    to.u64(word);
}

SubmapRow row_in(ByteReader& from) {
  SubmapRow row;
  for (std::uint32_t* const word : {&row.number, &row.first_scan, &row.last_scan})
    *word = from.u32();
  row.length_m = from.f64();
  for (std::uint64_t* const word :
       {&row.bytes, &row.digest, &row.label_voxels, &row.free_voxels, &row.occupied})
    *word = from.u64();
  return row;
}

}  // namespace

std::vector<std::byte> bytes_of(const SubmapState& state) {
  std::vector<std::byte> bytes(size_of(state.frames.size(), state.kept.size()));
  ByteWriter to(bytes);
  to.u64(kFramesMagic);
  to.u32(kFramesVersion);
  to.u32(state.robot);
  to.u32(state.epoch);
  to.u32(state.in_submaps ? 1 : 0);
  to.u64(state.boot);
  to.u32(state.first);
  to.u32(state.revision);
  to.u32(static_cast<std::uint32_t>(state.frames.size()));
  to.u32(static_cast<std::uint32_t>(state.kept.size()));
  to.bytes(bytes_of(state.last));
  for (const SubmapFrame& frame : state.frames) put(frame, to);
  for (const SubmapRow& row : state.kept) put(row, to);
  to.u32(crc32c(to.written()));
  return bytes;
}

Outcome<void> write_submap_state(std::span<const std::byte> bytes, const std::string& path) {
  TESSERA_TRY_ASSIGN(AtomicFile file, AtomicFile::open(path));
  file.write(bytes);
  return file.commit();
}

Outcome<SubmapState> read_submap_state(const std::string& path) {
  TESSERA_TRY_ASSIGN(InputFile file, InputFile::open(path));
  const Failure damaged{path + " is damaged"};
  std::vector<std::byte> bytes(static_cast<std::size_t>(
      std::min<std::uint64_t>(file.size_bytes(), size_of(kMostSubmaps, kMostSubmaps))));
  TESSERA_TRY(file.read_exactly(bytes));
  ByteReader from(bytes);
  const bool begins = from.u64() == kFramesMagic && from.u32() == kFramesVersion;
  SubmapState state;
  state.robot = from.u32();
  state.epoch = from.u32();
  state.in_submaps = from.u32() != 0;
  state.boot = from.u64();
  state.first = from.u32();
  state.revision = from.u32();
  const std::uint32_t frames = from.u32();
  const std::uint32_t kept = from.u32();
  std::array<std::byte, kJournalNoteBytes> note{};
  for (std::byte& byte : note) byte = static_cast<std::byte>(from.u8());
  state.last = note_in(note);
  if (!begins || !from.ok() || frames > kMostSubmaps || kept > kMostSubmaps ||
      bytes.size() != size_of(frames, kept))
    return damaged;
  ByteReader check{std::span(bytes).last(kFramesCheckBytes)};
  if (check.u32() != crc32c(std::span(bytes).first(bytes.size() - kFramesCheckBytes)))
    return damaged;
  for (std::uint32_t i = 0; i < frames; ++i) state.frames.push_back(frame_in(from));
  for (std::uint32_t i = 0; i < kept; ++i) state.kept.push_back(row_in(from));
  const auto ascends = [](const SubmapRow& a, const SubmapRow& b) { return a.number >= b.number; };
  if (std::adjacent_find(state.kept.begin(), state.kept.end(), ascends) != state.kept.end())
    return damaged;
  return state;
}

}  // namespace tessera
