// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What becomes of a scan before it is integrated: depths, labels of cameras, motion.
#include "scans/registrar.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <memory>

#include "base/allocation_counter.hpp"

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
  config.limits = {.points = kPixels, .cameras = 1, .image_pixels = kPixels};
  config.depth.step_px = 1;
  config.depth_camera = 0;
  return config;
}

/// A wall 2 m ahead, and one label throughout.
Scan depth_slot(std::int32_t label_width_px, std::int32_t label_height_px) {
  Scan slot(depth_config().limits);
  slot.kind = ScanKind::kDepthImage;
  slot.width_px = kWidth;
  slot.height_px = kHeight;
  std::fill(slot.points().begin(), slot.points().end(), 2.0F);
  slot.num_images = 1;
  ScanImage& labels = slot.image_memory[0];
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
  Scan slot = depth_slot(kWidth, kHeight);
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
  const ScanImage sizes[] = {{.width_px = 48, .height_px = 1},
                             {.width_px = kWidth, .height_px = 1},
                             {.width_px = kWidth, .height_px = kHeight - 1}};
  for (const ScanImage& size : sizes) {
    INFO(size.width_px << " x " << size.height_px);
    Scan slot = depth_slot(size.width_px, size.height_px);
    REQUIRE(bench.registrar->view(slot, bench.view));
    CHECK(bench.view.count == kPixels);
    CHECK(bench.count_of(kUnlabelled) == kPixels);
    CHECK(bench.report().images_refused == ++refused);
  }
  CHECK(bench.report().refused == 0);
}

TEST_CASE("Registrar: a depth image of another size than its camera is refused") {
  Bench bench;
  Scan slot = depth_slot(kWidth, kHeight);
  slot.height_px = kHeight - 1;
  CHECK_FALSE(bench.registrar->view(slot, bench.view));
  CHECK(bench.report().images_refused == 1);
  CHECK(bench.report().refused == 1);
}

/// Two cameras that look along the scanner's x; a point 8 m ahead.
struct Labelled {
  static RegistrarConfig config() {
    RegistrarConfig config = depth_config();
    config.depth_camera = -1;
    config.cameras.push_back(config.cameras[0]);
    for (CameraDescription& camera : config.cameras)
      camera.T_camera_lidar << 0, -1, 0, 0, 0, 0, -1, 0, 1, 0, 0, 0;
    config.limits = {.points = 4, .cameras = 2, .image_pixels = kPixels};
    return config;
  }
  Labelled() : scan(config().limits) {
    Outcome<std::unique_ptr<Registrar>> made = Registrar::make(config());
    REQUIRE(made.ok());
    registrar = std::move(*made);
    scan.count = 1;
    scan.points()[0] = 8.0F;
    scan.num_images = 2;
    for (std::int32_t i = 0; i < 2; ++i) {
      ScanImage& image = scan.image_memory[static_cast<std::size_t>(i)];
      image.camera = i;
      image.width_px = kWidth;
      image.height_px = kHeight;
      std::fill(image.memory.begin(), image.memory.end(), static_cast<std::uint8_t>(kLabel + i));
    }
  }
  [[nodiscard]] RegistrarReport report() const {
    RegistrarReport report;
    static_cast<void>(registrar->report().get(report));
    return report;
  }

  std::unique_ptr<Registrar> registrar;
  Scan scan;
  ScanView view{};
};

TEST_CASE("Registrar: an image without a pose keeps its place in the record, and labels nothing") {
  Labelled bench;
  bench.scan.image_memory[0].stamp_us = 10'000;
  REQUIRE(bench.registrar->view(bench.scan, bench.view));
  CHECK(bench.view.components[0] == kLabel + 1);
  const RegistrationRecord& record = bench.registrar->last();
  REQUIRE(record.projection);
  CHECK(record.projection->cameras[0].status == Status::kOutOfRange);
  CHECK(record.projection->cameras[1].labelled == 1);
  CHECK(bench.report().images_without_pose == 1);
  CHECK(bench.report().labelled == 1);
  CHECK(bench.report().projected_points == 1);
}

TEST_CASE("Registrar: an image of no camera, or of another size, is refused and counted") {
  Labelled bench;
  bench.scan.image_memory[0].camera = 2;
  bench.scan.image_memory[1].width_px = kWidth - 1;
  REQUIRE(bench.registrar->view(bench.scan, bench.view));
  CHECK(bench.view.components[0] == kUnlabelled);
  CHECK(bench.report().images_refused == 2);
  CHECK(bench.report().images_without_pose == 0);
}

TEST_CASE("Registrar: labels that a scan has stay, and its images are not read") {
  Labelled bench;
  bench.scan.has_components = true;
  bench.scan.components()[0] = 2;
  REQUIRE(bench.registrar->view(bench.scan, bench.view));
  CHECK(bench.view.components[0] == 2);
  CHECK_FALSE(bench.registrar->last().projection);
}

TEST_CASE("Registrar: motion is corrected by the scan's poses, or by those of its recording") {
  // From -0.1 s to 0.1 s the robot drives 2 m; the recording has it drive 4 m.
  const auto pose = [](std::int64_t stamp_us, double x) {
    StampedPose at{.stamp_us = stamp_us, .T_map_body = Matrix34d::Identity()};
    at.T_map_body(0, 3) = x;
    return at;
  };
  Labelled bench;
  bench.scan.num_images = 0;
  bench.scan.has_times = true;
  bench.scan.times_s()[0] = 0.05F;
  bench.scan.num_poses = 3;
  for (std::size_t i = 0; i < 3; ++i)
    bench.scan.pose_memory[i] =
        pose(static_cast<std::int64_t>(i) * 100'000 - 100'000, static_cast<double>(i));
  REQUIRE(bench.registrar->view(bench.scan, bench.view));
  CHECK(bench.view.points[0] == Approx(8.5F));

  ArenaMemory memory(PoseTrack::required_bytes(3));
  Arena arena(memory.span());
  Result<PoseTrack> track = PoseTrack::make(3, arena);
  REQUIRE(track.ok());
  for (int i = 0; i < 3; ++i)
    REQUIRE(track->add(pose(i * 100'000 - 100'000, 2.0 * i)) == Status::kOk);
  bench.scan.points()[0] = 8.0F;
  bench.scan.track = &*track;
  REQUIRE(bench.registrar->view(bench.scan, bench.view));
  CHECK(bench.view.points[0] == Approx(9.0F));
  CHECK(bench.report().deskewed == 2);
  CHECK(bench.report().moved == 2);

  bench.scan.stamp_us = 1'000'000;
  REQUIRE(bench.registrar->view(bench.scan, bench.view));
  CHECK(bench.view.points[0] == Approx(9.0F));
  CHECK(bench.report().not_deskewed == 1);
}

TEST_CASE("Registrar: it uses no heap once it is made") {
  Labelled bench;
  const auto before = heap_allocations();
  const bool made = bench.registrar->view(bench.scan, bench.view);
  CHECK(heap_allocations() == before);
  CHECK(made);
}

}  // namespace
}  // namespace tessera
