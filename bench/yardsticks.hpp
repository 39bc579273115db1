// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What the library's times are compared with, measured in the same run: the core's clock, the
// machine's memory, and the plain loop that anyone would write for the kernel's sum.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "tessera/grid/lattice.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera::bench {

/// A chain of n additions of integers in which each needs the one before: one a cycle on x86-64 and
/// aarch64, so that its time is the clock's. n is a multiple of 16, here and below.
void add_dependently(std::uint64_t n);
/// The same n additions in four chains that do not need each other: what the core does at once.
/// Another thread on the same core takes its part of that, and nothing of the clock.
void add_in_four_chains(std::uint64_t n);

/// Loads of which each needs the one before, in lines of memory in random order, as the system
/// allocates that many bytes: a load's latency, that of translating its address included. The
/// order is one cycle through all of them.
class DependentLoads {
 public:
  explicit DependentLoads(std::size_t bytes);
  /// Continues where the last call ended.
  void load(std::size_t n);

 private:
  struct alignas(64) Line {
    const Line* next = nullptr;
  };
  std::vector<Line> lines_;
  const Line* at_ = nullptr;
};

/// The triad a = b + s c over three arrays of far more than the last cache, one thread: bytes a
/// second that it reads and writes (24 a element, without the line fill of the write).
class MemoryBandwidth {
 public:
  explicit MemoryBandwidth(std::size_t array_bytes);
  [[nodiscard]] double measure();

 private:
  std::vector<double> a_;
  std::vector<double> b_;
  std::vector<double> c_;
};

/// The ideal kernel sum, paper eqs. 5 and 7: around each point all voxels whose centre is nearer
/// than D, with square root, sine and cosine; counts of all components, dense, in blocks of 8 x 8 x
/// 8 voxels behind std::unordered_map. A point's voxels are taken row by row, the block is looked
/// up when it changes. It takes all of the kernel's tail, thus about a third more updates than the
/// library.
class NaiveKernelMap {
 public:
  NaiveKernelMap(double resolution_m, double length_m, int num_components);

  /// Returns the updates done.
  std::uint64_t integrate(std::span<const ScanPoint> points);
  /// Empties the map; its blocks are kept for the next one, so that their pages are warm.
  void clear();
  /// The component of the classes 1 .. C with the largest count; 0 if none.
  [[nodiscard]] int label_of(VoxelCoord voxel) const;
  [[nodiscard]] std::size_t bytes() const { return blocks_.size() * block_floats_ * sizeof(float); }

 private:
  float* block(BlockCoord coord);

  float resolution_m_;
  float length_m_;
  std::size_t components_;  ///< 1 .. C + 1.
  std::size_t block_floats_;
  std::unordered_map<std::uint64_t, std::unique_ptr<float[]>> blocks_;
  std::vector<std::unique_ptr<float[]>> spare_;
};

}  // namespace tessera::bench
