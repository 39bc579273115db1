// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/dataset.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <utility>

#include "scans/camera_images.hpp"
#include "scans/cloud.hpp"
#include "tessera/base/assert.hpp"

namespace tessera {
namespace {

// Files are little-endian and are read straight into place.
static_assert(std::endian::native == std::endian::little);

constexpr std::size_t kLabelsPerChunk = 4096;

/// What was valid at open() and is no longer is not a usage error.
Failure as_interruption(Failure failure) {
  failure.kind = FailureKind::kFailure;
  return failure;
}

/// The file, if it still has the size that open() found.
Outcome<InputFile> open_unchanged(const ScanFilePath& path, std::uint64_t expected_bytes) {
  Outcome<InputFile> file = InputFile::open(path.view());
  if (!file.ok()) return as_interruption(file.failure());
  if (file->size_bytes() == expected_bytes) return file;
  return Failure{fmt::format("{} has {} bytes, but had {} when the dataset was opened; do not "
                             "change its files during a run",
                             path.view(), file->size_bytes(), expected_bytes),
                 FailureKind::kFailure};
}

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
                   .weights = false};
  config.deskew.max_gap_us = kMaxPoseGap_us;
  return config;
}

Outcome<void> Dataset::read(std::size_t i, Scan& into) const {
  const Entry& entry = scans_[i];
  into.clear();
  into.reserve(entry.points);
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
  const std::span<std::uint8_t> out = scan.components().first(scan.count);
  if (!has_labels()) {
    std::fill(out.begin(), out.end(), classes_.unlabelled());
    return {};
  }
  TESSERA_TRY_ASSIGN(const UnknownRawIds unknown, read_labels(i, labels_, out));
  scan.unknown = unknown;
  return {};
}

Outcome<UnknownRawIds> Dataset::read_labels(std::size_t i, std::string_view folder,
                                            const DatasetClasses& classes,
                                            std::span<std::uint8_t> out) const {
  TESSERA_ASSERT(out.size() == scans_[i].points);
  const ScanFilePath path(dir_, folder, scans_[i].number, ".label");
  TESSERA_TRY_ASSIGN(InputFile file, open_unchanged(path, out.size() * sizeof(std::uint32_t)));

  UnknownRawIds unknown;
  std::array<std::uint32_t, kLabelsPerChunk> chunk;
  for (std::size_t done = 0; done < out.size();) {
    const std::span<std::uint32_t> labels(chunk.data(),
                                          std::min(out.size() - done, kLabelsPerChunk));
    TESSERA_TRY(file.read_exactly(std::as_writable_bytes(labels)));
    for (const std::uint32_t label : labels) {
      const auto raw_id =
          static_cast<std::uint16_t>(label & 0xFFFFU);  // The upper bits are the instance.
      if (!classes.is_known(raw_id)) unknown.add(raw_id);
      out[done++] = classes.component(raw_id);
    }
  }
  return unknown;
}

}  // namespace tessera
