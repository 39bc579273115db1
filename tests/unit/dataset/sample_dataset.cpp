// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "sample_dataset.hpp"

#include <cstdio>
#include <filesystem>
#include <string_view>

namespace tessera::test {
namespace {

template <class T>
std::string_view as_text(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

}  // namespace

std::string scan_name(const std::string& folder, int scan, const char* extension) {
  char name[32];
  std::snprintf(name, sizeof name, "%06d%s", scan, extension);
  return folder + "/" + name;
}

SampleDataset::SampleDataset(int num_scans) {
  std::string poses;
  for (int scan = 0; scan < num_scans; ++scan) {
    const auto points = static_cast<std::size_t>(scan) + 1;
    write_points(scan, std::vector<float>(points * 4, static_cast<float>(scan)));
    write_labels("predictions", scan, std::vector<std::uint32_t>(points, 40));
    write_labels("labels", scan, std::vector<std::uint32_t>(points, 70));
    poses += kIdentityRow;
  }
  folder_.write("poses.txt", poses);
}

void SampleDataset::write_points(int scan, const std::vector<float>& points_xyzi) const {
  folder_.write(scan_name("velodyne", scan, ".bin"), as_text(points_xyzi));
}

void SampleDataset::write_labels(const std::string& folder, int scan,
                                 const std::vector<std::uint32_t>& labels) const {
  folder_.write(scan_name(folder, scan, ".label"), as_text(labels));
}

void SampleDataset::write_weighted_labels(const std::string& folder, int scan,
                                          const std::vector<std::uint32_t>& labels) const {
  folder_.write(scan_name(folder, scan, ".topk"), as_text(labels));
}

void SampleDataset::remove(const std::string& name) const {
  std::filesystem::remove_all(folder_.path() / name);
}

}  // namespace tessera::test
