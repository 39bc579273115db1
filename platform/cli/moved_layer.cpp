// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/moved_layer.hpp"

#include <array>

#include "base/number_text.hpp"

namespace tessera {

namespace {

constexpr Color kStands{196, 200, 206};

}  // namespace

Layer color_by_what_moved(const ClassTable& classes, std::vector<PlyVoxel>& voxels) {
  std::array<std::uint64_t, 256> moved{};
  std::uint64_t all_moved = 0;
  std::uint64_t stands = 0;
  for (PlyVoxel& voxel : voxels) {
    const bool is_moved = voxel.is_free && (classes.moving() >> unsigned{voxel.label} & 1U) != 0;
    voxel.color = is_moved ? classes[voxel.label].color : kStands;
    all_moved += is_moved ? 1U : 0U;
    stands += voxel.is_free ? 0U : 1U;
    if (is_moved) ++moved[voxel.label];
  }
  Layer layer;
  layer.counts = {{"moved_voxels", all_moved}, {"moved", Json::object()}};
  layer.legend.push_back({"occupied: " + counted(stands, "voxel"), kStands});
  for (int label = 1; label <= classes.num_classes(); ++label) {
    const std::uint64_t count = moved[static_cast<std::size_t>(label)];
    if (count == 0) continue;
    const std::string name(classes[label].name_view());
    layer.counts["moved"][name] = count;
    layer.legend.push_back({"was " + name + ": " + counted(count, "voxel"), classes[label].color});
  }
  return layer;
}

}  // namespace tessera
