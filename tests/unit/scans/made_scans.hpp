// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A recording without files.
#pragma once

#include <optional>
#include <vector>

#include "scans/recorded_scans.hpp"

namespace tessera::test {

/// Scan i has i + 1 points at x = i, 1, 2, ... with intensity 0.5, of component 1 + i.
class MadeScans final : public RecordedScans {
 public:
  explicit MadeScans(std::size_t count) : poses_(count, Matrix34d(Matrix34d::Identity())) {
    for (std::size_t i = 0; i < count; ++i) poses_[i](0, 3) = static_cast<double>(i) / 3.0;
  }
  [[nodiscard]] std::size_t num_scans() const noexcept override { return poses_.size(); }
  [[nodiscard]] int scan_number(std::size_t i) const override { return static_cast<int>(10 + i); }
  [[nodiscard]] std::size_t num_points(std::size_t i) const override { return i + 1; }
  [[nodiscard]] std::size_t max_points() const noexcept override { return poses_.size(); }
  [[nodiscard]] const Matrix34d& T_map_sensor(std::size_t i) const override { return poses_[i]; }
  [[nodiscard]] const DatasetClasses& classes() const noexcept override { return classes_; }
  [[nodiscard]] bool decodes() const noexcept override { return false; }
  [[nodiscard]] RegistrarConfig registration() const override {
    RegistrarConfig config;
    config.num_classes = classes_.table().num_classes();
    config.limits = {.points = max_points(),
                     .cameras = 0,
                     .image_pixels = 0,
                     .floats_per_point = 4,
                     .weights = false};
    return config;
  }
  Outcome<void> read(std::size_t i, Scan& into) const override {
    if (unreadable == i) return Failure{"unreadable", FailureKind::kFailure};
    into.clear();
    into.reserve(i + 1);
    into.number = scan_number(i);
    into.stamp_us = static_cast<std::int64_t>(i) * 100'000;
    into.count = static_cast<std::uint32_t>(i + 1);
    into.T_map_sensor = poses_[i];
    into.has_components = true;
    into.unknown.points = i;
    for (std::size_t p = 0; p <= i; ++p) {
      const std::span<float> point = into.points().subspan(4 * p, 4);
      point[0] = p == 0 ? static_cast<float>(i) : static_cast<float>(p);
      point[1] = point[2] = 0.0F;
      point[3] = 0.5F;
      into.components()[p] = static_cast<std::uint8_t>(1 + i);
    }
    return {};
  }

  std::optional<std::size_t> unreadable;

 private:
  std::vector<Matrix34d> poses_;
  DatasetClasses classes_ = DatasetClasses::semantic_kitti();
};

}  // namespace tessera::test
