// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a depth camera gives, with its labels and with labels that are not of its size.
#include "scans/registrar.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <memory>

namespace tessera {
namespace {

constexpr std::int32_t kWidth = 8;
constexpr std::int32_t kHeight = 6;
constexpr std::size_t kPixels = 48;
constexpr int kClasses = 5;
constexpr std::uint8_t kLabel = 3;
constexpr std::uint8_t kUnlabelled = kClasses + 1;

RegistrarConfig depth_config() {
  RegistrarConfig config;
  CameraDescription camera;
  camera.model =
      *CameraModel::make({CameraKind::kPinhole, kWidth, kHeight, 10.0, 10.0, 3.5, 2.5, {}});
  config.cameras = {camera};
  config.num_classes = kClasses;
  config.slot = {.points = kPixels, .cameras = 1, .image_pixels = kPixels};
  config.depth.step_px = 1;
  config.depth_camera = 0;
  return config;
}

/// A wall 2 m ahead, and one label throughout.
ScanSlot depth_slot(std::int32_t label_width_px, std::int32_t label_height_px) {
  ScanSlot slot(depth_config().slot);
  slot.kind = SlotKind::kDepthImage;
  slot.width_px = kWidth;
  slot.height_px = kHeight;
  std::fill(slot.xyz().begin(), slot.xyz().end(), 2.0F);
  slot.num_images = 1;
  SlotImage& labels = slot.image_memory[0];
  labels.width_px = label_width_px;
  labels.height_px = label_height_px;
  std::fill(labels.memory.begin(), labels.memory.end(), kLabel);
  return slot;
}

struct Bench {
  Bench() {
    Outcome<std::unique_ptr<Registrar>> made = Registrar::make(depth_config());
    REQUIRE(made.ok());
    registrar = std::move(*made);
  }
  [[nodiscard]] RegistrarReport report() const {
    RegistrarReport report;
    static_cast<void>(registrar->report().get(report));
    return report;
  }
  /// Points of that component in the view.
  [[nodiscard]] std::size_t count_of(std::uint8_t component) const {
    const std::uint8_t* const first = view.components;
    return static_cast<std::size_t>(std::count(first, first + view.count, component));
  }

  std::unique_ptr<Registrar> registrar;
  ScanView view{};
};

TEST_CASE("Registrar: a depth image becomes points with the labels of its pixels") {
  Bench bench;
  ScanSlot slot = depth_slot(kWidth, kHeight);
  REQUIRE(bench.registrar->view(slot, bench.view));
  CHECK(bench.view.count == kPixels);
  CHECK(bench.count_of(kLabel) == kPixels);
  CHECK(bench.report().depth_images == 1);
  CHECK(bench.report().images_refused == 0);
}

TEST_CASE("Registrar: labels of another size than the depth image are left out, and counted") {
  Bench bench;
  std::uint64_t refused = 0;
  // As many pixels in one row, one row alone, one row less.
  const SlotImage sizes[] = {{.width_px = 48, .height_px = 1},
                             {.width_px = kWidth, .height_px = 1},
                             {.width_px = kWidth, .height_px = kHeight - 1}};
  for (const SlotImage& size : sizes) {
    INFO(size.width_px << " x " << size.height_px);
    ScanSlot slot = depth_slot(size.width_px, size.height_px);
    REQUIRE(bench.registrar->view(slot, bench.view));
    CHECK(bench.view.count == kPixels);
    CHECK(bench.count_of(kUnlabelled) == kPixels);
    CHECK(bench.report().images_refused == ++refused);
  }
  CHECK(bench.report().refused == 0);
}

TEST_CASE("Registrar: a depth image of another size than its camera is refused") {
  Bench bench;
  ScanSlot slot = depth_slot(kWidth, kHeight);
  slot.height_px = kHeight - 1;
  CHECK_FALSE(bench.registrar->view(slot, bench.view));
  CHECK(bench.report().images_refused == 1);
  CHECK(bench.report().refused == 1);
}

}  // namespace
}  // namespace tessera
