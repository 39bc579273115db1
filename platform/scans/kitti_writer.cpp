// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/kitti_writer.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <system_error>

#include "base/atomic_file.hpp"
#include "scans/cloud.hpp"
#include "scans/label_files.hpp"
#include "scans/scan_listing.hpp"

namespace tessera {
namespace {

namespace fs = std::filesystem;

// Files are little-endian and are written straight from memory.
static_assert(std::endian::native == std::endian::little);

void append_number(std::string& text, double number) {
  constexpr int kDigits = 17;  // Reads back as the same double.
  std::array<char, 32> digits{};
  char* const end = std::to_chars(digits.data(), digits.data() + digits.size(), number,
                                  std::chars_format::general, kDigits)
                        .ptr;
  text.append(digits.data(), end);
}

/// The twelve numbers of a pose and a line's end.
void append_pose(std::string& text, const Matrix34d& T) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      append_number(text, T(row, column));
      text += row == 2 && column == 3 ? '\n' : ' ';
    }
  }
}

/// Seconds with all six digits of the microseconds.
void append_stamp(std::string& text, std::int64_t stamp_us) {
  constexpr std::uint64_t kSecond_us = 1'000'000;
  const auto magnitude = static_cast<std::uint64_t>(std::abs(stamp_us));
  std::array<char, 32> digits{};
  const int length =
      std::snprintf(digits.data(), digits.size(), "%s%llu.%06llu", stamp_us < 0 ? "-" : "",
                    static_cast<unsigned long long>(magnitude / kSecond_us),
                    static_cast<unsigned long long>(magnitude % kSecond_us));
  text.append(digits.data(), static_cast<std::size_t>(length));
}

Outcome<void> write_file(std::string_view path, std::span<const std::byte> bytes) {
  Outcome<AtomicFile> file = AtomicFile::open(std::string(path));
  if (!file.ok()) return Failure{file.failure().message, FailureKind::kFailure};
  file->write(bytes);  // commit() reports a failure.
  return file->commit();
}

Outcome<void> make_folder(const std::string& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (!error) return {};
  return Failure{"cannot make the folder " + one_line(path) + ": " + error.message() +
                 "; name another one"};
}

Outcome<void> check_empty(const std::string& folder) {
  std::error_code error;
  const fs::file_status status = fs::status(folder, error);
  if (!fs::exists(status)) return {};
  if (fs::is_directory(status) && fs::is_empty(folder, error) && !error) return {};
  return Failure{one_line(folder) + (fs::is_directory(status) ? " has files" : " is not a folder") +
                 "; name a new folder"};
}

}  // namespace

Outcome<KittiWriter> KittiWriter::create(const std::string& folder, const DatasetClasses& classes,
                                         bool with_times) {
  KittiWriter writer(folder, with_times);
  TESSERA_TRY(writer.choose_raw_ids(classes));
  TESSERA_TRY(check_empty(folder));
  for (const char* const name : {"velodyne", kLabelFolder, "times"}) {
    if (name == std::string_view("times") && !with_times) continue;
    TESSERA_TRY(make_folder(in_folder(folder, name)));
  }
  return writer;
}

/// The lowest raw id of each component; an unlabelled point takes a known id if there is one, so
/// that it is not counted as unknown.
Outcome<void> KittiWriter::choose_raw_ids(const DatasetClasses& classes) {
  unlabelled_ = classes.unlabelled();
  std::optional<std::uint16_t> unknown;
  for (std::uint32_t id = 0; id <= 0xffff; ++id) {
    const auto raw_id = static_cast<std::uint16_t>(id);
    std::optional<std::uint16_t>& chosen =
        classes.is_known(raw_id) ? raw_ids_[classes.component(raw_id)] : unknown;
    if (!chosen) chosen = raw_id;
  }
  if (!raw_ids_[unlabelled_]) raw_ids_[unlabelled_] = unknown;
  if (raw_ids_[unlabelled_]) return {};
  return Failure{"classes.toml gives every raw id a class; leave one for unlabelled points"};
}

Outcome<void> KittiWriter::write_scan_file(const char* subfolder, const char* extension,
                                           std::span<const std::byte> bytes) {
  const ScanFilePath path(folder_, subfolder, static_cast<int>(num_scans()), extension);
  return write_file(path.view(), bytes);
}

Outcome<void> KittiWriter::add(const Scan& scan, const ScanView& view) {
  if (num_scans() > static_cast<std::size_t>(kMaxScanNumber))
    return Failure{"there are more than a million scans; choose fewer"};
  points_xyzi_.assign(view.count * kFloatsPerPoint, 0.0F);
  const std::size_t floats = std::min(view.stride_floats, kFloatsPerPoint);
  for (std::size_t i = 0; i < view.count; ++i)
    std::copy_n(view.points + i * view.stride_floats, floats, &points_xyzi_[i * kFloatsPerPoint]);
  const bool weighted = view.label_weights != nullptr;
  labels_.resize(view.count * view.labels_per_point);
  for (std::size_t k = 0; k < labels_.size(); ++k) {
    const std::uint8_t component = view.components != nullptr ? view.components[k] : unlabelled_;
    labels_[k] = raw_ids_[component].value_or(*raw_ids_[unlabelled_]);
    if (weighted) labels_[k] |= std::uint32_t{view.label_weights[k]} << 16U;
  }
  Outcome<void> done = write_scan_file("velodyne", ".bin", std::as_bytes(std::span(points_xyzi_)));
  if (done.ok()) {
    done = write_scan_file(kLabelFolder, weighted ? kWeightedSuffix : ".label",
                           std::as_bytes(std::span(labels_)));
  }
  if (done.ok() && with_times_)
    done = write_scan_file("times", ".bin", std::as_bytes(scan.times_s().first(scan.count)));
  if (!done.ok()) return done;
  stamps_us_.push_back(scan.stamp_us);
  append_pose(poses_, view.T_map_sensor);
  return {};
}

Outcome<void> KittiWriter::add_file(const std::string& name, std::string_view text) {
  return write_file(in_folder(folder_, name), std::as_bytes(std::span(text)));
}

Outcome<void> KittiWriter::finish(const ScanMotion* motion) {
  if (motion != nullptr) {
    std::string times;
    for (const std::int64_t stamp_us : stamps_us_) {
      append_stamp(times, stamp_us);
      times += '\n';
    }
    std::string dense;
    for (std::size_t i = 0; i < motion->track().size(); ++i) {
      append_stamp(dense, motion->track()[i].stamp_us);
      dense += ' ';
      append_pose(dense, motion->track()[i].T_map_body);
    }
    Outcome<void> done = add_file("times.txt", times);
    if (done.ok()) done = add_file("poses_dense.txt", dense);
    if (!done.ok()) return done;
  }
  return add_file("poses.txt", poses_);
}

}  // namespace tessera
