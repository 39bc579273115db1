// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What write_png promises: a real PNG of the asked width, colours where the voxels are, and clean
// failures.
#include <png.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "pictures/picture.hpp"
#include "support/temporary_folder.hpp"

namespace tessera {
namespace {

using test::TemporaryFolder;

constexpr Color kRoad{255, 0, 255};
constexpr Color kCar{100, 150, 245};
constexpr Color kGrass{150, 240, 80};

struct Picture {
  int width = 0;
  int height = 0;
  std::vector<Color> pixels;

  [[nodiscard]] Color at(int x, int y) const {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
};

Picture read_png(const std::string& path) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  REQUIRE(png_image_begin_read_from_file(&image, path.c_str()) != 0);
  image.format = PNG_FORMAT_RGB;
  Picture picture{static_cast<int>(image.width), static_cast<int>(image.height), {}};
  picture.pixels.resize(static_cast<std::size_t>(image.width) * image.height);
  REQUIRE(png_image_finish_read(&image, nullptr, picture.pixels.data(), 0, nullptr) != 0);
  return picture;
}

std::size_t count_color(const Picture& picture, Color color) {
  return static_cast<std::size_t>(std::count(picture.pixels.begin(), picture.pixels.end(), color));
}

/// Mean position of the pixels of exactly this colour.
std::pair<double, double> centre_of(const Picture& picture, Color color) {
  double x_sum = 0.0;
  double y_sum = 0.0;
  double count = 0.0;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      if (picture.at(x, y) != color) continue;
      x_sum += x;
      y_sum += y;
      count += 1.0;
    }
  }
  REQUIRE(count > 0.0);
  return {x_sum / count, y_sum / count};
}

RenderVoxel voxel(int x, int y, int z, Color color) {
  const auto centre = [](int k) { return (static_cast<float>(k) + 0.5F) * 0.1F; };
  return {centre(x), centre(y), centre(z), color};
}

/// Even ground of 4 m x 2 m: grass for y < 0, road for y >= 0.
std::vector<RenderVoxel> flat_scene() {
  std::vector<RenderVoxel> voxels;
  for (int x = -20; x < 20; ++x) {
    for (int y = -10; y < 10; ++y) voxels.push_back(voxel(x, y, 0, y < 0 ? kGrass : kRoad));
  }
  return voxels;
}

ImageOptions top_view(int width_px = 600) {
  ImageOptions options;
  options.width_px = width_px;
  options.view = View::kTop;
  return options;
}

Picture draw(const std::vector<RenderVoxel>& voxels, const ImageOptions& options) {
  const TemporaryFolder folder;
  const Outcome<WriteReport> report = write_png(voxels, 0.1F, options, folder.file("map.png"));
  INFO(report.failure().text());
  REQUIRE(report.ok());
  return read_png(folder.file("map.png"));
}

TEST_CASE("write_png: the file starts with the PNG signature") {
  const TemporaryFolder folder;
  REQUIRE(write_png(flat_scene(), 0.1F, {}, folder.file("map.png")).ok());
  REQUIRE(folder.read("map.png").substr(0, 8) == "\x89PNG\r\n\x1a\n");
}

TEST_CASE("write_png: the picture is as wide as asked") {
  const int width_px = GENERATE(600, 777, 1600);
  ImageOptions options;
  options.width_px = width_px;
  REQUIRE(draw(flat_scene(), options).width == width_px);
}

TEST_CASE("write_png: the same voxels give the same bytes") {
  const TemporaryFolder folder;
  REQUIRE(write_png(flat_scene(), 0.1F, {}, folder.file("a.png")).ok());
  REQUIRE(write_png(flat_scene(), 0.1F, {}, folder.file("b.png")).ok());
  REQUIRE(folder.read("a.png") == folder.read("b.png"));
}

TEST_CASE("write_png: even ground has exactly its classes' colours from above") {
  const Picture picture = draw(flat_scene(), top_view());
  const std::size_t ground = count_color(picture, kRoad) + count_color(picture, kGrass);
  // 4 m x 2 m fill nearly all of a picture that is fitted to them.
  REQUIRE(ground > picture.pixels.size() * 6 / 10);
}

TEST_CASE("write_png: +y is up from above") {
  const Picture picture = draw(flat_scene(), top_view());
  REQUIRE(centre_of(picture, kRoad).second < centre_of(picture, kGrass).second - 20.0);
}

TEST_CASE("write_png: content that is longer along y is turned, +y to the right") {
  std::vector<RenderVoxel> voxels;
  for (int x = -5; x < 5; ++x) {
    for (int y = -20; y < 20; ++y) voxels.push_back(voxel(x, y, 0, y < 0 ? kGrass : kRoad));
  }
  const Picture picture = draw(voxels, top_view());
  REQUIRE(centre_of(picture, kRoad).first > centre_of(picture, kGrass).first + 50.0);
}

TEST_CASE("write_png: the highest voxel hides those below it") {
  std::vector<RenderVoxel> voxels = flat_scene();
  for (int x = -20; x < 20; ++x) {
    for (int y = -10; y < 10; ++y) voxels.push_back(voxel(x, y, 3, kCar));
  }
  const Picture picture = draw(voxels, top_view());
  REQUIRE(count_color(picture, kCar) > 0);
  REQUIRE(count_color(picture, kRoad) + count_color(picture, kGrass) == 0);
}

TEST_CASE("write_png: what is high above the ground lets the ground shine through") {
  std::vector<RenderVoxel> voxels = flat_scene();
  for (int x = -20; x < 20; ++x) {
    for (int y = -10; y < 10; ++y) voxels.push_back(voxel(x, y, 60, kCar));
  }
  ImageOptions options = top_view();
  options.translucent_above_m = 3.0F;
  REQUIRE(count_color(draw(voxels, options), kCar) == 0);
  options.translucent_above_m = std::numeric_limits<float>::infinity();
  REQUIRE(count_color(draw(voxels, options), kCar) > 0);
}

TEST_CASE("write_png: one stray voxel far away does not shrink the rest") {
  std::vector<RenderVoxel> voxels = flat_scene();
  voxels.push_back(voxel(9000, 9000, 9000, kCar));
  const Picture picture = draw(voxels, top_view());
  REQUIRE(count_color(picture, kRoad) > picture.pixels.size() / 5);
}

TEST_CASE("write_png: the oblique view shows the top, and both kinds of sides darker") {
  std::vector<RenderVoxel> voxels;
  for (int i = 0; i < 8 * 8 * 8; ++i) voxels.push_back(voxel(i % 8, i / 8 % 8, i / 64, kGrass));
  ImageOptions options;
  options.width_px = 600;
  options.view = View::kOblique;
  const Picture picture = draw(voxels, options);
  REQUIRE(count_color(picture, kGrass) > 500);
  const auto darker = std::count_if(picture.pixels.begin(), picture.pixels.end(), [](Color c) {
    return c.g > 60 && c.g < 225 && c.g > c.r + 25 && c.r > c.b + 15;
  });
  REQUIRE(darker > 500);
}

TEST_CASE("write_png: the legend shows the classes that occur and no others") {
  ImageOptions options = top_view();
  const std::vector<RenderVoxel> voxels = flat_scene();
  const int without = draw(voxels, options).height;
  options.legend = {{"car", kCar}};
  REQUIRE(draw(voxels, options).height == without);
  options.legend = {{"car", kCar}, {"road", kRoad}};
  REQUIRE(draw(voxels, options).height > without);
}

TEST_CASE("write_png: a title adds a line of text") {
  ImageOptions options = top_view();
  const int without = draw(flat_scene(), options).height;
  options.title = "A street, 0.1 m";
  REQUIRE(draw(flat_scene(), options).height > without);
}

TEST_CASE("write_png: without voxels there is still a picture, and it has writing on it") {
  const Picture picture = draw({}, top_view());
  REQUIRE(picture.width == 600);
  REQUIRE(count_color(picture, Color{110, 115, 123}) > 50);
}

TEST_CASE("write_png: a single voxel can be drawn") {
  const View view = GENERATE(View::kTop, View::kOblique, View::kBoth);
  ImageOptions options = top_view();
  options.view = view;
  REQUIRE(count_color(draw({voxel(3, -4, 5, kCar)}, options), kCar) > 100);
}

TEST_CASE("write_png: voxels that are not finite or absurdly far are left out and counted") {
  const TemporaryFolder folder;
  std::vector<RenderVoxel> voxels = flat_scene();
  const std::size_t good = voxels.size();
  const float bad = GENERATE(std::numeric_limits<float>::quiet_NaN(),
                             std::numeric_limits<float>::infinity(), -1.0e30F);
  voxels.push_back({bad, 0.0F, 0.0F, kCar});
  voxels.push_back({0.0F, bad, 0.0F, kCar});
  voxels.push_back({0.0F, 0.0F, bad, kCar});
  const Outcome<WriteReport> report = write_png(voxels, 0.1F, {}, folder.file("map.png"));
  REQUIRE(report.ok());
  REQUIRE((*report).voxels == good);
  REQUIRE((*report).left_out == 3);
}

TEST_CASE("write_png: options out of range are refused and nothing is written") {
  const TemporaryFolder folder;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto refused = [&](float resolution_m, const ImageOptions& options) {
    const Outcome<WriteReport> report =
        write_png(flat_scene(), resolution_m, options, folder.file("map.png"));
    return !report.ok() && report.failure().kind == FailureKind::kUsage &&
           folder.num_entries() == 0;
  };
  ImageOptions narrow;
  narrow.width_px = ImageOptions::kMinWidthPx - 1;
  ImageOptions wide;
  wide.width_px = ImageOptions::kMaxWidthPx + 1;
  REQUIRE(refused(0.0F, {}));
  REQUIRE(refused(-0.1F, {}));
  REQUIRE(refused(nan, {}));
  REQUIRE(refused(0.1F, narrow));
  REQUIRE(refused(0.1F, wide));
}

TEST_CASE("write_png: a folder that does not exist is refused with the path in the message") {
  const TemporaryFolder folder;
  const std::string path = folder.file("missing/map.png");
  const Outcome<WriteReport> report = write_png(flat_scene(), 0.1F, {}, path);
  REQUIRE_FALSE(report.ok());
  REQUIRE(report.failure().kind == FailureKind::kUsage);
  REQUIRE_THAT(report.failure().text(), Catch::Contains(path));
  REQUIRE(folder.num_entries() == 0);
}

TEST_CASE("write_png: an earlier picture is replaced and no temporary file stays") {
  const TemporaryFolder folder;
  folder.write("map.png", "old");
  REQUIRE(write_png(flat_scene(), 0.1F, {}, folder.file("map.png")).ok());
  REQUIRE(folder.num_entries() == 1);
  REQUIRE(read_png(folder.file("map.png")).width == 1600);
}

}  // namespace
}  // namespace tessera
