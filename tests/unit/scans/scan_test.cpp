// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A scan keeps its memory, grows where it is asked to, and moves with its images.
#include "scans/scan.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <utility>

#include "base/allocation_counter.hpp"

namespace tessera {
namespace {

constexpr ScanLimits kSmall{
    .points = 2, .cameras = 1, .image_pixels = 6, .floats_per_point = 4, .weights = false};

TEST_CASE("Scan: memory is that of its limits") {
  CHECK(Scan::required_bytes(kSmall) == 2 * (4 + 1) * sizeof(float) + 2 + 6);
  ScanLimits live = kSmall;
  live.weights = true;
  live.floats_per_point = 3;
  CHECK(Scan::required_bytes(live) == 2 * (3 + 1 + 1) * sizeof(float) + 2 + 6);
  live.weighted_labels = 3;
  CHECK(Scan::required_bytes(live) == 2 * (3 + 1 + 1) * sizeof(float) + 2 * (3 + 3) + 6);
  Scan scan(kSmall);
  CHECK(scan.points().size() == 8);
  CHECK(scan.weights().empty());
  CHECK(scan.image_memory[0].memory.size() == 6);
  Scan empty;
  CHECK(empty.points().empty());
  CHECK(empty.view().count == 0);
}

TEST_CASE("Scan: it grows by reserve alone, and a larger one is left as it is") {
  Scan scan(kSmall);
  const auto before = heap_allocations();
  scan.reserve(2);
  CHECK(heap_allocations() == before);
  scan.reserve(5);
  CHECK(scan.points().size() == 20);
  CHECK(scan.components().size() == 5);
  CHECK(scan.limits().points == 5);
  CHECK(scan.label_weights().empty());
  scan.reserve(2, 3);
  CHECK(scan.limits().points == 5);
  CHECK(scan.components().size() == 15);
  CHECK(scan.label_weights().size() == 15);
  scan.reserve(1);
  CHECK(scan.limits().points == 5);
}

TEST_CASE("Scan: exchanging two exchanges their images, without the heap") {
  Scan a(kSmall);
  Scan b(kSmall);
  a.image_memory[0].memory[0] = 1;
  b.image_memory[0].memory[0] = 2;
  a.points()[0] = 1.0F;
  b.points()[0] = 2.0F;
  const auto before = heap_allocations();
  std::swap(a, b);
  CHECK(heap_allocations() == before);
  CHECK(a.image_memory[0].memory[0] == 2);
  CHECK(a.points()[0] == 2.0F);
  CHECK(b.image_memory[0].memory[0] == 1);
}

TEST_CASE("Scan: the points of a depth image replace it") {
  Scan scan(kSmall);
  scan.kind = ScanKind::kDepthImage;
  scan.num_images = 1;
  const std::array<float, 9> points{1, 2, 3, 4, 5, 6, 7, 8, 9};
  const std::array<std::uint8_t, 3> components{1, 2, 3};
  scan.become_cloud(
      {.points = points.data(), .stride_floats = 3, .count = 3, .components = components.data()});
  CHECK(scan.kind == ScanKind::kCloud);
  CHECK(scan.num_images == 0);
  const ScanView view = scan.view();
  REQUIRE(view.count == 3);
  CHECK(view.stride_floats == 4);
  CHECK(view.points[8] == 7.0F);
  CHECK(view.points[10] == 9.0F);
  CHECK(view.components[2] == 3);
}

TEST_CASE("Scan: clear leaves nothing of another scan") {
  Scan scan(kSmall);
  scan.count = 2;
  scan.has_times = scan.has_components = true;
  scan.num_images = 1;
  scan.num_poses = 3;
  scan.unknown.add(7);
  scan.T_map_sensor(0, 3) = 4.0;
  scan.clear();
  CHECK(scan.view().count == 0);
  CHECK(scan.view().components == nullptr);
  CHECK_FALSE(scan.has_times);
  CHECK(scan.images().empty());
  CHECK(scan.poses().empty());
  CHECK(scan.unknown.points == 0);
  CHECK(scan.T_map_sensor == Matrix34d(Matrix34d::Identity()));
}

}  // namespace
}  // namespace tessera
