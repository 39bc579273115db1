// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The global map on what costs it most: blocks in which every voxel has every class, robots whose
// frames are turned, and every quantum of step() on its own.
#include "meter.hpp"
#include "tessera/fusion/global_reader.hpp"

namespace tessera::bench {

namespace {

constexpr double kEntries = 512.0 * (kMostClasses + 1);  // of a full block
constexpr std::uint32_t kRobots = 2;

/// By the 3-4-5 triangle about the vertical, so that a block lies across as many as it can.
GridTransform turned() {
  Matrix34d T = Matrix34d::Identity();
  T(0, 0) = T(1, 1) = 0.8;
  T(1, 0) = 0.6;
  T(0, 1) = -0.6;
  T.col(3).setConstant(0.37);
  return *GridTransform::make(T, 0.1);
}

GlobalMapConfig global_config() {
  GlobalMapConfig config;
  config.map = config_of(TuplePolicy::kDense, 24);
  config.map.max_evidence = 0.0F;
  config.staged_bytes = config.map.storage_bytes;
  config.blocks = 1024;
  config.replicas = {
      .segments = 1U << 18U, .blocks = 256, .contributions = 4, .robot_segments = 1U << 18U};
  config.sum_segments = 1U << 18U;
  config.diffusion.iterations = 4;
  return config;
}

struct OwnedGlobal {
  explicit OwnedGlobal(const GlobalMapConfig& config)
      : lines(GlobalMap::required_bytes(config, kMostClasses + 2) / sizeof(OwnedMap::Line) + 1),
        settings(config) {
    empty();
  }
  void empty() {
    Arena arena(std::as_writable_bytes(std::span(lines)));
    Result<GlobalMap> made = GlobalMap::make(arena, settings, table_of(kMostClasses));
    if (!made.ok()) std::abort();
    global = std::move(*made);
  }
  std::vector<OwnedMap::Line> lines;
  GlobalMapConfig settings;
  GlobalMap global;
};

/// A block of which every voxel has every class and passes, each count another one.
struct FullBlock {
  FullBlock()
      : memory(BlockContent::required_bytes(kMostClasses + 2) + kArenaAlignment),
        packed(most_packed_bytes(kMostClasses + 2)) {
    Arena arena{std::span<std::byte>(memory)};
    content = *BlockContent::make(arena, kMostClasses + 2);
    fill();
    packed.resize(pack_block(content, packed));
  }
  void fill() {
    content.clear();
    for (int row = 0; row < kBlockVoxels; ++row) {
      for (int l = 1; l <= kMostClasses + 1; ++l)
        content.add(l, row, 0.25F * static_cast<float>(1 + (row * 7 + l * 3) % 50));
      content.add_passes(row, 1U + static_cast<unsigned>(row % 7));
    }
  }
  std::vector<std::byte> memory;
  BlockContent content;
  std::vector<std::byte> packed;
};

void measure_packing(Meter& meter) {
  FullBlock full;
  std::vector<std::byte> bytes(most_packed_bytes(kMostClasses + 2));
  meter.measure(
      {"pack_block", "pack_block", "512 voxels of every class", "512 (C + 1) counts"}, 1, [] {},
      [&] { return fixed(pack_block(full.content, bytes) == full.packed.size(), kEntries); });
  meter.measure(
      {"check_packed", "check_packed", "the same", "512 (C + 1) counts"}, 1, [] {},
      [&] { return fixed(check_packed(full.packed, kMostClasses + 2) == Status::kOk, kEntries); });
  for (const TuplePolicy tuple : {TuplePolicy::kDense, TuplePolicy::kCompact}) {
    OwnedMap owned(config_of(tuple, 4), kMostClasses);
    const SlabHandle handle = *owned.map.open_block({1, 2, 3});
    const std::string name = std::string("replace_") + to_string(tuple);
    const std::string input = std::string(to_string(tuple)) + ": the same, in place of the same";
    meter.measure(
        {name.c_str(), "LocalMap::replace", input.c_str(), "512 (C + 1) counts"}, 1,
        [&] { static_cast<void>(owned.map.replace(handle, full.content)); },
        [&] { return fixed(owned.map.replace(handle, full.content) == Status::kOk, kEntries); });
  }
  OwnedMap owned(config_of(TuplePolicy::kDense, 4), kMostClasses);
  const SlabHandle handle = *owned.map.open_block({1, 2, 3});
  static_cast<void>(owned.map.replace(handle, full.content));
  meter.measure(
      {"add_block", "add_block", "dense: the same", "512 (C + 1) counts"}, 1,
      [&] { full.content.clear(); },
      [&] {
        add_block(owned.map, owned.map.block_at(handle), full.content);
        const bool done = full.content.count(kMostClasses, kBlockVoxels - 1) > 0.0F;
        return fixed(done, kEntries);
      });
}

/// A block and its neighbours.
constexpr GridTransform::BlockRange kAround{{1, 1, 1}, {3, 3, 3}};

/// Both robots publish full blocks.
void publish(GlobalMap& global, const FullBlock& full, const GridTransform& frame,
             const GridTransform::BlockRange& range) {
  for (std::uint32_t robot = 0; robot < kRobots; ++robot) {
    const GlobalMap::Slot slot = *global.open({robot, 0, 0}, frame);
    for (std::int32_t z = range.first.z; z <= range.last.z; ++z) {
      for (std::int32_t y = range.first.y; y <= range.last.y; ++y) {
        for (std::int32_t x = range.first.x; x <= range.last.x; ++x)
          static_cast<void>(global.put(slot, pack_in_grid({x, y, z}), 1, full.packed));
      }
    }
  }
}

void measure_arrival(Meter& meter, const FullBlock& full) {
  OwnedGlobal owned(global_config());
  GlobalMap::Slot slot = 0;
  std::uint32_t version = 1;
  meter.measure(
      {"put", "GlobalMap::put", "the largest block of a turned robot, in place of an older one",
       "bytes + 27 blocks"},
      1,
      [&] {
        owned.empty();
        slot = *owned.global.open({1, 0, 0}, turned());
        static_cast<void>(owned.global.put(slot, pack_in_grid({0, 0, 0}), ++version, full.packed));
      },
      [&] {
        const bool taken =
            owned.global.put(slot, pack_in_grid({0, 0, 0}), ++version, full.packed).ok();
        return fixed(taken, static_cast<double>(full.packed.size()) + 27.0);
      });
  meter.measure(
      {"set_frame", "GlobalMap::set_frame", "a robot that waits to move", "1 move: 1"}, 1, [] {},
      [&] {
        const bool taken =
            owned.global.set_frame(slot, turned(), ++version) == Replicas::Change::kTaken;
        return fixed(taken, 1.0);
      });
}

/// step() as far as a quantum, and then that one.
class Quantum {
 public:
  Quantum(Meter& meter, OwnedGlobal& owned) : meter_(meter), owned_(owned) {}
  template <class Prepare>
  void measure(const WorstCase& worst, int before, double bound, Prepare&& prepare) {
    meter_.measure(
        worst, 1,
        [&] {
          prepare();
          for (int i = 0; i < before; ++i) static_cast<void>(owned_.global.step(1));
        },
        [&] {
          return Operations{static_cast<double>(owned_.global.step(1)), bound};
        });
  }

 private:
  Meter& meter_;
  OwnedGlobal& owned_;
};

void measure_sums(Meter& meter, const FullBlock& full) {
  OwnedGlobal owned(global_config());
  const double blocks = kRobots * 27.0;
  Quantum(meter, owned)
      .measure(
          {"step_sums", "GlobalMap::step",
           "sums of a block: two turned robots, all blocks that lie in it full and over the cap",
           "robots (27 (2 x 512 (C + 2) + 1) entries + 512 (C + 1) held to the cap + 1)"},
          0, blocks * (2.0 * (kEntries + 512.0) + 1.0) + 1.0 + kRobots * (kEntries + 1.0), [&] {
            owned.empty();
            owned.global.set_focus(BlockCoord{0, 0, 0});
            publish(owned.global, full, turned(), turned().local_blocks({0, 0, 0}));
          });
}

void measure_diffusion(Meter& meter, const FullBlock& full) {
  OwnedGlobal owned(global_config());
  // With four iterations of reach 1 a block depends on 16^3 nodes, in 27 blocks; with every class,
  // enough nodes fit that four blocks can be done together, the fifth and largest of all bricks
  // here.
  constexpr double kFit = 7500.0;
  constexpr double kAll = 512.0 * (kMostClasses + 2);
  constexpr double kWitnesses = 512.0 * 485.0;
  constexpr int kBefore = 50;
  const auto prepare = [&] {
    owned.empty();
    publish(owned.global, full, GridTransform(), kAround);
  };
  Quantum quantum(meter, owned);
  quantum.measure({"step_gather", "GlobalMap::step",
                   "nodes of a brick, every voxel of 27 blocks one with every class; three larger "
                   "bricks do not fit",
                   "4 (nodes that fit + 512) (C + 2) + 54 x 512 (C + 2) entries"},
                  kBefore, 4.0 * (kFit + 512.0) * (kMostClasses + 2) + 54.0 * kAll, prepare);
  quantum.measure({"step_link", "GlobalMap::step", "edges of the same brick", "27 nodes that fit"},
                  kBefore + 1, 27.0 * kFit, prepare);
  quantum.measure(
      {"step_iterate", "GlobalMap::step", "the first iteration over it", "27 nodes that fit"},
      kBefore + 2, 27.0 * kFit, prepare);
  quantum.measure(
      {"step_write", "GlobalMap::step", "a block of it is written, with other labels than before",
       "512 (C + 2) entries + 512 x 485 witnesses"},
      kBefore + 6, kAll + kWitnesses, prepare);
}

void measure_moves(Meter& meter, const FullBlock& full) {
  OwnedGlobal owned(global_config());
  const auto prepare = [&] {
    owned.empty();
    publish(owned.global, full, GridTransform(), kAround);
    while (owned.global.busy()) static_cast<void>(owned.global.step(1U << 20U));
    static_cast<void>(owned.global.set_frame(0, turned(), 1));
  };
  Quantum(meter, owned)
      .measure(
          {"step_mark", "GlobalMap::step", "a block of a robot that moves is marked", "54 blocks"},
          1, 56.0, prepare);
  GlobalReader reader(owned.global);
  bool known = false;
  meter.measure(
      {"global_reader", "GlobalReader::query", "every class, while a finished move is being copied",
       "2 (C + 2) counts"},
      1,
      [&] {
        prepare();
        while (owned.global.settled()) static_cast<void>(owned.global.step(1));
      },
      [&] {
        known = reader.query(VoxelCoord{1, 1, 1}).ok();
        return fixed(known, 2.0 * (kMostClasses + 2));
      });
  meter.measure(
      {"step_merge", "GlobalMap::step", "staged blocks of one bucket are copied",
       "8 blocks, 512 (C + 2) counts each, and 15 slots"},
      1,
      [&] {
        prepare();
        while (owned.global.settled()) static_cast<void>(owned.global.step(1));
      },
      [&] {
        return Operations{static_cast<double>(owned.global.step(1)),
                          8.0 * (kEntries + 512.0) + 15.0};
      });
  meter.measure(
      {"global_report", "GlobalMap::report", "83 blocks", "blocks"}, 1, [] {},
      [&] {
        const GlobalMapReport report = owned.global.report();
        return Operations{static_cast<double>(report.blocks), 1024.0};
      });
}

}  // namespace

void measure_fusion(Meter& meter) {
  measure_packing(meter);
  const FullBlock full;
  measure_arrival(meter, full);
  measure_sums(meter, full);
  measure_diffusion(meter, full);
  measure_moves(meter, full);
}

}  // namespace tessera::bench
