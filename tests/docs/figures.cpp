// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Sizes and defaults that the pages state, a line "name value" each, for test_figures.py.
#include <cstdio>
#include <initializer_list>
#include <string>

#include "../../lib/src/c/tessera_c.hpp"
#include "settings/map_options.hpp"
#include "tessera/fusion/global_reader.hpp"
#include "tessera/map/stored_archive.hpp"
#include "tessera/registration/depth_image.hpp"
#include "tessera/registration/label_projection.hpp"
#include "tessera/registration/pose_track.hpp"
#include "tessera/robot/robot.hpp"

namespace {

using namespace tessera;

constexpr int kComponents = 19 + 2;  // as SemanticKITTI

void put(const std::string& name, double value) { std::printf("%s %.17g\n", name.c_str(), value); }
void put(const std::string& name, std::size_t value) {
  std::printf("%s %zu\n", name.c_str(), value);
}

/// Bytes that each more of something takes.
template <class Bytes>
double slope(Bytes&& bytes_of, std::size_t many = 768 * 64) {
  const std::size_t more = bytes_of(2 * many) - bytes_of(many);
  return static_cast<double>(more) / static_cast<double>(many);
}

void put_parts() {
  put("sizeof LocalMap", sizeof(LocalMap));
  put("sizeof Integrator", sizeof(Integrator));
  put("sizeof MapFileBuffer", sizeof(MapFileBuffer));
  put("sizeof MapReader", sizeof(MapReader));
  put("sizeof GlobalMap", sizeof(GlobalMap));
  put("sizeof GlobalReader", sizeof(GlobalReader));
  put("sizeof tessera_reader", sizeof(tessera_reader));
  put("sizeof KeyedIndex", sizeof(KeyedIndex));
  put("kArenaAlignment", kArenaAlignment);
  put("Block", sizeof(Block));
  put("LabelPage", sizeof(LabelPage));
  put("FreePage", sizeof(FreePage));
  put("octet of compact tuples",
      std::size_t{TupleStore::octet_bytes(TuplePolicy::kCompact, kComponents)});
  put("octet of dense tuples",
      std::size_t{TupleStore::octet_bytes(TuplePolicy::kDense, kComponents)});
}

void put_budgets() {
  for (const std::size_t mib : {16U, 32U, 64U, 128U, 256U, 512U, 1024U, 2048U}) {
    const MapConfig map = fit_to_budget({}, mib << 20U);
    const std::string name = "budget " + std::to_string(mib) + " ";
    put(name + "S", map.storage_bytes);
    put(name + "required", required_bytes(map));
    put(name + "blocks", max_blocks(map));
  }
}

void put_scratch() {
  struct Row {
    std::uint32_t points, tiles, ray_blocks;
  };
  for (const Row& row : {Row{16384, 4096, 8192}, Row{65536, 16384, 32768},
                         Row{131072, 65536, 131072}, Row{262144, 65536, 131072}}) {
    const ScanCapacity scan{row.points, row.tiles, row.ray_blocks};
    const std::string name = "scratch " + std::to_string(row.points) + " ";
    InferenceConfig inference;
    put(name + "image", Integrator::required_bytes(scan, inference));
    inference.free_space.carving = Carving::kRays;
    put(name + "rays", Integrator::required_bytes(scan, inference));
    inference.free_space.enabled = false;
    put(name + "without", Integrator::required_bytes(scan, inference));
    inference.mode = InferenceMode::kKernel;
    put(name + "kernel", Integrator::required_bytes(scan, inference));
  }
  const ScanCapacity scan{};
  put("images", ImageCarver::required_bytes());
  put("scratch default", std::size_t{scan.points});
  put("scratch default tiles", std::size_t{scan.tiles});
  put("scratch default rays", std::size_t{scan.ray_blocks});
}

/// What --memory is divided into, for scans of so many returns.
void put_divided(std::size_t mib, bool free_space, std::size_t returns) {
  MapSetup setup;
  setup.budget_bytes = mib << 20U;
  setup.inference.free_space.enabled = free_space;
  const Outcome<ScanCapacity> capacity = split_budget(setup, returns);
  const std::string name = "memory " + std::to_string(mib) + (free_space ? " on " : " off ");
  put(name + "points", std::size_t{capacity->points});
  put(name + "tiles", std::size_t{capacity->tiles});
  put(name + "rays", std::size_t{capacity->ray_blocks});
  put(name + "scratch", Integrator::required_bytes(*capacity, setup.inference));
  put(name + "S", setup.map.storage_bytes);
}

void put_sensors() {
  const LabelProjectionCapacity capacity{.points = 120'000, .width_px = 1280, .height_px = 800};
  const LabelProjectionConfig config{};
  put("projector", LabelProjector::required_bytes(capacity, config));
  put("projector cell", static_cast<double>(config.cell_px));
  put("projector a point", slope([&](std::size_t points) {
        return LabelProjector::required_bytes(
            {.points = static_cast<std::uint32_t>(points), .width_px = 1280, .height_px = 800},
            config);
      }));
  put("pose", slope([](std::size_t poses) { return PoseTrack::required_bytes(poses); }));
  put("depth pixel", slope([](std::size_t rows) {
        return DepthCamera::required_bytes(64, static_cast<int>(rows), 1) / 64;
      }));
}

void put_window() {
  const WindowConfig window{};
  put("entries_per_step", std::size_t{window.entries_per_step});
  put("evictions_per_step", std::size_t{window.evictions_per_step});
  put("pressed_evictions_per_step", std::size_t{window.pressed_evictions_per_step});
  put("regions_per_step", std::size_t{window.regions_per_step});
  put("reloads_per_step", std::size_t{window.reloads_per_step});
  put("label_voxels_per_step", std::size_t{window.label_voxels_per_step});
  put("archived block", slope([](std::size_t blocks) {
        return StoredArchive::required_bytes({}, kComponents, blocks);
      }));
  const auto archive_without_index = [](TuplePolicy tuple, int components) {
    MapConfig map;
    map.tuple = tuple;
    return StoredArchive::required_bytes(map, components, 0) - ArchiveIndex::required_bytes(0);
  };
  put("archive least", archive_without_index(TuplePolicy::kCompact, 3));
  put("archive most", archive_without_index(TuplePolicy::kDense, kMaxComponents));
  put("evicted block",
      slope([](std::size_t blocks) { return EvictionQueue::required_bytes(blocks); }));
  put("evictions", EvictionQueue::required_bytes(0));
}

template <class Member>
double slope_of_global(Member&& member) {
  return slope([&](std::size_t many) {
    GlobalMapConfig config;
    member(config) = static_cast<std::uint32_t>(many);
    return GlobalMap::required_bytes(config, kComponents);
  });
}

void put_global() {
  put("segment", slope_of_global([](GlobalMapConfig & c) -> auto& { return c.replicas.segments; }));
  put("replica", slope_of_global([](GlobalMapConfig & c) -> auto& { return c.replicas.blocks; }));
  put("contribution",
      slope_of_global([](GlobalMapConfig & c) -> auto& { return c.replicas.contributions; }));
  put("sum segment", slope_of_global([](GlobalMapConfig & c) -> auto& { return c.sum_segments; }));
  put("global block", slope_of_global([](GlobalMapConfig & c) -> auto& { return c.blocks; }));
  const auto brick = [](float length_m) {
    DiffusionConfig diffusion;
    diffusion.length_m = length_m;
    return DiffusionBrick::required_bytes(diffusion, 0.1, kComponents);
  };
  put("brick 0.2", brick(0.2F));
  put("brick 0.3", brick(0.3F));
  put("share",
      RobotShare::required_bytes(kComponents, 0) - BlockContent::required_bytes(kComponents));
  // What the page's formula has beside what it names.
  const GlobalMapConfig config{};
  put("global rest",
      GlobalMap::required_bytes(config, kComponents) - TwoMaps::required_bytes(config) -
          Replicas::required_bytes(config.replicas) -
          SegmentStore::required_bytes(config.sum_segments) -
          GlobalRecords::required_bytes(config.blocks) -
          FrameMoves::required_bytes(config.replicas.contributions) -
          DiffusionBrick::required_bytes(config.diffusion, config.map.resolution_m, kComponents) -
          2 * BlockContent::required_bytes(kComponents) - most_packed_bytes(kComponents) -
          (RobotShare::required_bytes(kComponents, config.replicas.contributions) -
           RobotShare::required_bytes(kComponents, 0)));
  put("contributions", std::size_t{Replicas::kMostContributions});
}

void put_robot() {
  put("robot", arena_bytes<Robot>(1) + arena_bytes<Mapper>(1) + arena_bytes<Sharer>(1));
  put("tessera_robot", arena_bytes<tessera_robot>(1));
  put("stored block", arena_bytes<std::uint64_t>(c_interface::workspace_words(kComponents)));
  put("exchange", Exchange::required_bytes({}, kComponents));
  put("exchange of a node",
      Exchange::required_bytes({.contributions = Replicas::kMostContributions}, kComponents));
  put("exchange contribution", slope([](std::size_t contributions) {
        ExchangeConfig config;
        config.contributions = 64 + static_cast<std::uint32_t>(contributions);
        return Exchange::required_bytes(config, kComponents);
      }));
  put("publisher", Publisher::required_bytes({}, kComponents));
}

void put_defaults() {
  const MapConfig map{};
  const InferenceConfig inference{};
  put("MapConfig::resolution_m", map.resolution_m);
  put("MapConfig::prior", map.prior);
  put("MapConfig::max_evidence", static_cast<double>(map.max_evidence));
  put("MapConfig::free_weight", static_cast<double>(map.free_weight));
  put("InferenceConfig::kernel_length_m", static_cast<double>(inference.kernel_length_m));
  put("InferenceConfig::kernel_scale", static_cast<double>(inference.kernel_scale));
  put("InferenceConfig::min_weight", static_cast<double>(inference.min_weight));
  put("InferenceConfig::min_range_m", static_cast<double>(inference.min_range_m));
  put("InferenceConfig::max_range_m", static_cast<double>(inference.max_range_m));
  put("InferenceConfig::thinning_m", inference.thinning_m);
  put("InferenceConfig::work_budget", static_cast<double>(inference.work_budget));
  const EntropyConfig& entropy = inference.entropy;
  put("EntropyConfig::base_length", static_cast<double>(entropy.base_length));
  put("EntropyConfig::entropy_length", static_cast<double>(entropy.entropy_length));
  put("EntropyConfig::smooth_above", static_cast<double>(entropy.smooth_above));
  put("EntropyConfig::fill_length", static_cast<double>(entropy.fill_length));
  put("EntropyConfig::fill_neighbours", static_cast<double>(entropy.fill_neighbours));
  put("EntropyConfig::block_edge", static_cast<double>(entropy.block_edge));
  const FreeSpaceConfig& free_space = inference.free_space;
  put("FreeSpaceConfig::neighbour_angle_rad", static_cast<double>(free_space.neighbour_angle_rad));
  put("FreeSpaceConfig::neighbour_pixels", static_cast<double>(free_space.neighbour_pixels));
  put("FreeSpaceConfig::margin_voxels", static_cast<double>(free_space.margin_voxels));
}

}  // namespace

int main() {
  put_parts();
  put_budgets();
  put_scratch();
  constexpr std::size_t kReturns = 123'433;  // as the page says
  for (const std::size_t mib : {32U, 64U, 128U, 256U, 512U, 1024U})
    put_divided(mib, true, kReturns);
  put_divided(512, false, kReturns);
  put_sensors();
  put_window();
  put_global();
  put_robot();
  put_defaults();
  return 0;
}
