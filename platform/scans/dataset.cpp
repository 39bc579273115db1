// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/dataset.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <utility>

#include "scans/camera_images.hpp"
#include "scans/cloud.hpp"
#include "scans/label_files.hpp"

namespace tessera {
namespace {

// Files are little-endian and are read straight into place.
static_assert(std::endian::native == std::endian::little);

}  // namespace

Dataset::Dataset(std::string dir, DatasetClasses classes, std::string labels)
    : dir_(std::move(dir)), classes_(std::move(classes)), labels_(std::move(labels)) {}

RegistrarConfig Dataset::registration() const {
  RegistrarConfig config;
  config.cameras = cameras_;
  config.num_classes = classes_.table().num_classes();
  config.limits = {.points = max_points_,
                   .cameras = cameras_.size(),
                   .image_pixels = most_pixels(cameras_),
                   .floats_per_point = kFloatsPerPoint,
                   .weights = false,
                   .weighted_labels = weighted_labels_};
  config.deskew.max_gap_us = kMaxPoseGap_us;
  return config;
}

Outcome<void> Dataset::read(std::size_t i, Scan& into) const {
  const Entry& entry = scans_[i];
  into.clear();
  into.reserve(entry.points, weighted_labels_);
  into.number = entry.number;
  into.count = static_cast<std::uint32_t>(entry.points);
  into.T_map_body = into.T_map_sensor = entry.T_map_sensor;
  if (motion_) {
    into.stamp_us = motion_->stamp_us(entry.number);
    into.track = &motion_->track();
  }
  Outcome<void> done =
      read_file(i, "velodyne", into.points().first(entry.points * kFloatsPerPoint));
  if (done.ok() && has_times_) {
    done = read_file(i, "times", into.times_s().first(entry.points));
    into.has_times = done.ok();
  }
  if (done.ok()) done = read_images(dir_, cameras_, into);
  if (done.ok()) done = read_components(i, into);
  return done;
}

/// Numbers of the points of scan i; as many as there were at open().
Outcome<void> Dataset::read_file(std::size_t i, std::string_view folder,
                                 std::span<float> out) const {
  const ScanFilePath path(dir_, folder, scans_[i].number, ".bin");
  TESSERA_TRY_ASSIGN(InputFile file, open_unchanged(path, out.size_bytes()));
  return file.read_exactly(std::as_writable_bytes(out));
}

Outcome<void> Dataset::read_components(std::size_t i, Scan& scan) const {
  if (labels_ == kCameraLabels) return {};  // Registration takes them from the images.
  scan.has_components = true;
  const std::size_t labels = std::max<std::size_t>(weighted_labels_, 1);
  const std::span<std::uint8_t> out = scan.components().first(scan.count * labels);
  if (!has_labels()) {
    std::fill(out.begin(), out.end(), classes_.unlabelled());
    return {};
  }
  scan.labels_per_point = labels;
  scan.has_label_weights = weighted_labels_ > 0;
  const LabelRoom room{.components = out,
                       .weights = scan.label_weights().first(scan.count * weighted_labels_),
                       .weighted_labels = weighted_labels_};
  TESSERA_TRY_ASSIGN(const UnknownRawIds unknown,
                     read_label_file(label_file(i, labels_), classes_, room));
  scan.unknown = unknown;
  return {};
}

Outcome<UnknownRawIds> Dataset::read_labels(std::size_t i, std::string_view folder,
                                            const DatasetClasses& classes,
                                            std::span<std::uint8_t> out) const {
  return read_best_labels(label_file(i, folder), classes, out);
}

}  // namespace tessera
