// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What each reader may take from the heap at most, with what it gives: the table "Memory" of
// docs/reference/formats.md, which tests and fuzz targets hold the readers to.
#pragma once

#include <algorithm>
#include <cstddef>

namespace tessera::test {

/// Messages, short names and what libraries hold for themselves.
inline constexpr std::size_t kSmallBytes = std::size_t{64} << 10U;

/// read_grey_png(). out of 8 bits is the caller's; of 16 bits there is a copy.
constexpr std::size_t png_bytes(std::size_t file, std::size_t width, std::size_t height,
                                int bits) noexcept {
  const std::size_t copy = bits == 16 ? 2 * width * height : 0;
  return file + copy + 8 * height + 8 * width + 2 * kSmallBytes;
}

/// Of the header of a cloud, of which 64 KiB are looked at.
constexpr std::size_t cloud_header_bytes(std::size_t file) noexcept {
  return 64 * std::min(file, std::size_t{64} << 10U) + kSmallBytes;
}
/// A point as the reader gives it: four floats and an id.
inline constexpr std::size_t kPointBytes = 24;
/// read_pcd() of uncompressed points and read_ply(), beside the file; a point takes 3 bytes.
constexpr std::size_t cloud_bytes(std::size_t file) noexcept {
  return (file + 3) / 3 * kPointBytes + cloud_header_bytes(file);
}
/// read_pcd() of compressed points, beside the file: at most 512 MiB, unpacked and as points.
/// A byte gives 88 at most, and of these 3 are a point.
constexpr std::size_t packed_cloud_bytes(std::size_t file) noexcept {
  constexpr std::size_t kMost = std::size_t{512} << 20U;
  const std::size_t unpacked = 88 * (file + 3);
  return std::min(kMost, unpacked + unpacked / 3 * kPointBytes) + cloud_header_bytes(file);
}

/// read_pose_rows() and read_poses(): the text, and 104 bytes for a row of 15 at least.
constexpr std::size_t poses_bytes(std::size_t file) noexcept { return 8 * file + kSmallBytes; }

/// Octree::read(): the file.
constexpr std::size_t octree_bytes(std::size_t file) noexcept { return file + kSmallBytes; }

/// classes.toml, cameras.toml, camera.toml and configurations, of 1 MiB at most: the smallest table
/// of a text takes two bytes of it.
constexpr std::size_t toml_bytes(std::size_t file) noexcept { return 256 * file + (1U << 20U); }

}  // namespace tessera::test
