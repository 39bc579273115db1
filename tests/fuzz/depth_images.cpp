// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <string_view>
#include <vector>

#include "fuzz/fuzz.hpp"
#include "pictures/png_image.hpp"
#include "scans/depth_folder.hpp"
#include "support/heap_peak.hpp"
#include "support/read_scan.hpp"
#include "support/reader_memory.hpp"
#include "support/temporary_folder.hpp"

namespace tessera::fuzz {

namespace {

constexpr std::string_view kCamera =
    "model = \"pinhole\"\nwidth = 8\nheight = 6\nfocal = [6, 6]\ncentre = [3.5, 2.5]\n"
    "depth_scale = 0.001\n";
constexpr std::string_view kPose = "1 0 0 0 0 1 0 0 0 0 1 0\n";

void check_failure(const Failure& failure) {
  require(!failure.text().empty() && failure.text().size() < 1024, "a message that nobody reads");
  for (const char letter : failure.text())
    require(static_cast<unsigned char>(letter) >= ' ' && letter != '\x7f',
            "a message of several lines, or with control characters");
}

std::string_view text_of(Bytes bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Of every kind of grey image, whatever stands beside its pixels.
void image(const std::string& path, std::size_t file_bytes) {
  std::vector<std::uint8_t> narrow(8 * 6);
  std::vector<std::uint16_t> wide(8 * 6);
  const test::HeapPeak peak;
  static_cast<void>(read_grey_png(path, 8, 6, narrow).ok());
  static_cast<void>(read_grey_png(path, 8, 6, GreyBits::kEightOrSixteen, wide).ok());
  require(peak.bytes() <= test::png_bytes(file_bytes, 8, 6, 16), "more memory than the stated sum");
}

}  // namespace

void depth_images(Bytes bytes) {
  static const test::TemporaryFolder folder;
  Input input(bytes);
  // What is not the one that is arbitrary stays intact: else nothing behind it is ever reached.
  const int kind = input.below(4);
  const std::size_t label_bytes = kind == 0 ? input.u16() : 0;
  const std::string_view labels = text_of(input.bytes(label_bytes));
  const std::string_view rest = text_of(input.rest());
  const bool is_image = kind == 0 || kind == 3;
  folder.write("depth/0.png", is_image ? rest : std::string_view());
  folder.write("labels/0.png", labels);
  folder.write("camera.toml", kind == 1 ? rest : kCamera);
  folder.write("poses.txt", kind == 2 ? rest : kPose);
  if (is_image) image(folder.file("depth/0.png"), rest.size());
  if (kind == 0) image(folder.file("labels/0.png"), labels.size());
  if (kind == 1) {
    const test::HeapPeak peak;
    static_cast<void>(parse_depth_camera(rest, "camera.toml").ok());
    require(peak.bytes() <= test::toml_bytes(rest.size()), "more memory than the stated sum");
  }
  DepthOptions options;
  if (kind == 0) options.label_images = folder.file("labels");
  options.intrinsics = folder.file("camera.toml");
  options.poses = folder.file("poses.txt");
  const Outcome<DepthFolder> images = DepthFolder::open(folder.file("depth"), options);
  if (!images.ok()) return check_failure(images.failure());
  require(images->num_scans() == 1, "another number of scans than of images");
  const Outcome<test::ReadScan> scan = test::read_scan(*images, 0);
  if (!scan.ok()) return check_failure(scan.failure());
  require(scan->depth.has_value(), "a depth image without its counters");
  const DepthReport& report = *scan->depth;
  require(report.status == Status::kOk, "an image that its camera does not take");
  require(report.points + report.no_depth + report.too_near + report.too_far + report.flying +
                  report.no_ray ==
              images->max_points(),
          "a pixel that is not counted");
  require(scan->num_points() == report.points, "other points than are counted");
  for (const std::uint8_t component : scan->components)
    require(component >= 1 && component <= images->classes().unlabelled(), "no component");
}

}  // namespace tessera::fuzz
