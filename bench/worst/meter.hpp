// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Public calls of the core on the inputs that cost them most: operations against their formula,
// and instructions, if the program runs under callgrind with --instr-atstart=no.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "harness.hpp"
#include "tessera/map/local_map.hpp"

namespace tessera::bench {

/// A call and what it is given.
struct WorstCase {
  const char* name = "";     ///< Of the record; no spaces.
  const char* call = "";     ///< As in the headers.
  const char* input = "";    ///< What makes it cost most.
  const char* formula = "";  ///< Of the bound on operations.
};

/// What counts as a case's operations, and the most of them by its formula; both for one call.
struct Operations {
  double counted = 0.0;
  double bound = 0.0;
};

/// Work that its input fixes: count if all of it was done, else more than any bound.
[[nodiscard]] inline Operations fixed(bool done, double count) {
  return {done ? count : std::numeric_limits<double>::infinity(), count};
}

class Meter {
 public:
  explicit Meter(int repetitions) : repetitions_(repetitions) {}

  /// Measures work, which makes that many calls and returns its Operations; prepare comes before
  /// each of its runs and is not measured. The one run that is instrumented is the first, so what
  /// is touched for the first time counts.
  template <class Prepare, class Work>
  void measure(const WorstCase& worst, int calls, Prepare&& prepare, Work&& work) {
    Operations operations;
    std::vector<double> ns;
    for (int i = 0; i < repetitions_; ++i) {
      prepare();
      Times times;
      if (i == 0) start_counting();
      times.measure([&] { operations = work(); });
      if (i == 0) stop_counting(worst.name);
      ns.push_back(1e6 * times.cpu_ms[0] / calls);
    }
    add(worst, calls, operations, median(ns));
  }

  /// A case an entry, in the order in which they were measured.
  [[nodiscard]] const Json& cases() const { return cases_; }
  /// The cases that did more operations than their formula says.
  [[nodiscard]] const std::vector<std::string>& beyond() const { return beyond_; }

 private:
  static void start_counting();
  static void stop_counting(const char* name);
  void add(const WorstCase& worst, int calls, const Operations& operations, double ns);

  int repetitions_;
  Json cases_ = Json::object();
  std::vector<std::string> beyond_;
};

/// A map with memory of its own.
struct OwnedMap {
  OwnedMap(const MapConfig& config, int num_classes);
  struct alignas(kArenaAlignment) Line {
    std::array<std::byte, kArenaAlignment> bytes{};
  };
  std::vector<Line> lines;
  LocalMap map;
};

/// The most classes that there can be.
inline constexpr int kMostClasses = kMaxClasses;
/// Classes 1 .. count.
[[nodiscard]] ClassTable table_of(int count);
/// Settings for the most classes, in so many MiB.
[[nodiscard]] MapConfig config_of(TuplePolicy tuple, std::size_t mebibytes);
/// Gives every voxel of a block, opened if need be, evidence of all label components beyond what
/// the cap lets stand, and passes free passes.
SlabHandle fill_block(LocalMap& map, BlockCoord block, int passes);
/// Evidence of every label component in all voxels of an octet.
[[nodiscard]] OctetEvidence everything(const LocalMap& map, float each);

/// Blocks of the grid whose keys have hashes, as the index makes them, that chosen accepts.
template <class Chosen>
[[nodiscard]] std::vector<BlockCoord> blocks_with_hash(std::size_t count, Chosen&& chosen) {
  std::vector<BlockCoord> found;
  for (std::int32_t i = 0; found.size() < count; ++i) {
    const BlockCoord block{i % 512, i / 512 % 512, i / (512 * 512)};
    const std::uint64_t mixed = mix64(pack_in_grid(block).bits + 0x9e3779b97f4a7c15U);
    if (chosen(static_cast<std::uint32_t>(mixed >> 32U), mixed)) found.push_back(block);
  }
  return found;
}

/// Blocks whose keys have the same two buckets of a page.
[[nodiscard]] std::vector<BlockCoord> same_buckets(std::size_t count);

void measure_integrate(Meter& meter);
void measure_full_maps(Meter& meter);
void measure_map(Meter& meter);
void measure_voxels(Meter& meter);
void measure_reading(Meter& meter);
void measure_blocks(Meter& meter);
void measure_registration(Meter& meter);
void measure_fusion(Meter& meter);
void measure_reliability(Meter& meter);
void measure_exchange(Meter& meter);
void measure_frames(Meter& meter);

}  // namespace tessera::bench
