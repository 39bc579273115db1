// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What of a map a picture shows: all but stray voxels, and those are counted.
#include "pictures/framing.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "pictures/picture.hpp"
#include "support/temporary_folder.hpp"

namespace tessera {
namespace {

using test::TemporaryFolder;

RenderVoxel voxel(int x, int y, int z) {
  const auto centre = [](int k) { return (static_cast<float>(k) + 0.5F) * 0.1F; };
  return {centre(x), centre(y), centre(z), {100, 150, 245}};
}

/// 4 m x 2 m.
std::vector<RenderVoxel> even_ground() {
  std::vector<RenderVoxel> voxels;
  for (int x = -20; x < 20; ++x) {
    for (int y = -10; y < 10; ++y) voxels.push_back(voxel(x, y, 0));
  }
  return voxels;
}

TEST_CASE("stray_limits: one value among a thousand that is far away does not count") {
  std::vector<float> values(1000);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i) * 0.1F;
  values.push_back(1.0e5F);
  const Interval interval = stray_limits(values);
  REQUIRE(interval.low <= 0.0F);
  REQUIRE(interval.low > -60.0F);
  REQUIRE(interval.high < 160.0F);
  REQUIRE(interval.high >= 99.9F);
}

TEST_CASE("Extent: the extremes of what is within the limits") {
  Extent extent({-1.0F, 10.0F});
  for (const float value : {3.0F, 9.0F, 2.0F, 11.0F, -5.0F}) extent.take(value);
  REQUIRE(extent.interval().low == Approx(2.0F));
  REQUIRE(extent.interval().high == Approx(9.0F));
}

TEST_CASE("make_scene: a thin tail belongs to the scene, however few voxels it has") {
  std::vector<RenderVoxel> voxels(100000);
  for (std::size_t i = 0; i < voxels.size(); ++i) voxels[i].x = 0.001F * static_cast<float>(i);
  voxels.push_back({120.0F, 0.0F, 0.0F, {}});
  const Scene scene = make_scene(voxels, 0.2F);
  REQUIRE(scene.x_m.low == Approx(-0.1F));
  REQUIRE(scene.x_m.high == Approx(120.1F));
}

TEST_CASE("write_png: a stray voxel that a view does not show is counted as left out") {
  const TemporaryFolder folder;
  std::vector<RenderVoxel> voxels = even_ground();
  voxels.push_back(voxel(9000, 9000, 9000));
  ImageOptions options;
  options.view = GENERATE(View::kTop, View::kOblique, View::kBoth);
  const Outcome<WriteReport> report = write_png(voxels, 0.1F, options, folder.file("map.png"));
  REQUIRE(report.ok());
  REQUIRE((*report).voxels == voxels.size() - 1);
  REQUIRE((*report).left_out == 1);
}

TEST_CASE("write_png: thin content at the edge is shown in each view") {
  const TemporaryFolder folder;
  std::vector<RenderVoxel> voxels = even_ground();
  for (int z = 0; z < 10; ++z) voxels.push_back(voxel(30, 14, z));
  ImageOptions options;
  options.view = GENERATE(View::kTop, View::kOblique, View::kBoth);
  const Outcome<WriteReport> report = write_png(voxels, 0.1F, options, folder.file("map.png"));
  REQUIRE(report.ok());
  REQUIRE((*report).left_out == 0);
}

}  // namespace
}  // namespace tessera
