// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Every mode against the brute-force sums on what a real sensor returned: two scans of the recorded
// street, cropped to 8 m around the sensor, thinned by the library, with the labels of the data
// set.
#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>

#include "oracle/agreement.hpp"
#include "oracle/given_files.hpp"

namespace tessera::oracle {
namespace {

constexpr float kCrop_m = 8.0F;
constexpr int kClasses = 24;

template <class T>
std::vector<T> read_all(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const auto bytes = static_cast<std::size_t>(std::filesystem::file_size(path));
  std::vector<T> items(bytes / sizeof(T));
  file.read(reinterpret_cast<char*>(items.data()),
            static_cast<std::streamsize>(items.size() * sizeof(T)));
  return items;
}

/// Labels of the data set as components in the order in which they occur; its 0 and 1 are no class.
class Components {
 public:
  int of(std::uint32_t label) {
    const std::uint32_t semantic = label & 0xffffU;
    if (semantic <= 1) return kClasses + 1;
    return seen_.emplace(semantic, static_cast<int>(seen_.size()) + 1).first->second;
  }

 private:
  std::map<std::uint32_t, int> seen_;
};

Cloud read_crop(const std::filesystem::path& folder, const std::string& scan,
                Components& components) {
  const std::vector<float> xyzi = read_all<float>(folder / "velodyne" / (scan + ".bin"));
  const std::vector<std::uint32_t> labels =
      read_all<std::uint32_t>(folder / "labels" / (scan + ".label"));
  REQUIRE(xyzi.size() == 4 * labels.size());
  Cloud cloud;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const float* const p = &xyzi[4 * i];
    if (std::abs(p[0]) > kCrop_m || std::abs(p[1]) > kCrop_m || std::abs(p[2]) > kCrop_m) continue;
    cloud.xyz.insert(cloud.xyz.end(), p, p + 3);
    cloud.components.push_back(static_cast<std::uint8_t>(components.of(labels[i])));
  }
  return cloud;
}

/// The robot's way from one scan to the next, roughly; nothing round in it.
Matrix34d pose_of(int scan) {
  Matrix34d T = Matrix34d::Identity();
  T.leftCols<3>() = Eigen::AngleAxisd(0.0123 * scan, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  T.col(3) = Eigen::Vector3d(0.837, 0.011, -0.007) * scan;
  return T;
}

}  // namespace

TEST_CASE("real scans: every mode gives the brute-force counts") {
  const std::optional<std::filesystem::path> folder = given_path("semantickitti_08");
  if (!folder) return;
  const InferenceMode mode =
      GENERATE(InferenceMode::kCounting, InferenceMode::kKernel, InferenceMode::kMultiEntropy);
  CAPTURE(static_cast<int>(mode));
  InferenceConfig config;
  config.mode = mode;
  config.free_space.enabled = false;
  config.kernel_length_m = 0.3F;
  if (mode == InferenceMode::kKernel)
    config.thinning_m = 0.2;  // the oracle visits every voxel of every ball
  MapConfig map_config = uncapped_map(0.1);
  map_config.storage_bytes = std::size_t{256} << 20U;
  Mapper mapper(map_config, config, kClasses, {.points = 150000, .tiles = 16384, .ray_blocks = 16});
  LabelOracle oracle(config, 0.1, kClasses);
  Components components;
  for (int scan = 0; scan < 2; ++scan) {
    const Cloud cloud = read_crop(*folder, "00000" + std::to_string(scan), components);
    REQUIRE(cloud.size() > 10000);
    const ScanReport report = mapper.integrate(cloud, pose_of(scan));
    REQUIRE(report.left_out() == 0);
    REQUIRE(report.admitted > 1000);
    oracle.add_scan(mapper.admitted());
  }
  const Agreement agreement = compare(mapper.map(), oracle, static_cast<double>(config.min_weight));
  INFO(agreement.text());
  CHECK(agreement.holds());
  CHECK(agreement.compared > 100000);
}

}  // namespace tessera::oracle
