// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/dataset.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "tessera/base/assert.hpp"

namespace tessera {
namespace {

// Files are little-endian and are read straight into place.
static_assert(std::endian::native == std::endian::little);

constexpr std::size_t kFloatsPerPoint = 4;
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
  return Failure{std::string(path.view()) + " has " + std::to_string(file->size_bytes()) +
                     " bytes, but had " + std::to_string(expected_bytes) +
                     " when the dataset was opened; do not change its files during a run",
                 FailureKind::kFailure};
}

}  // namespace

void UnknownRawIds::add(std::uint16_t raw_id) noexcept {
  ++points;
  const auto end = examples.begin() + static_cast<std::ptrdiff_t>(num_examples);
  if (num_examples < kMaxExamples && std::find(examples.begin(), end, raw_id) == end) {
    examples[num_examples++] = raw_id;
  }
}

void ScanBuffer::reserve(std::size_t max_points) {
  if (components_.size() >= max_points) return;
  points_xyzi_.resize(max_points * kFloatsPerPoint);
  components_.resize(max_points);
  times_s_.resize(max_points);
}

std::span<float> ScanBuffer::points_xyzi(std::size_t num_points) {
  reserve(num_points);
  return {points_xyzi_.data(), num_points * kFloatsPerPoint};
}

std::span<std::uint8_t> ScanBuffer::components(std::size_t num_points) {
  reserve(num_points);
  return {components_.data(), num_points};
}

ScanView DatasetScan::view() const noexcept {
  ScanView view;
  view.T_map_sensor = T_map_sensor;
  view.points = points_xyzi.data();
  view.stride_floats = kFloatsPerPoint;
  view.count = num_points();
  view.components = components.data();
  return view;
}

Dataset::Dataset(std::string dir, DatasetClasses classes, std::string labels)
    : dir_(std::move(dir)), classes_(std::move(classes)), labels_(std::move(labels)) {}

Outcome<DatasetScan> Dataset::read(std::size_t i, ScanBuffer& buffer) const {
  const Entry& entry = scans_[i];
  const std::span<float> points = buffer.points_xyzi(entry.points);
  const std::span<std::uint8_t> components = buffer.components(entry.points);

  const ScanFilePath path(dir_, "velodyne", entry.number, ".bin");
  Outcome<InputFile> file = open_unchanged(path, points.size_bytes());
  if (!file.ok()) return file.failure();
  const Outcome<void> filled = file->read_exactly(std::as_writable_bytes(points));
  if (!filled.ok()) return filled.failure();

  DatasetScan scan{.number = entry.number,
                   .points_xyzi = points,
                   .components = components,
                   .unknown = {},
                   .deskew = {},
                   .projection = {},
                   .T_map_sensor = entry.T_map_sensor};
  if (deskews_) {
    const Outcome<DeskewReport> deskewed = deskew(i, buffer);
    if (!deskewed.ok()) return deskewed.failure();
    scan.deskew = *deskewed;
  }
  const Outcome<void> labelled = read_components(i, components, scan);
  if (!labelled.ok()) return labelled.failure();
  return scan;
}

Outcome<void> Dataset::read_times(std::size_t i, std::span<float> out) const {
  TESSERA_ASSERT(has_times_ && out.size() == scans_[i].points);
  const ScanFilePath path(dir_, "times", scans_[i].number, ".bin");
  Outcome<InputFile> file = open_unchanged(path, out.size_bytes());
  if (!file.ok()) return file.failure();
  return file->read_exactly(std::as_writable_bytes(out));
}

Outcome<DeskewReport> Dataset::deskew(std::size_t i, ScanBuffer& buffer) const {
  const Entry& entry = scans_[i];
  const std::span<float> times_s(buffer.times_s_.data(), entry.points);
  const Outcome<void> read = read_times(i, times_s);
  if (!read.ok()) return read.failure();
  const Sweep sweep{.points = {buffer.points_xyzi_.data(), kFloatsPerPoint, entry.points},
                    .times_s = times_s.data(),
                    .stamp_us = motion_->stamp_us(entry.number)};
  DeskewConfig config;
  config.max_gap_us = ScanMotion::kMaxGap_us;
  return tessera::deskew(motion_->track(), sweep, config, buffer.points_xyzi_);
}

Outcome<void> Dataset::read_components(std::size_t i, std::span<std::uint8_t> out,
                                       DatasetScan& scan) const {
  if (cameras_ != nullptr) {
    const ScanToLabel to_label{.number = scan.number,
                               .points = {scan.points_xyzi.data(), kFloatsPerPoint, out.size()},
                               .motion = motion_ ? &*motion_ : nullptr,
                               .num_classes = classes_.table().num_classes()};
    const Outcome<LabelReport> projected = cameras_->read(to_label, out);
    if (!projected.ok()) return projected.failure();
    scan.projection = *projected;
    return {};
  }
  if (!has_labels()) {
    std::fill(out.begin(), out.end(), classes_.unlabelled());
    return {};
  }
  const Outcome<UnknownRawIds> unknown = read_labels(i, labels_, out);
  if (!unknown.ok()) return unknown.failure();
  scan.unknown = *unknown;
  return {};
}

Outcome<UnknownRawIds> Dataset::read_labels(std::size_t i, std::string_view folder,
                                            std::span<std::uint8_t> out) const {
  TESSERA_ASSERT(out.size() == scans_[i].points);
  const ScanFilePath path(dir_, folder, scans_[i].number, ".label");
  Outcome<InputFile> file = open_unchanged(path, out.size() * sizeof(std::uint32_t));
  if (!file.ok()) return file.failure();

  UnknownRawIds unknown;
  std::array<std::uint32_t, kLabelsPerChunk> chunk;
  for (std::size_t done = 0; done < out.size();) {
    const std::span<std::uint32_t> labels(chunk.data(),
                                          std::min(out.size() - done, kLabelsPerChunk));
    const Outcome<void> filled = file->read_exactly(std::as_writable_bytes(labels));
    if (!filled.ok()) return filled.failure();
    for (const std::uint32_t label : labels) {
      const auto raw_id =
          static_cast<std::uint16_t>(label & 0xFFFFU);  // The upper bits are the instance.
      if (!classes_.is_known(raw_id)) unknown.add(raw_id);
      out[done++] = classes_.component(raw_id);
    }
  }
  return unknown;
}

}  // namespace tessera
