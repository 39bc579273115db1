// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What one block's voxels hold, outside of any map: sums of label evidence by component, evidence
// of no known class, free passes, and where returns were. Filled voxel by voxel, read as a whole.
#pragma once

#include <array>
#include <bit>
#include <cstring>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/map/map_config.hpp"
#include "tessera/semantics/evidence.hpp"

namespace tessera {

class BlockContent {
 public:
  /// num_components: C + 2.
  [[nodiscard]] static constexpr std::size_t required_bytes(int num_components) noexcept {
    return arena_bytes<float>(static_cast<std::size_t>(num_components) * kBlockVoxels) +
           arena_bytes<Common>(1);
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<BlockContent> make(Arena& arena, int num_components) noexcept {
    BlockContent content;
    content.sums_ = arena.take<float>(static_cast<std::size_t>(num_components) * kBlockVoxels);
    const std::span<Common> common = arena.take<Common>(1);
    if (content.sums_.empty() || common.empty()) return Status::kResourceExhausted;
    content.common_ = common.data();
    return content;
  }
  /// Holds nothing and takes nothing.
  BlockContent() noexcept = default;

  /// Back to nothing. O(rows touched).
  void clear() noexcept {
    for (std::uint64_t rest = common_->components; rest != 0; rest &= rest - 1) {
      const auto c = static_cast<std::size_t>(std::countr_zero(rest));
      for (std::uint64_t rows = common_->touched[c]; rows != 0; rows &= rows - 1)
        std::memset(&sums_[c * kBlockVoxels + 8 * first_of(rows)], 0, 8 * sizeof(float));
      common_->touched[c] = 0;
    }
    for (std::uint64_t rows = common_->rest_rows; rows != 0; rows &= rows - 1)
      std::memset(&common_->rest[8 * first_of(rows)], 0, 8 * sizeof(float));
    for (std::uint64_t rows = common_->pass_rows; rows != 0; rows &= rows - 1)
      std::memset(&common_->passes[8 * first_of(rows)], 0, 8 * sizeof(std::uint16_t));
    for (std::uint64_t rows = common_->centroid_rows; rows != 0; rows &= rows - 1)
      std::memset(static_cast<void*>(&common_->centroids[8 * first_of(rows)]), 0, 8);
    common_->components = common_->rest_rows = common_->pass_rows = common_->centroid_rows = 0;
  }

  /// Adds what another holds, which is for as many components: labels of a component times its
  /// factor, from 0, a rest times that of component 0, passes as they are. O(rows touched by the
  /// other).
  void add(const BlockContent& other, std::span<const float> factors) noexcept {
    for (std::uint64_t rest = other.common_->components; rest != 0; rest &= rest - 1) {
      const std::size_t c = first_of(rest);
      if (!(factors[c] > 0.0F)) continue;
      common_->components |= std::uint64_t{1} << c;
      common_->touched[c] |= other.common_->touched[c];
      for (std::uint64_t rows = other.common_->touched[c]; rows != 0; rows &= rows - 1) {
        const std::size_t first = c * kBlockVoxels + 8 * first_of(rows);
        for (std::size_t at = first; at < first + 8; ++at) {
          const float count = factors[c] * other.sums_[at];
          sums_[at] += count >= kLeastCount ? count : 0.0F;
        }
      }
    }
    for (std::uint64_t rows = other.common_->rest_rows; rows != 0; rows &= rows - 1) {
      const int first = static_cast<int>(8 * first_of(rows));
      for (int row = first; row < first + 8; ++row) add_rest(row, factors[0] * other.rest(row));
    }
    for (std::uint64_t rows = other.common_->pass_rows; rows != 0; rows &= rows - 1) {
      const int first = static_cast<int>(8 * first_of(rows));
      for (int row = first; row < first + 8; ++row) add_passes(row, other.passes(row));
    }
  }

  /// component: 1 .. C + 1; row: a voxel's row order.
  void add(int component, int row, float count) noexcept {
    const auto c = static_cast<std::size_t>(component);
    common_->components |= std::uint64_t{1} << c;
    common_->touched[c] |= row_bit(row);
    sums_[c * kBlockVoxels + static_cast<std::size_t>(row)] += count;
  }
  void add_rest(int row, float count) noexcept {
    common_->rest_rows |= row_bit(row);
    common_->rest[static_cast<std::size_t>(row)] += count;
  }
  /// Sums of up to 257 times 255 passes are exact.
  void add_passes(int row, unsigned passes) noexcept {
    common_->pass_rows |= row_bit(row);
    std::uint16_t& here = common_->passes[static_cast<std::size_t>(row)];
    const unsigned sum = here + passes;
    here = static_cast<std::uint16_t>(sum < 0xffffU ? sum : 0xffffU);
  }
  /// Of a voxel with label evidence.
  void set_centroid(int row, Centroid centroid) noexcept {
    common_->centroid_rows |= row_bit(row);
    common_->centroids[static_cast<std::size_t>(row)] = centroid;
  }
  /// Of a voxel with label evidence: the nearer one stays.
  void add_centroid(int row, Centroid centroid) noexcept {
    if (centroid.known()) set_centroid(row, this->centroid(row).nearer(centroid));
  }
  /// Sets a count.
  void set(int component, int row, float count) noexcept {
    const auto c = static_cast<std::size_t>(component);
    common_->components |= std::uint64_t{1} << c;
    common_->touched[c] |= row_bit(row);
    sums_[c * kBlockVoxels + static_cast<std::size_t>(row)] = count;
  }
  /// Sets a rest or passes of a voxel that has some.
  void set_rest(int row, float count) noexcept {
    common_->rest[static_cast<std::size_t>(row)] = count;
  }
  void set_passes(int row, std::uint16_t passes) noexcept {
    common_->passes[static_cast<std::size_t>(row)] = passes;
  }

  /// Label components that any voxel may have, a bit each.
  [[nodiscard]] std::uint64_t components() const noexcept { return common_->components; }
  [[nodiscard]] float count(int component, int row) const noexcept {
    return sums_[static_cast<std::size_t>(component) * kBlockVoxels +
                 static_cast<std::size_t>(row)];
  }
  [[nodiscard]] float rest(int row) const noexcept {
    return common_->rest[static_cast<std::size_t>(row)];
  }
  [[nodiscard]] unsigned passes(int row) const noexcept {
    return common_->passes[static_cast<std::size_t>(row)];
  }
  [[nodiscard]] Centroid centroid(int row) const noexcept {
    return common_->centroids[static_cast<std::size_t>(row)];
  }
  /// Whether nothing was added since it was cleared. O(1).
  [[nodiscard]] bool is_untouched() const noexcept {
    return (common_->components | common_->rest_rows | common_->pass_rows |
            common_->centroid_rows) == 0;
  }
  /// Whether there is any evidence.
  [[nodiscard]] bool any() const noexcept { return (label_octets() | pass_octets()) != 0; }
  [[nodiscard]] bool any_rest() const noexcept { return common_->rest_rows != 0; }
  /// Octets with label evidence, the rest included, a bit each. O(components * octets).
  [[nodiscard]] std::uint64_t label_octets() const noexcept {
    std::uint64_t rows = common_->rest_rows;
    for (std::uint64_t rest = common_->components; rest != 0; rest &= rest - 1)
      rows |= common_->touched[first_of(rest)];
    const auto holds = [this](int row) {
      if (common_->rest[static_cast<std::size_t>(row)] > 0.0F) return true;
      for (std::uint64_t rest = common_->components; rest != 0; rest &= rest - 1) {
        if (count(std::countr_zero(rest), row) > 0.0F) return true;
      }
      return false;
    };
    return octets_where(rows, holds);
  }
  /// Octets with free passes, a bit each. O(octets).
  [[nodiscard]] std::uint64_t pass_octets() const noexcept {
    return octets_where(common_->pass_rows, [this](int row) { return passes(row) != 0; });
  }
  /// The label components, as a map takes them.
  [[nodiscard]] BlockEvidence labels() const noexcept {
    return {.sums = sums_.data(),
            .row = kBlockEdge,
            .component = kBlockVoxels,
            .components = common_->components,
            .touched = common_->touched.data(),
            .touched_stride = 1,
            .centroids = common_->centroids.data()};
  }

 private:
  struct Common {
    std::uint64_t components = 0;
    std::uint64_t rest_rows = 0;
    std::uint64_t pass_rows = 0;
    std::uint64_t centroid_rows = 0;
    std::array<std::uint64_t, kMaxComponents> touched{};
    std::array<float, kBlockVoxels> rest{};
    std::array<std::uint16_t, kBlockVoxels> passes{};
    std::array<Centroid, kBlockVoxels> centroids{};
  };
  [[nodiscard]] static std::size_t first_of(std::uint64_t bits) noexcept {
    return static_cast<std::size_t>(std::countr_zero(bits));
  }
  /// Of the octets that have rows of these, those where any voxel is such.
  template <class Holds>
  [[nodiscard]] static std::uint64_t octets_where(std::uint64_t rows, Holds&& holds) noexcept {
    std::uint64_t candidates = 0;
    for (; rows != 0; rows &= rows - 1) {
      const auto row = static_cast<unsigned>(std::countr_zero(rows));
      candidates |= std::uint64_t{15} << (4U * ((row & 7U) >> 1U) + 16U * (row >> 4U));
    }
    std::uint64_t found = 0;
    for (std::uint64_t rest = candidates; rest != 0; rest &= rest - 1) {
      const int corner = row_order_corner(std::countr_zero(rest));
      bool any = false;
      for (int v = 0; v < kOctetVoxels && !any; ++v) any = holds(corner + row_order(0, v));
      if (any) found |= rest & (~rest + 1);
    }
    return found;
  }
  [[nodiscard]] static std::uint64_t row_bit(int row) noexcept {
    return std::uint64_t{1} << (static_cast<unsigned>(row) >> 3U);
  }

  std::span<float> sums_;  ///< Of each component, in row order.
  Common* common_ = nullptr;
};

}  // namespace tessera
