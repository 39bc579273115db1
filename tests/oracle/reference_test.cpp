// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Numbers that the reference implementation produced from two real scans. Its blocks hold voxels 2k
// - 1 and 2k, so points are moved by one voxel on each axis before they are integrated, and its
// prior is part of its counts.
#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <iostream>
#include <sstream>

#include "oracle/given_files.hpp"
#include "support/mapper.hpp"

namespace tessera::oracle {
namespace {

constexpr double kResolution_m = 0.3;
constexpr double kPrior = 0.001;
constexpr int kClasses = 20;

struct GoldenVoxel {
  int state = 0;
  std::map<int, double> counts;  ///< Prior included.
};
using Golden = std::map<Voxel, GoldenVoxel>;

std::vector<std::string> split(const std::string& line, char separator) {
  std::vector<std::string> parts;
  std::istringstream stream(line);
  for (std::string part; std::getline(stream, part, separator);) parts.push_back(part);
  return parts;
}

Cloud read_points(const std::filesystem::path& path) {
  std::ifstream file(path);
  Cloud cloud;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    const std::vector<std::string> parts = split(line, ',');
    cloud.add(std::stod(parts.at(0)), std::stod(parts.at(1)), std::stod(parts.at(2)),
              std::stoi(parts.at(3)));
  }
  return cloud;
}

/// Voxels with the indices that they have after the shift.
Golden read_voxels(const std::filesystem::path& path) {
  std::ifstream file(path);
  Golden golden;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    const std::vector<std::string> parts = split(line, ',');
    GoldenVoxel voxel{.state = std::stoi(parts.at(6)), .counts = {}};
    for (const std::string& pair : split(parts.size() > 7 ? parts[7] : "", ';')) {
      const std::size_t colon = pair.find(':');
      voxel.counts[std::stoi(pair.substr(0, colon))] = std::stod(pair.substr(colon + 1));
    }
    golden[{std::stoi(parts.at(0)) + 1, std::stoi(parts.at(1)) + 1, std::stoi(parts.at(2)) + 1}] =
        voxel;
  }
  return golden;
}

Matrix34d shift_by_a_voxel() {
  Matrix34d T = Matrix34d::Identity();
  T.col(3) = Eigen::Vector3d::Constant(kResolution_m);
  return T;
}

InferenceConfig reference_config(InferenceMode mode) {
  InferenceConfig config;
  config.mode = mode;
  config.min_weight = 0.0F;
  config.free_space.enabled = false;
  config.min_range_m = 0.0F;
  config.max_range_m = 0.0F;
  config.thinning_m = 0.0;
  return config;
}

/// Counts of the voxel that are not the golden ones to 2e-5 absolute + 1e-4 relative: the reference
/// sums in single precision, and its numbers come with this tolerance.
int wrong_counts(const VoxelEvidence& evidence, const GoldenVoxel& golden) {
  int wrong = 0;
  for (int component = 0; component <= kClasses; ++component) {
    const auto found = golden.counts.find(component);
    const double expected = found == golden.counts.end() ? kPrior : found->second;
    const double actual =
        kPrior + static_cast<double>(evidence.sigma[static_cast<std::size_t>(component)]);
    if (!(std::abs(actual - expected) <= 2e-5 + 1e-4 * expected)) ++wrong;
  }
  return wrong;
}

struct Comparison {
  int compared = 0;
  int missing = 0;
  int extra = 0;
  int wrong = 0;
  int other_state = 0;
};

Comparison compare_all(const LocalMap& map, const Golden& golden) {
  Comparison result;
  const std::map<Voxel, VoxelEvidence> observed = observed_voxels(map);
  for (const auto& [voxel, expected] : golden) {
    const auto found = observed.find(voxel);
    if (found == observed.end()) {
      ++result.missing;
      continue;
    }
    ++result.compared;
    if (wrong_counts(found->second, expected) > 0) ++result.wrong;
    const bool occupied = estimate(found->second, kPrior).state == VoxelState::kOccupied;
    if (occupied != (expected.state == 1)) ++result.other_state;
  }
  for (const auto& [voxel, evidence] : observed) result.extra += golden.count(voxel) == 0 ? 1 : 0;
  return result;
}

std::vector<Cloud> golden_scans(const std::filesystem::path& folder, const std::string& scans) {
  std::vector<Cloud> clouds{read_points(folder / "points_scan0.csv")};
  if (scans == "scan01") clouds.push_back(read_points(folder / "points_scan1.csv"));
  return clouds;
}

void integrate_all(Mapper& mapper, const std::vector<Cloud>& clouds) {
  for (const Cloud& cloud : clouds) {
    REQUIRE(cloud.size() > 1000);
    const ScanReport report = mapper.integrate(cloud, shift_by_a_voxel());
    REQUIRE(report.admitted == cloud.size());
  }
}

/// True iff every point nearer to the voxel's centre than length_m lies in the voxel's block of 2 x
/// 2 x 2 voxels or in one of that block's face neighbours.
bool within_reach_of_blocks(const Voxel& voxel, const std::vector<OraclePoint>& points,
                            double length_m) {
  for (const OraclePoint& point : points) {
    double square = 0.0;
    std::int64_t steps = 0;
    const Voxel block = cell_of(point.p, 2.0 * kResolution_m);
    for (std::size_t i = 0; i < 3; ++i) {
      const double d = (static_cast<double>(voxel[i]) + 0.5) * kResolution_m - point.p[i];
      square += d * d;
      const auto own = static_cast<std::int64_t>(std::floor(static_cast<double>(voxel[i]) / 2.0));
      steps += std::abs(block[i] - own);
    }
    if (square < (length_m + 1e-6) * (length_m + 1e-6) && steps > 1) return false;
  }
  return true;
}

}  // namespace

TEST_CASE("reference: multi-entropy gives the reference's voxels, states and counts") {
  const std::optional<std::filesystem::path> folder = given_path("../reference/golden");
  if (!folder) return;
  const bool one_label = GENERATE(true, false);
  const std::string scans = GENERATE(as<std::string>(), "scan0", "scan01");
  const std::string name =
      std::string(one_label ? "voxels_hd_see_" : "voxels_hd_test_") + scans + ".csv";
  CAPTURE(name);
  const Golden golden = read_voxels(*folder / name);
  REQUIRE(golden.size() > 1000);
  InferenceConfig config = reference_config(InferenceMode::kMultiEntropy);
  config.entropy.fill_one_label = one_label;
  Mapper mapper(uncapped_map(kResolution_m), config, kClasses);
  integrate_all(mapper, golden_scans(*folder, scans));
  const Comparison result = compare_all(mapper.map(), golden);
  CHECK(result.compared == static_cast<int>(golden.size()));
  CHECK(result.missing == 0);
  CHECK(result.extra == 0);
  CHECK(result.wrong == 0);
  CHECK(result.other_state == 0);
}

TEST_CASE(
    "reference: the kernel mode gives the S-BKI counts wherever block limits cut nothing off") {
  const std::optional<std::filesystem::path> folder = given_path("../reference/golden");
  if (!folder) return;
  const std::string scans = GENERATE(as<std::string>(), "scan0", "scan01");
  CAPTURE(scans);
  const Golden golden = read_voxels(*folder / ("voxels_hd_raw_" + scans + "_ell0.3_sf0.1.csv"));
  REQUIRE(golden.size() > 1000);
  InferenceConfig config = reference_config(InferenceMode::kKernel);
  config.kernel_length_m = 0.3F;
  config.kernel_scale = 0.1F;
  Mapper mapper(uncapped_map(kResolution_m), config, kClasses);
  std::vector<OraclePoint> points;
  for (const Cloud& cloud : golden_scans(*folder, scans)) {
    integrate_all(mapper, {cloud});
    for (const OraclePoint& point : mapper.admitted()) points.push_back(point);
  }
  int compared = 0;
  int wrong = 0;
  int cut = 0;
  for (const auto& [voxel, expected] : golden) {
    if (!within_reach_of_blocks(voxel, points, 0.3)) {
      ++cut;
      continue;
    }
    if (expected.counts.empty()) continue;
    ++compared;
    const VoxelCoord at{static_cast<int>(voxel[0]), static_cast<int>(voxel[1]),
                        static_cast<int>(voxel[2])};
    if (wrong_counts(mapper.map().evidence(at), expected) > 0) ++wrong;
  }
  std::cout << "S-BKI " << scans << ": " << compared << " observed voxels compared, " << cut
            << " cut off by blocks\n";
  CHECK(compared > 500);
  CHECK(wrong == 0);
}

}  // namespace tessera::oracle
