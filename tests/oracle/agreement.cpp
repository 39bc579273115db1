// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "oracle/agreement.hpp"

#include <cmath>
#include <sstream>

namespace tessera::oracle {

namespace {

constexpr double kRelative = 1e-5;
constexpr double kAbsolute = 1e-6;

std::string name_of(const Voxel& voxel) {
  std::ostringstream text;
  text << "voxel " << voxel[0] << ' ' << voxel[1] << ' ' << voxel[2];
  return text.str();
}

void note(Agreement& agreement, const std::string& what) {
  if (agreement.first.empty()) agreement.first = what;
}

void compare_voxel(const Voxel& voxel, const VoxelEvidence& evidence,
                   const std::map<int, OracleCount>& counts, double min_weight,
                   Agreement& agreement) {
  for (int component = 0; component < evidence.num_components; ++component) {
    const auto found = counts.find(component);
    const OracleCount expected = found == counts.end() ? OracleCount{} : found->second;
    const auto actual = static_cast<double>(evidence.sigma[static_cast<std::size_t>(component)]);
    const double tolerance =
        kRelative * expected.sum + kAbsolute + expected.doubtful * (min_weight + 2e-6);
    const double difference = std::abs(actual - expected.sum);
    ++agreement.compared;
    agreement.worst = std::fmax(agreement.worst, difference / tolerance);
    if (difference <= tolerance) continue;
    ++agreement.wrong;
    std::ostringstream text;
    text.precision(9);
    text << name_of(voxel) << " component " << component << ": map " << actual << ", oracle "
         << expected.sum << " from " << expected.added << " + " << expected.doubtful << " doubtful";
    note(agreement, text.str());
  }
}

}  // namespace

std::string Agreement::text() const {
  std::ostringstream text;
  text << compared << " counts compared, " << missing << " voxels missing, " << extra << " extra, "
       << wrong << " wrong; worst " << worst << " of the tolerance; " << first;
  return text.str();
}

Agreement compare(const LocalMap& map, const LabelOracle& oracle, double min_weight) {
  Agreement agreement;
  const std::map<Voxel, VoxelEvidence> observed = observed_voxels(map);
  for (const auto& [voxel, counts] : oracle.voxels()) {
    const auto found = observed.find(voxel);
    if (found != observed.end()) {
      compare_voxel(voxel, found->second, counts, min_weight, agreement);
      continue;
    }
    int certain = 0;
    for (const auto& [component, count] : counts) certain += count.added;
    if (certain == 0) continue;
    ++agreement.missing;
    note(agreement, name_of(voxel) + " is missing");
  }
  for (const auto& [voxel, evidence] : observed) {
    if (oracle.voxels().count(voxel) != 0) continue;
    ++agreement.extra;
    note(agreement, name_of(voxel) + " is extra");
  }
  return agreement;
}

}  // namespace tessera::oracle
