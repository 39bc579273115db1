// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The label images of a dataset's cameras: cameras.toml and the folders that it names.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/outcome.hpp"
#include "scans/cameras_toml.hpp"
#include "scans/scan.hpp"

namespace tessera {

[[nodiscard]] bool has_cameras(const std::string& dir);
/// Reads dir/cameras.toml; the paths of masks begin with dir then. Fails with kUsage as
/// read_cameras and iff the file is missing or a camera has no folder.
Outcome<std::vector<CameraDescription>> open_cameras(const std::string& dir);
/// Fails with kUsage iff an image of one of these scans is missing.
Outcome<void> check_images(const std::string& dir, const std::vector<CameraDescription>& cameras,
                           std::span<const int> scan_numbers);
/// Pixels of the largest image; 0 without cameras.
[[nodiscard]] std::size_t most_pixels(const std::vector<CameraDescription>& cameras) noexcept;
/// Reads the images of scan.number, stamped by scan.stamp_us. Fails with kUsage iff an image is
/// missing, damaged or of another size than its camera. Uses the heap for decoding.
Outcome<void> read_images(const std::string& dir, const std::vector<CameraDescription>& cameras,
                          Scan& scan);

}  // namespace tessera
