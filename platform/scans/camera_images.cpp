// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/camera_images.hpp"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "pictures/png_image.hpp"
#include "scans/scan_listing.hpp"
#include "settings/source_options.hpp"

namespace tessera {
namespace {

std::size_t pixels_of(const CameraDescription& camera) {
  return static_cast<std::size_t>(camera.model.width_px()) *
         static_cast<std::size_t>(camera.model.height_px());
}

std::string path_of_cameras(const std::string& dir) { return in_folder(dir, "cameras.toml"); }

}  // namespace

bool has_cameras(const std::string& dir) {
  std::error_code error;
  return std::filesystem::exists(path_of_cameras(dir), error);
}

Outcome<std::vector<CameraDescription>> open_cameras(const std::string& dir) {
  const std::string path = path_of_cameras(dir);
  if (!has_cameras(dir))
    return Failure{path + " does not exist; " + kSourceSettings["--labels"] +
                   " cameras needs it, with a [[camera]] for each "
                   "camera; add it, or give " +
                   kSourceSettings["--labels"] + " a folder of labels or none"};
  Outcome<std::vector<CameraDescription>> cameras = read_cameras(path);
  if (!cameras.ok()) return cameras.failure();
  for (CameraDescription& camera : *cameras) {
    if (camera.folder.empty())
      return Failure{path + ": the camera '" + camera.name +
                     "' has no folder; write where its images are, as in folder = \"cameras/0\""};
    if (!camera.mask.empty()) camera.mask = in_folder(dir, camera.mask);
  }
  return cameras;
}

Outcome<void> check_images(const std::string& dir, const std::vector<CameraDescription>& cameras,
                           std::span<const int> scan_numbers) {
  for (const CameraDescription& camera : cameras) {
    for (const int number : scan_numbers) {
      const Outcome<std::uint64_t> size =
          file_size_bytes(ScanFilePath(dir, camera.folder, number, ".png"));
      if (!size.ok())
        return Failure{size.failure().message + " (an image of the camera '" + camera.name +
                       "' is needed for each scan)"};
    }
  }
  return {};
}

std::size_t most_pixels(const std::vector<CameraDescription>& cameras) noexcept {
  std::size_t pixels = 0;
  for (const CameraDescription& camera : cameras) pixels = std::max(pixels, pixels_of(camera));
  return pixels;
}

Outcome<void> read_images(const std::string& dir, const std::vector<CameraDescription>& cameras,
                          Scan& scan) {
  scan.num_images = 0;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const CameraDescription& camera = cameras[i];
    ScanImage& image = scan.image_memory[i];
    image.camera = static_cast<std::int32_t>(i);
    image.width_px = camera.model.width_px();
    image.height_px = camera.model.height_px();
    image.stamp_us = scan.stamp_us + camera.offset_us;
    const ScanFilePath path(dir, camera.folder, scan.number, ".png");
    TESSERA_TRY(read_grey_png(path.view(), image.width_px, image.height_px,
                              image.memory.first(pixels_of(camera))));
    ++scan.num_images;
  }
  return {};
}

}  // namespace tessera
