// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is fed with arbitrary bytes: a function for each target, run by libFuzzer (fuzz_main.cpp)
// and over the corpus as a test (corpus_test.cpp). Each checks what must hold whatever the bytes,
// and throws if it does not.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>

namespace tessera::fuzz {

using Bytes = std::span<const std::byte>;

/// Block contents: what is decoded is coded to the same bytes, and what is coded decodes.
void block_codec(Bytes bytes);
/// Packed blocks: what is accepted is packed to the same bytes.
void packed_block(Bytes bytes);
/// Each part of a datagram: what is read is written to the same bytes, within its ranges.
void wire(Bytes bytes);
/// Map files and stored blocks, their checksums right or not: an error, or the same map again.
void map_file(Bytes bytes);
/// One robot among those who have the key and mean harm, and those who have none.
void exchange(Bytes bytes);
/// Robots that mean well on a network that does not: in the end all hold the same.
void exchange_team(Bytes bytes);
/// PCD and PLY files, and poses.
void clouds(Bytes bytes);
/// Depth images with their label images, camera and poses.
void depth_images(Bytes bytes);
/// OctoMap's files.
void octrees(Bytes bytes);
/// LCM messages, URLs and senders.
void messages(Bytes bytes);
/// Sensors' messages, whole and in fragments, and queries.
void sensors(Bytes bytes);
/// Statuses of robots, with session, sequence, signature and tag, and who is in their table.
void status(Bytes bytes);
/// Files of datasets and keys.
void text_files(Bytes bytes);
/// Frames of a vehicle's bus: whatever is used is a pose that may be.
void vehicle(Bytes bytes);

/// Throws std::logic_error with what, unless it holds.
inline void require(bool holds, const char* what) {
  if (!holds) throw std::logic_error(what);
}

/// Takes numbers off the front of the input; after its end, zeros.
class Input {
 public:
  explicit Input(Bytes bytes) : rest_(bytes) {}
  [[nodiscard]] bool empty() const { return rest_.empty(); }
  [[nodiscard]] Bytes rest() const { return rest_; }
  std::uint8_t u8();
  std::uint16_t u16();
  std::uint32_t u32();
  /// In [0, n).
  int below(int n) { return static_cast<int>(u8()) % n; }
  /// So many bytes, or those that there are.
  Bytes bytes(std::size_t count);

 private:
  Bytes rest_;
};

}  // namespace tessera::fuzz
