// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Reads what the page is sent, by docs/reference/view.md.
#pragma once

#include <cstring>
#include <map>
#include <span>
#include <tuple>
#include <vector>

#include "view/voxel_message.hpp"

namespace tessera {

template <class Integer>
Integer read_at(std::span<const std::byte> bytes, std::size_t at) {
  Integer value{};
  std::memcpy(&value, bytes.subspan(at, sizeof value).data(), sizeof value);
  return value;
}

struct ReadVoxel {
  std::uint16_t row = 0;
  std::uint8_t label = 0;
  std::uint8_t probability = 0;
  std::uint8_t variance = 0;
  std::uint8_t contributor = 0;
  std::uint8_t flags = 0;
  std::uint8_t zero = 0;
};

struct ReadBlock {
  BlockCoord coord{};
  std::uint32_t revision = 0;
  std::vector<ReadVoxel> voxels;
};

/// at: where it begins; moved behind it.
inline ReadBlock read_block(std::span<const std::byte> bytes, std::size_t& at) {
  ReadBlock block;
  block.coord = {read_at<std::int32_t>(bytes, at), read_at<std::int32_t>(bytes, at + 4),
                 read_at<std::int32_t>(bytes, at + 8)};
  block.revision = read_at<std::uint32_t>(bytes, at + 12);
  block.voxels.resize(read_at<std::uint32_t>(bytes, at + 16));
  at += kViewBlockBytes;
  for (ReadVoxel& voxel : block.voxels) {
    voxel = {read_at<std::uint16_t>(bytes, at),    read_at<std::uint8_t>(bytes, at + 2),
             read_at<std::uint8_t>(bytes, at + 3), read_at<std::uint8_t>(bytes, at + 4),
             read_at<std::uint8_t>(bytes, at + 5), read_at<std::uint8_t>(bytes, at + 6),
             read_at<std::uint8_t>(bytes, at + 7)};
    at += kViewVoxelBytes;
  }
  return block;
}

}  // namespace tessera
