// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What it costs to move all submaps of a robot at once, as a loop closure does: processor time of
// the global map from the corrections to the map that they give, in the slices in which a robot
// does it. Submaps lie in a row, and a quarter of each one's blocks overlaps with the next.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "base/arena_memory.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/base/rigid_code.hpp"
#include "tessera/exchange/exchange.hpp"
#include "tessera/fusion/global_map.hpp"
#include "thread_time.hpp"

namespace tessera::bench {

namespace {

constexpr int kClasses = 19;
constexpr double kResolution_m = 0.1;
constexpr int kLong = 20;  ///< Blocks of a submap along the row, and across.
constexpr int kWide = 10;
constexpr int kApart = 15;  ///< From one submap to the next: a quarter of its blocks overlaps.

ClassTable classes() {
  ClassTable table;
  for (int i = 1; i <= kClasses; ++i) {
    const std::string name = "class " + std::to_string(i);
    if (table.add(name, {static_cast<std::uint8_t>(10 * i), 0, 0}) != Status::kOk) std::abort();
  }
  return table;
}

/// Ground with a kerb, free space above it: some 100 label voxels, and as many again that are free.
int fill(BlockContent& content, int x, int y) {
  content.clear();
  int labels = 0;
  for (int i = 0; i < kBlockEdge; ++i) {
    for (int j = 0; j < kBlockEdge; ++j) {
      const int height = 2 + ((i + j) % 3 == 0 ? 1 : 0);
      const auto row = [&](int z) { return (z * kBlockEdge + j) * kBlockEdge + i; };
      const int label = 1 + (x / 3 + y / 2 + (i < 4 ? 0 : 1)) % kClasses;
      content.add(label, row(height), 3.0F + 0.25F * static_cast<float>((i * 5 + j) % 7));
      ++labels;
      if ((i + 2 * j) % 2 == 0) {
        content.add(label, row(height - 1), 1.5F);
        if ((i + j) % 4 == 0) content.add(1 + label % kClasses, row(height - 1), 0.5F);
        ++labels;
      }
      for (int z = height + 1; z < kBlockEdge; ++z) content.add_passes(row(z), 3);
    }
  }
  return labels;
}

struct Shared {
  explicit Shared(std::uint32_t submaps) {
    const ClassTable table = classes();
    const int components = table.num_components();
    GlobalMapConfig config;
    config.map = {.resolution_m = kResolution_m,
                  .tuple = TuplePolicy::kCompact,
                  .storage_bytes = std::size_t{1} << 30U};
    config.map.max_evidence = 0.0F;
    config.blocks = 1U << 17U;
    config.sum_segments = 1U << 21U;
    config.staged_bytes = std::size_t{1} << 30U;
    config.replicas = {.segments = 1U << 20U,
                       .blocks = 1U << 16U,
                       .contributions = submaps + 1,
                       .robot_segments = 1U << 20U};
    ExchangeConfig exchange_config;
    exchange_config.contributions = submaps + 1;
    exchange_config.own_contributions = submaps;
    exchange_config.records = config.replicas.blocks;
    exchange_config.resolution_m = kResolution_m;
    Outcome<ArenaMemory> made =
        ArenaMemory::allocate(GlobalMap::required_bytes(config, components) +
                              Exchange::required_bytes(exchange_config, components) +
                              BlockContent::required_bytes(components));
    if (!made.ok()) std::abort();
    memory = std::move(*made);
    Arena arena(memory.span());
    global = std::move(*GlobalMap::make(arena, config, table));
    exchange = std::move(
        *Exchange::make(arena, exchange_config, store_of(global), crc_authenticator(), table));
    content = *BlockContent::make(arena, components);
  }
  ArenaMemory memory;
  GlobalMap global;
  Exchange exchange;
  BlockContent content;
};

/// A turn by some degrees about the submap's begin, a tilt and a shift.
Matrix34d correction(std::uint32_t submap) {
  const double angle = 0.002 * (submap + 1.0) / 10.0 + 0.01;
  Matrix34d T = Matrix34d::Identity();
  T(0, 0) = T(1, 1) = std::cos(angle);
  T(1, 0) = std::sin(angle);
  T(0, 1) = -T(1, 0);
  Matrix34d tilt = Matrix34d::Identity();
  tilt(1, 1) = tilt(2, 2) = std::cos(0.004);
  tilt(2, 1) = std::sin(0.004);
  tilt(1, 2) = -tilt(2, 1);
  T = product(T, tilt);
  const Point3d begin(submap * kApart * kBlockEdge * kResolution_m, 0.0, 0.0);
  T.col(3) = begin - T.leftCols<3>() * begin + Point3d(0.03, 0.11, 0.07);
  return *round_rigid(T);
}

struct Moved {
  double cpu_s = 0.0;
  std::uint64_t work = 0;
  std::uint64_t most_work = 0;
  std::uint64_t slices = 0;
  double worst_ms = 0.0;
};

Moved work_off(GlobalMap& global, std::uint64_t slice) {
  Moved moved;
  while (global.busy()) {
    const double before_ms = thread_cpu_ms();
    const std::uint64_t work = global.step(slice);
    const double took_ms = thread_cpu_ms() - before_ms;
    moved.cpu_s += 1e-3 * took_ms;
    moved.work += work;
    moved.most_work = std::max(moved.most_work, work);
    moved.worst_ms = std::max(moved.worst_ms, took_ms);
    ++moved.slices;
  }
  return moved;
}

int run(std::uint32_t submaps, std::uint64_t slice) {
  Shared shared(submaps);
  std::uint64_t label_voxels = 0;
  for (std::uint32_t submap = 0; submap < submaps; ++submap) {
    if (shared.exchange.open(1, submap, Matrix34d::Identity()) != Status::kOk) std::abort();
    for (int x = 0; x < kLong; ++x) {
      for (int y = 0; y < kWide; ++y) {
        const BlockCoord block{static_cast<std::int32_t>(submap) * kApart + x, y, 0};
        label_voxels += static_cast<std::uint64_t>(fill(shared.content, block.x, y));
        if (!shared.exchange.publish(*pack(block), shared.content).ok()) std::abort();
      }
    }
  }
  const Moved fused = work_off(shared.global, slice);
  for (std::uint32_t submap = 0; submap < submaps; ++submap) {
    if (shared.exchange.move(1, submap, correction(submap)) != Status::kOk) std::abort();
  }
  const Moved moved = work_off(shared.global, slice);
  std::printf("%u submaps of %u blocks, %llu label voxels, a quarter of the blocks in two\n",
              submaps, static_cast<unsigned>(kLong * kWide),
              static_cast<unsigned long long>(label_voxels));
  std::printf("%-22s %10s %12s %14s %10s %12s\n", "", "CPU s", "us a voxel", "units of work",
              "slices", "longest ms");
  for (const auto& [name, one] : {std::pair{"fused from nothing", fused}, {"all moved", moved}})
    std::printf("%-22s %10.3f %12.3f %14llu %10llu %12.2f\n", name, one.cpu_s,
                1e6 * one.cpu_s / static_cast<double>(label_voxels),
                static_cast<unsigned long long>(one.work),
                static_cast<unsigned long long>(one.slices), one.worst_ms);
  std::printf("most units in a slice: %llu of %llu; label voxels in the map: %llu\n",
              static_cast<unsigned long long>(moved.most_work),
              static_cast<unsigned long long>(slice),
              static_cast<unsigned long long>(shared.global.map().usage().label_voxels));
  return shared.global.map().usage().storage_refused == 0 ? 0 : 1;
}

}  // namespace

}  // namespace tessera::bench

int main(int argc, char** argv) {
  std::uint32_t submaps = 100;
  std::uint64_t slice = 100'000;
  CLI::App app("Processor time to move all submaps of a robot at once");
  app.add_option("--submaps", submaps, "How many")->check(CLI::Range(1, 250));
  app.add_option("--slice", slice, "Units of work of a slice")
      ->check(CLI::Range(1000, 100'000'000));
  CLI11_PARSE(app, argc, argv);
  return tessera::bench::run(submaps, slice);
}
