// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How long do two robots' maps take to become one: all at once, after some voxels have changed, and
// when one of the robots moves? One thread; the plain fusion takes turns with the library's.
#include <algorithm>

#include "naive_fusion.hpp"
#include "tessera/fusion/global_map.hpp"
#include "tessera/map/internal/packed_block.hpp"

namespace tessera::bench {

namespace {

/// So that each robot has some 300,000 label voxels on the scans of the docs.
constexpr float kMaxRange_m = 19.0F;
constexpr std::uint64_t kAtOnce = ~std::uint64_t{0};
/// Work of a slice: entries read, edges visited.
constexpr std::uint64_t kSlice = 100000;
constexpr int kChangedVoxels = 1000;
constexpr std::size_t kPlaces = 12;

using Frames = std::array<GridTransform, 2>;

void finish(GlobalMap& global) {
  while (global.busy()) static_cast<void>(global.step(kAtOnce));
}

/// False iff something was refused.
bool publish(const Team& team, const Frames& frames, GlobalMap& global) {
  for (std::uint32_t r = 0; r < team.robots.size(); ++r) {
    const Result<GlobalMap::Slot> slot = global.open({r, 0, 0}, frames[r]);
    if (!slot.ok()) return false;
    for (const PublishedBlock& block : team.robots[r].blocks) {
      if (!global.put(*slot, block.key, 1, block.bytes).ok()) return false;
    }
  }
  return true;
}

Outcome<void> whole(const GlobalMap& global) {
  const GlobalMapReport report = global.report();
  if (report.refused_blocks + report.refused_sums + report.refused_outputs + report.torn_blocks > 0)
    return Failure{"the global map has no room for all of the team", FailureKind::kFailure};
  return {};
}

Json both(const Times& times) {
  return {{"ms", statistics(times.ms)}, {"cpu_ms", statistics(times.cpu_ms)}};
}

struct FromNothing {
  Times publish;
  Times fuse;
  std::vector<double> cpu_ms;  ///< Of both.

  Outcome<void> measure(const Team& team, const Frames& frames, OwnedGlobalMap& owned) {
    owned.empty();
    bool taken = false;
    publish.measure([&] { taken = bench::publish(team, frames, *owned); });
    if (!taken) return Failure{"a block was refused", FailureKind::kFailure};
    fuse.measure([&] { finish(*owned); });
    cpu_ms.push_back(publish.cpu_ms.back() + fuse.cpu_ms.back());
    return whole(*owned);
  }
  [[nodiscard]] Json to_json() const {
    return {{"publish", both(publish)}, {"fuse", both(fuse)}, {"cpu_ms", statistics(cpu_ms)}};
  }
};

/// Blocks of a robot around one of them, in which the evidence of about that many voxels has grown.
class Change {
 public:
  Change(const Team& team, std::size_t place) {
    const Contribution& robot = team.robots[1];
    const BlockCoord center = unpack(robot.blocks[place].key);
    std::vector<std::pair<std::int64_t, std::size_t>> near;
    for (std::size_t i = 0; i < robot.blocks.size(); ++i) {
      const BlockCoord b = unpack(robot.blocks[i].key);
      const std::int64_t x = b.x - center.x;
      const std::int64_t y = b.y - center.y;
      const std::int64_t z = b.z - center.z;
      near.emplace_back(x * x + y * y + z * z, i);
    }
    std::sort(near.begin(), near.end());
    const int components = team.classes.num_components();
    std::vector<std::byte> memory(BlockContent::required_bytes(components) + kArenaAlignment);
    Arena arena{std::span<std::byte>(memory)};
    BlockContent content = *BlockContent::make(arena, components);
    std::vector<std::byte> packed(most_packed_bytes(components));
    for (const auto& [distance, i] : near) {
      if (voxels_ >= kChangedVoxels) break;
      content.clear();
      grow(robot.blocks[i].bytes, content);
      const std::size_t size = pack_block(content, packed);
      blocks_.push_back({robot.blocks[i].key,
                         {packed.begin(), packed.begin() + static_cast<std::ptrdiff_t>(size)}});
    }
  }
  [[nodiscard]] bool apply(GlobalMap& global, GlobalMap::Slot slot, std::uint32_t version) const {
    for (const PublishedBlock& block : blocks_) {
      if (!global.put(slot, block.key, version, block.bytes).ok()) return false;
    }
    finish(global);
    return true;
  }
  [[nodiscard]] int voxels() const { return voxels_; }
  [[nodiscard]] std::size_t blocks() const { return blocks_.size(); }

 private:
  void grow(const std::vector<std::byte>& bytes, BlockContent& content) {
    int last_row = -1;
    unpack_block(
        bytes,
        [&](int row, int component, float count) {
          if (component == 0) return content.add_rest(row, count);
          const bool first = row != last_row;
          last_row = row;
          const bool grows = first && voxels_ < kChangedVoxels;
          voxels_ += grows ? 1 : 0;
          content.add(component, row, grows ? count + 0.5F : count);
        },
        [&](int row, unsigned passes) { content.add_passes(row, passes); });
  }

  std::vector<PublishedBlock> blocks_;
  int voxels_ = 0;
};

/// Places all over a robot's map; each change is taken back by the next round's.
Outcome<Json> change_some(const Team& team, OwnedGlobalMap& owned, int repetitions) {
  const GlobalMap::Slot slot = *owned->replicas().find({1, 0, 0});
  const std::vector<PublishedBlock>& blocks = team.robots[1].blocks;
  Times times;
  std::vector<double> changed_blocks;
  std::uint32_t version = 1;
  for (int round = 0; round < std::min(repetitions, 3); ++round) {
    for (std::size_t i = 0; i < kPlaces; ++i) {
      const Change change(team, (2 * i + 1) * blocks.size() / (2 * kPlaces));
      changed_blocks.push_back(static_cast<double>(change.blocks()));
      bool taken = false;
      ++version;
      times.measure([&] { taken = change.apply(*owned, slot, version); });
      if (!taken) return Failure{"a changed block was refused", FailureKind::kFailure};
      // As it was, so that every round does the same.
      for (const PublishedBlock& block : blocks)
        taken = taken && owned->put(slot, block.key, version + 1, block.bytes).ok();
      if (!taken) return Failure{"a block was refused", FailureKind::kFailure};
      ++version;
      finish(*owned);
    }
  }
  TESSERA_TRY(whole(*owned));
  Json json = both(times);
  json["voxels"] = kChangedVoxels;
  json["blocks"] = median(changed_blocks);
  return json;
}

/// There and back again, in slices.
Outcome<Json> move_one(const Frames& to, OwnedGlobalMap& owned, int repetitions,
                       std::uint64_t& digest) {
  const GlobalMap::Slot slot = *owned->replicas().find({1, 0, 0});
  Times slices;
  std::vector<double> total_cpu_ms;
  std::vector<double> over;
  for (int i = 0; i < 2 * repetitions; ++i) {
    const auto revision = static_cast<std::uint32_t>(i) + 1;
    static_cast<void>(owned->set_frame(slot, to[static_cast<std::size_t>(1 - i % 2)], revision));
    double total = 0.0;
    while (owned->busy()) {
      std::uint64_t work = 0;
      slices.measure([&] { work = owned->step(kSlice); });
      total += slices.cpu_ms.back();
      over.push_back(static_cast<double>(work) / static_cast<double>(kSlice));
    }
    total_cpu_ms.push_back(total);
    if (i == 0) digest = owned.digest_of_map();
  }
  TESSERA_TRY(whole(*owned));
  Json json = {
      {"slices", both(slices)}, {"cpu_ms", statistics(total_cpu_ms)}, {"slice_work", kSlice}};
  json["most_work_of_a_slice"] =
      *std::max_element(over.begin(), over.end()) * static_cast<double>(kSlice);
  return json;
}

/// About the vertical by 2 arctan(1 / 30), by whole numbers, and shifted.
Matrix34d turned() {
  Matrix34d T = Matrix34d::Identity();
  T(0, 0) = T(1, 1) = 899.0 / 901.0;
  T(1, 0) = 60.0 / 901.0;
  T(0, 1) = -T(1, 0);
  T(0, 3) = 0.23;
  T(1, 3) = -0.12;
  return T;
}

Outcome<Json> measure(const Options& options, Records& records) {
  TESSERA_TRY_ASSIGN(const Scene scene, load_scene(options));
  if (scene.scans.size() < 2) return Failure{"give at least two scans: two robots share them"};
  TESSERA_TRY_ASSIGN(const Team team, map_team(scene, options.resolution_m, kMaxRange_m));
  const GlobalMapConfig config = config_for(team.map, team.robots);
  TESSERA_TRY_ASSIGN(OwnedGlobalMap owned, OwnedGlobalMap::make(config, team.classes));
  const Result<GridTransform> away = GridTransform::make(turned(), options.resolution_m);
  if (!away.ok()) return Failure{"the second robot is out of the grid", FailureKind::kFailure};
  const Frames together{};
  const Frames apart{GridTransform(), *away};

  NaiveFusion naive(config.diffusion, options.resolution_m, team.classes.num_components());
  FromNothing straight;
  FromNothing oblique;
  Times plain;
  std::size_t plain_nodes = 0;
  for (int i = 0; i < options.repetitions; ++i) {
    TESSERA_TRY(oblique.measure(team, apart, owned));
    if (i == 0) records.check("fusion_turned", owned.digest_of_map());
    TESSERA_TRY(straight.measure(team, together, owned));
    if (i == 0) records.check("fusion", owned.digest_of_map());
    plain.measure([&] { plain_nodes = naive.fuse(team); });
  }
  const GlobalMapReport report = owned->report();
  TESSERA_TRY_ASSIGN(Json changed, change_some(team, owned, options.repetitions));
  std::uint64_t moved_digest = 0;
  TESSERA_TRY_ASSIGN(Json moved,
                     move_one(apart, owned, std::min(options.repetitions, 3), moved_digest));
  records.check("fusion_moved", moved_digest);
  const double label_voxels =
      static_cast<double>(team.robots[0].label_voxels + team.robots[1].label_voxels);
  return Json{{"max_range_m", kMaxRange_m},
              {"label_voxels", {team.robots[0].label_voxels, team.robots[1].label_voxels}},
              {"nodes", report.nodes},
              {"replica_bytes_per_label_voxel",
               static_cast<double>(report.replicas.replica_bytes) / label_voxels},
              {"from_nothing", straight.to_json()},
              {"from_nothing_turned", oblique.to_json()},
              {"plain", {{"cpu_ms", statistics(plain.cpu_ms)}, {"nodes", plain_nodes}}},
              {"plain_over_this", median(plain.cpu_ms) / median(straight.cpu_ms)},
              {"changed", std::move(changed)},
              {"moved", std::move(moved)}};
}

}  // namespace

}  // namespace tessera::bench

int main(int argc, char** argv) {
  return tessera::bench::run(argc, argv, "fusion", tessera::bench::measure);
}
