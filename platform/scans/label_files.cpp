// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/label_files.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <bit>
#include <string>

#include "scans/scan_listing.hpp"
#include "tessera/base/assert.hpp"
#include "tessera/registration/point_labels.hpp"

namespace tessera {
namespace {

// Files are little-endian and are read straight into place.
static_assert(std::endian::native == std::endian::little);

constexpr std::size_t kBytesPerLabel = sizeof(std::uint32_t);
constexpr std::size_t kPointsPerChunk = 1024;

ScanFilePath path_of(const LabelFile& file, bool weighted) {
  return {file.dataset, file.folder, file.scan_number, weighted ? kWeightedSuffix : ".label"};
}

/// Labels of some points as they were read.
struct ReadLabels {
  std::array<std::uint8_t, kPointsPerChunk * kMostLabels> components;
  std::array<std::uint8_t, kPointsPerChunk * kMostLabels> weights;

  /// The best ones, as the library sees them.
  void write_best(std::size_t labels, std::uint8_t unlabelled,
                  std::span<std::uint8_t> out) const noexcept {
    const ScanView view{.count = out.size(),
                        .components = components.data(),
                        .labels_per_point = labels,
                        .label_weights = weights.data()};
    const PointLabeller labeller(view, unlabelled);
    for (std::size_t i = 0; i < out.size(); ++i) {
      ScanPoint point;
      static_cast<void>(labeller.label_best(i, point));
      out[i] = point.component;
    }
  }
};

}  // namespace

Outcome<std::size_t> check_label_file(const LabelFile& file) {
  const ScanFilePath weighted = path_of(file, true);
  const bool is_weighted = is_file(weighted);
  const ScanFilePath path = is_weighted ? weighted : path_of(file, false);
  TESSERA_TRY_ASSIGN(const std::uint64_t size, file_size_bytes(path));
  const std::size_t most = is_weighted ? kMostLabels : 1;
  for (std::size_t labels = 1; labels <= most; ++labels) {
    if (size == file.points * kBytesPerLabel * labels) return is_weighted ? labels : 0;
  }
  const std::string have = size % kBytesPerLabel == 0
                               ? fmt::format("{} labels", size / kBytesPerLabel)
                               : fmt::format("{} bytes (not a whole number of labels)", size);
  const std::string each = is_weighted ? fmt::format(", of 1 to {} labels each", most) : "";
  return Failure{fmt::format(
      "{} has {}, but its scan has {} points{}; get the labels that belong to this scan",
      path.view(), have, file.points, each)};
}

Outcome<UnknownRawIds> read_label_file(const LabelFile& file, const DatasetClasses& classes,
                                       const LabelRoom& room) {
  const bool is_weighted = room.weighted_labels > 0;
  const std::size_t labels = is_weighted ? room.weighted_labels : 1;
  const bool best_alone = is_weighted && room.weights.empty();
  TESSERA_ASSERT(room.components.size() == file.points * (best_alone ? 1 : labels));
  const ScanFilePath path = path_of(file, is_weighted);
  TESSERA_TRY_ASSIGN(InputFile input, open_unchanged(path, file.points * labels * kBytesPerLabel));
  UnknownRawIds unknown;
  std::array<std::uint32_t, kPointsPerChunk * kMostLabels> words;
  ReadLabels read;
  for (std::size_t done = 0; done < file.points;) {
    const std::size_t points = std::min(file.points - done, kPointsPerChunk);
    TESSERA_TRY(
        input.read_exactly(std::as_writable_bytes(std::span(words).first(points * labels))));
    for (std::size_t k = 0; k < points * labels; ++k) {
      const auto raw_id = static_cast<std::uint16_t>(words[k] & 0xFFFFU);
      const std::uint32_t weight = words[k] >> 16U;
      if (is_weighted && weight > kOneLabel) {
        return Failure{
            fmt::format("{} gives a label of point {} the weight {}; weights are in "
                        "255ths, 0 to 255",
                        path.view(), done + k / labels, weight)};
      }
      const bool counts = !is_weighted || weight > 0;
      if (counts && !classes.is_known(raw_id)) unknown.add(raw_id);
      read.components[k] = classes.component(raw_id);
      read.weights[k] = static_cast<std::uint8_t>(weight);
    }
    if (best_alone) {
      read.write_best(labels, classes.unlabelled(), room.components.subspan(done, points));
    } else {
      std::copy_n(read.components.data(), points * labels, &room.components[done * labels]);
      if (is_weighted)
        std::copy_n(read.weights.data(), points * labels, &room.weights[done * labels]);
    }
    done += points;
  }
  return unknown;
}

Outcome<UnknownRawIds> read_best_labels(const LabelFile& file, const DatasetClasses& classes,
                                        std::span<std::uint8_t> components) {
  LabelRoom room{.components = components};
  if (is_file(path_of(file, true))) {
    const Outcome<std::size_t> labels = check_label_file(file);
    if (!labels.ok()) return Failure{labels.failure().message, FailureKind::kFailure};
    room.weighted_labels = *labels;
  }
  return read_label_file(file, classes, room);
}

}  // namespace tessera
