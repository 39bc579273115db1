// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// cameras.toml is read in full or refused with file, line and remedy; scans get the labels of the
// cameras' images.
#include <catch2/catch.hpp>

#include "pictures/png_image.hpp"
#include "sample_dataset.hpp"
#include "scans/cameras_toml.hpp"
#include "scans/dataset.hpp"
#include "support/read_scan.hpp"

namespace tessera {
namespace {

using Catch::Matchers::Contains;
using test::SampleDataset;

/// Looks along the scanner's x.
const std::string kCamera =
    "[[camera]]\n"
    "name = \"front\"\n"
    "folder = \"images\"\n"
    "model = \"pinhole\"\n"
    "width = 64\n"
    "height = 48\n"
    "focal = [40, 41.5]\n"
    "centre = [31.5, 23.5]\n"
    "T_camera_lidar = [0, -1, 0, 0.5, 0, 0, -1, 0, 1, 0, 0, 0]\n";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  REQUIRE(text.find(from) != std::string::npos);
  return text.replace(text.find(from), from.size(), to);
}

TEST_CASE("cameras.toml: a camera with what it needs, and one with all there is") {
  const Outcome<std::vector<CameraDescription>> cameras = parse_cameras(
      kCamera +
          "[[camera]]\nname = \"rear\"\nfolder = \"b\"\nmask = \"m.png\"\nmodel = \"fisheye\"\n"
          "width = 640\nheight = 480\nfocal = [200, 201]\ncentre = [320, 240]\n"
          "distortion = [-0.01, 0.002, 0, 0]\nstamp_offset = -0.0305\n"
          "T_camera_lidar = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]\n",
      "c.toml");
  REQUIRE(cameras.ok());
  REQUIRE(cameras->size() == 2);
  const CameraDescription& front = (*cameras)[0];
  CHECK(front.name == "front");
  CHECK(front.folder == "images");
  CHECK(front.mask.empty());
  CHECK(front.offset_us == 0);
  CHECK(front.model.intrinsics().focal_y_px == 41.5);
  CHECK(front.T_camera_lidar(0, 3) == 0.5);
  CHECK(front.T_camera_lidar(1, 2) == -1.0);
  const CameraDescription& rear = (*cameras)[1];
  CHECK(rear.offset_us == -30'500);
  CHECK(rear.mask == "m.png");
  CHECK(rear.model.intrinsics().kind == CameraKind::kFisheye);
  CHECK(rear.model.intrinsics().distortion[1] == 0.002);
}

TEST_CASE("cameras.toml: what is wrong is told with file, line and remedy") {
  struct Case {
    const char* from;
    const char* to;
    const char* line;
    const char* says;
  };
  const Case cases[] = {
      {"name = \"front\"\n", "", "line 1", "no 'name'"},
      {"model = \"pinhole\"\n", "", "line 1", "no 'model'"},
      {"width = 64\n", "", "line 1", "no 'width'"},
      {"focal = [40, 41.5]\n", "", "line 1", "no 'focal'"},
      {"T_camera_lidar", "T_lidar_camera", "line 9", "unknown key 'T_lidar_camera'"},
      {"\"pinhole\"", "\"omni\"", "line 4", "\"pinhole\" or \"fisheye\""},
      {"width = 64", "width = 0", "line 5", "whole number of pixels"},
      {"width = 64", "width = 64.5", "line 5", "whole number of pixels"},
      {"height = 48", "height = 20000", "line 6", "1 to 16384"},
      {"[40, 41.5]", "[40]", "line 7", "two numbers"},
      {"[40, 41.5]", "[40, \"x\"]", "line 7", "two numbers"},
      {"[40, 41.5]", "[40, nan]", "line 7", "two numbers"},
      {"[40, 41.5]", "[0, 41.5]", "line 7", "above 0"},
      {"[31.5, 23.5]", "31.5", "line 8", "two numbers"},
      {"0, 1, 0, 0, 0]", "0, 1, 0, 0]", "line 9", "12 numbers"},
      {"[0, -1, 0, 0.5", "[0, -2, 0, 0.5", "line 9", "rigid"},
      {"name = \"front\"", "name = \"\"", "line 2", "in quotes"},
      {"name = \"front\"", "name = 7", "line 2", "in quotes"},
      {"name = \"front\"", "name = front", "line 2", "fix the syntax"},
  };
  for (const Case& c : cases) {
    INFO(c.from << " -> " << c.to);
    const Outcome<std::vector<CameraDescription>> cameras =
        parse_cameras(replaced(kCamera, c.from, c.to), "c.toml");
    REQUIRE_FALSE(cameras.ok());
    CHECK_THAT(cameras.failure().text(),
               Contains("c.toml") && Contains(c.line) && Contains(c.says));
  }
  const auto message = [](const std::string& text) {
    const Outcome<std::vector<CameraDescription>> cameras = parse_cameras(text, "c.toml");
    return cameras.ok() ? std::string() : cameras.failure().text();
  };
  CHECK_THAT(message(kCamera + "distortion = [1, 2, 3]\n"), Contains("[k1, k2, p1, p2, k3]"));
  CHECK_THAT(message(kCamera + "distortion = [-0.9, 0]\n"), Contains("folds"));
  CHECK_THAT(message(kCamera + "stamp_offset = 11\n"), Contains("-10 to 10"));
  CHECK_THAT(message(kCamera + kCamera), Contains("duplicate name 'front'"));
  CHECK_THAT(message(""), Contains("no [[camera]]"));
  CHECK_THAT(message("camera = 3\n"), Contains("no [[camera]]"));
  std::string many;
  for (int i = 0; i < 7; ++i)
    many += replaced(kCamera, "\"front\"", "\"camera " + std::to_string(i) + "\"");
  CHECK_THAT(message(many), Contains("has 7 cameras"));
}

void write_image(const SampleDataset& sample, const std::string& name, std::uint8_t label,
                 int width = 64, int height = 48) {
  const std::vector<std::uint8_t> pixels(static_cast<std::size_t>(width * height), label);
  const auto png = encode_png({width, height, 1, pixels.data()});
  REQUIRE(png.ok());
  sample.folder().write(name, {reinterpret_cast<const char*>(png->data()), png->size()});
}

/// Three scans with points ahead and behind, and their images.
void write_cameras(const SampleDataset& sample, const std::string& toml = kCamera) {
  sample.folder().write("cameras.toml", toml);
  for (int scan = 0; scan < 3; ++scan)
    write_image(sample, test::scan_name("images", scan, ".png"),
                static_cast<std::uint8_t>(4 + scan));
  sample.write_points(1, {8.0F, 0.0F, 0.0F, 0.0F, -8.0F, 0.0F, 0.0F, 0.0F});
}

Outcome<Dataset> open_with_cameras(const SampleDataset& sample) {
  return Dataset::open(sample.dir(), {.first = {}, .last = {}, .labels = "cameras"});
}

TEST_CASE("camera labels: a point takes the class of its pixel, others are unlabelled") {
  const SampleDataset sample;
  write_cameras(sample);
  const Outcome<Dataset> dataset = open_with_cameras(sample);
  REQUIRE(dataset.ok());
  REQUIRE(dataset->cameras().size() == 1);
  const Outcome<test::ReadScan> scan = test::read_scan(*dataset, 1);
  REQUIRE(scan.ok());
  CHECK(scan->components[0] == 5);
  CHECK(scan->components[1] == 20);
  REQUIRE(scan->projection);
  CHECK(scan->projection->labelled == 1);
  CHECK(scan->projection->cameras[0].behind == 1);
}

TEST_CASE("camera labels: a mask keeps the robot itself out") {
  const SampleDataset sample;
  write_cameras(sample, kCamera + "mask = \"mask.png\"\n");
  write_image(sample, "mask.png", 0);
  const Outcome<Dataset> dataset = open_with_cameras(sample);
  REQUIRE(dataset.ok());
  const Outcome<test::ReadScan> scan = test::read_scan(*dataset, 1);
  REQUIRE(scan.ok());
  CHECK(scan->components[0] == 20);
  CHECK(scan->projection->cameras[0].masked == 1);
}

TEST_CASE("camera labels: an image of another time is met where the camera was then") {
  const SampleDataset sample;
  write_cameras(sample, kCamera + "stamp_offset = 0.05\n");
  Outcome<Dataset> dataset = open_with_cameras(sample);
  REQUIRE_FALSE(dataset.ok());
  CHECK_THAT(dataset.failure().text(), Contains("times.txt"));
  sample.folder().write("times.txt", "0\n0.1\n0.2\n");
  // From scan 1 to its image the robot drives 10 m: past the point ahead.
  sample.folder().write("poses_dense.txt",
                        "0.05 1 0 0 0 0 1 0 0 0 0 1 0\n0.1 1 0 0 0 0 1 0 0 0 0 1 0\n"
                        "0.2 1 0 0 20 0 1 0 0 0 0 1 0\n");
  dataset = open_with_cameras(sample);
  REQUIRE(dataset.ok());
  const Outcome<test::ReadScan> scan = test::read_scan(*dataset, 1);
  REQUIRE(scan.ok());
  CHECK(scan->components[0] == 20);
  CHECK(scan->projection->cameras[0].behind == 2);
  // The last scan's image is after all poses.
  const Outcome<test::ReadScan> last = test::read_scan(*dataset, 2);
  REQUIRE(last.ok());
  CHECK(last->projection->cameras[0].status == Status::kOutOfRange);
  CHECK(last->projection->labelled == 0);
}

TEST_CASE("camera labels: what is missing or damaged is told by its name") {
  const auto failure = [](const auto& change) {
    const SampleDataset sample;
    write_cameras(sample);
    change(sample);
    const Outcome<Dataset> dataset = open_with_cameras(sample);
    if (!dataset.ok()) return dataset.failure().text();
    const Outcome<test::ReadScan> scan = test::read_scan(*dataset, 1);
    return scan.ok() ? std::string() : scan.failure().text();
  };
  CHECK(failure([](const SampleDataset&) {}).empty());
  CHECK_THAT(failure([](const SampleDataset& s) { s.remove("cameras.toml"); }),
             Contains("cameras.toml does not exist") && Contains("--labels"));
  CHECK_THAT(failure([](const SampleDataset& s) { s.remove("images/000001.png"); }),
             Contains("images/000001.png") && Contains("'front'"));
  CHECK_THAT(failure([](const SampleDataset& s) { write_image(s, "images/000001.png", 1, 65); }),
             Contains("images/000001.png") && Contains("65 x 48"));
  CHECK_THAT(failure([](const SampleDataset& s) { s.folder().write("images/000001.png", "PNG"); }),
             Contains("images/000001.png") && Contains("intact"));
  CHECK_THAT(failure([](const SampleDataset& s) {
               s.folder().write("cameras.toml", replaced(kCamera, "folder = \"images\"\n", ""));
             }),
             Contains("'front' has no folder"));
  CHECK_THAT(failure([](const SampleDataset& s) {
               s.folder().write("cameras.toml", kCamera + "mask = \"mask.png\"\n");
             }),
             Contains("mask.png"));
}

}  // namespace
}  // namespace tessera
