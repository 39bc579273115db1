// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "yardsticks.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "harness.hpp"
#include "tessera/base/internal/digest.hpp"

namespace tessera::bench {

namespace {

std::size_t voxel_in_block(VoxelCoord v) {
  return static_cast<std::size_t>((v.x & 7) | ((v.y & 7) << 3) | ((v.z & 7) << 6));
}

/// The value, in a register, of which the compiler knows nothing more. It could add several
/// summands at once otherwise, and some cores add a constant, if it is small, without a cycle.
std::uint64_t unknown(std::uint64_t value) {
  __asm__ volatile("" : "+r"(value));
  return value;
}

}  // namespace

void add_dependently(std::uint64_t n) {
  std::uint64_t sum = 1;
  const std::uint64_t summand = unknown(3);
  const auto add = [summand](std::uint64_t before) { return unknown(before + summand); };
  for (std::uint64_t i = 0; i < n; i += 8) sum = add(add(add(add(add(add(add(add(sum))))))));
}

void add_in_four_chains(std::uint64_t n) {
  std::uint64_t a = 1;
  std::uint64_t b = 2;
  std::uint64_t c = 3;
  std::uint64_t d = 4;
  const std::uint64_t summand = unknown(3);
  const auto add = [summand](std::uint64_t before) { return unknown(before + summand); };
  for (std::uint64_t i = 0; i < n; i += 16) {
    a = add(a), b = add(b), c = add(c), d = add(d);
    a = add(a), b = add(b), c = add(c), d = add(d);
    a = add(a), b = add(b), c = add(c), d = add(d);
    a = add(a), b = add(b), c = add(c), d = add(d);
  }
}

DependentLoads::DependentLoads(std::size_t bytes) : lines_(bytes / sizeof(Line)) {
  for (Line& line : lines_) line.next = &line;
  // Sattolo's shuffle makes a single cycle.
  std::uint64_t state = 0;
  for (std::size_t i = lines_.size() - 1; i > 0; --i)
    std::swap(lines_[i].next, lines_[mix64(state += 0x9e3779b97f4a7c15U) % i].next);
  at_ = lines_.data();
}

void DependentLoads::load(std::size_t n) {
  const Line* at = at_;
  for (std::size_t i = 0; i < n; ++i) at = at->next;
  at_ = at;
}

MemoryBandwidth::MemoryBandwidth(std::size_t array_bytes)
    : a_(array_bytes / sizeof(double), 0.0),
      b_(array_bytes / sizeof(double), 1.0),
      c_(array_bytes / sizeof(double), 2.0) {}

double MemoryBandwidth::measure() {
  const double scale = 1.0 + a_[0] * 1e-9;  // not known to the compiler
  const double seconds = seconds_of([&] {
    for (std::size_t i = 0; i < a_.size(); ++i) a_[i] = b_[i] + scale * c_[i];
  });
  return static_cast<double>(3 * sizeof(double) * a_.size()) / seconds;
}

NaiveKernelMap::NaiveKernelMap(double resolution_m, double length_m, int num_components)
    : resolution_m_(static_cast<float>(resolution_m)),
      length_m_(static_cast<float>(length_m)),
      components_(static_cast<std::size_t>(num_components) - 1),
      block_floats_(components_ * kBlockVoxels) {}

float* NaiveKernelMap::block(BlockCoord coord) {
  std::unique_ptr<float[]>& block = blocks_[pack_in_grid(coord).bits];
  if (block == nullptr) {
    if (spare_.empty()) {
      block = std::make_unique<float[]>(block_floats_);
    } else {
      block = std::move(spare_.back());
      spare_.pop_back();
      std::fill_n(block.get(), block_floats_, 0.0F);
    }
  }
  return block.get();
}

std::uint64_t NaiveKernelMap::integrate(std::span<const ScanPoint> points) {
  const auto kernel = [this](float squared) {
    constexpr float kPi = 3.14159265F;
    const float r = std::sqrt(squared) / length_m_;
    const float angle = 2.0F * kPi * r;
    return (2.0F + std::cos(angle)) * (1.0F - r) / 3.0F +
           std::sin(angle) / (2.0F * kPi);  // eq. (5)
  };
  std::uint64_t updates = 0;
  BlockCoord at{};
  float* counts = nullptr;
  const auto voxel_of = [&](float metres) {
    return static_cast<std::int32_t>(std::floor(metres / resolution_m_));
  };
  const auto center = [&](std::int32_t v) {
    return (static_cast<float>(v) + 0.5F) * resolution_m_;
  };
  for (const ScanPoint& point : points) {
    const Point3f& p = point.p_map;
    const std::size_t component = std::size_t{point.component} - 1;
    const VoxelCoord low{voxel_of(p.x() - length_m_), voxel_of(p.y() - length_m_),
                         voxel_of(p.z() - length_m_)};
    const VoxelCoord high{voxel_of(p.x() + length_m_), voxel_of(p.y() + length_m_),
                          voxel_of(p.z() + length_m_)};
    for (std::int32_t z = low.z; z <= high.z; ++z) {
      const float dz = center(z) - p.z();
      for (std::int32_t y = low.y; y <= high.y; ++y) {
        const float dy = center(y) - p.y();
        for (std::int32_t x = low.x; x <= high.x; ++x) {
          const float dx = center(x) - p.x();
          const float squared = dx * dx + dy * dy + dz * dz;
          if (!(squared < length_m_ * length_m_)) continue;
          const BlockCoord needed = block_of({x, y, z});
          if (counts == nullptr || needed != at) {
            counts = block(needed);
            at = needed;
          }
          const std::size_t voxel = voxel_in_block({x, y, z});
          counts[voxel * components_ + component] += point.weight * kernel(squared);  // eq. (7)
          ++updates;
        }
      }
    }
  }
  return updates;
}

void NaiveKernelMap::clear() {
  for (auto& [key, block] : blocks_) spare_.push_back(std::move(block));
  blocks_.clear();
}

int NaiveKernelMap::label_of(VoxelCoord v) const {
  const auto found = blocks_.find(pack_in_grid(block_of(v)).bits);
  if (found == blocks_.end()) return 0;
  const float* const counts = found->second.get() + voxel_in_block(v) * components_;
  const float* const most = std::max_element(counts, counts + components_ - 1);  // C classes
  return *most > 0.0F ? static_cast<int>(most - counts) + 1 : 0;
}

}  // namespace tessera::bench
