// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// hear_sensors FOLDER COUNT SECONDS [CAMERAS]: hears COUNT scans and writes each into FOLDER: its
// points, its components, times and images, and a line of what else it says. Prints "ready" when it
// hears. CAMERAS: how many cameras' images raw clouds need, of up to 640 x 480.
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "base/monotonic_clock.hpp"
#include "scans/sensor_port.hpp"

namespace tessera {
namespace {

void write(const std::string& path, const void* bytes, std::size_t count) {
  std::ofstream(path, std::ios::binary)
      .write(static_cast<const char*>(bytes), static_cast<std::streamsize>(count));
}

void write_scan(const std::string& folder, int number, Scan& scan) {
  const std::string path = folder + "/" + std::to_string(number);
  write(path + ".xyz", scan.points().data(), std::size_t{12} * scan.count);
  const std::size_t labels = scan.count * scan.labels_per_point;
  write(path + ".components", scan.components().data(), scan.has_components ? labels : 0);
  write(path + ".label_weights", scan.label_weights().data(), scan.has_label_weights ? labels : 0);
  std::ofstream line(path + ".txt");
  line.precision(17);
  line << scan.stamp_us << ' ' << scan.sensor << ' ' << scan.num_poses;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) line << ' ' << scan.T_map_sensor(row, column);
  line << '\n';
  write(path + ".times", scan.times_s().data(), scan.has_times ? std::size_t{4} * scan.count : 0);
  std::ofstream images(path + ".images");
  for (const ScanImage& image : scan.images()) {
    images << image.camera << ' ' << image.stamp_us << ' ' << image.width_px << ' '
           << image.height_px << '\n';
    write(path + ".image" + std::to_string(image.camera), image.components().data(),
          image.components().size());
  }
}

int hear(const std::string& folder, int count, std::int64_t seconds, int cameras) {
  SensorPortConfig config;
  config.matcher.sensors = {{0, MountedKind::kSemanticCloud}, {0, MountedKind::kRawCloud}};
  for (int camera = 0; camera < cameras; ++camera) config.matcher.cameras.push_back(camera);
  config.matcher.slot = {.points = 150'000,
                         .image_pixels = cameras > 0 ? std::size_t{640} * 480 : 1,
                         .weighted_labels = kMostLabels};
  // What was recorded is older than what sensors send.
  config.matcher.max_age_us = 3'600'000'000;
  Outcome<std::unique_ptr<SensorPort>> port = SensorPort::open(config);
  if (!port.ok()) {
    std::fprintf(stderr, "hear_sensors: %s\n", port.failure().text().c_str());
    return EXIT_FAILURE;
  }
  std::puts("ready");
  std::fflush(stdout);
  const std::int64_t end_us = MonotonicClock::now_us() + seconds * 1'000'000;
  int heard = 0;
  while (heard < count && MonotonicClock::now_us() < end_us) {
    (*port)->step(10'000);
    for (Scan* scan = (*port)->front(); scan != nullptr; scan = (*port)->front()) {
      write_scan(folder, heard++, *scan);
      (*port)->pop();
    }
  }
  const SensorReport report = (*port)->report();
  std::printf("%d heard, %llu without pose, %llu dropped by the kernel\n", heard,
              static_cast<unsigned long long>(report.match.without_pose),
              static_cast<unsigned long long>(report.link.kernel_dropped));
  return heard == count ? EXIT_SUCCESS : EXIT_FAILURE;
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
  if (argc != 4 && argc != 5) return EXIT_FAILURE;
  return tessera::hear(argv[1], std::atoi(argv[2]), std::atoi(argv[3]),
                       argc == 5 ? std::atoi(argv[4]) : 0);
}
