// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What maps of earlier days add to the sums of a block (map_session.hpp). In each voxel a session
// counts once, whoever has it, by its weight; and all sessions together count no more than a
// quarter of the cap that the robots' maps have, so that what is seen today overrules them.
#pragma once

#include <array>
#include <span>

#include "tessera/map/block_content.hpp"
#include "tessera/replica/map_session.hpp"

namespace tessera {

class SessionShare {
 public:
  /// num_components: C + 2; contributions: at most.
  [[nodiscard]] static constexpr std::size_t required_bytes(int num_components,
                                                            std::uint32_t contributions) noexcept {
    return BlockContent::required_bytes(num_components) + arena_bytes<Voxels>(1) +
           arena_bytes<Seen>(contributions);
  }
  /// max_evidence, free_weight: of the robots' maps, as MapConfig has them. Fails with
  /// kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<SessionShare> make(Arena& arena, int num_components,
                                                 std::uint32_t contributions, float max_evidence,
                                                 float free_weight) noexcept;
  /// Holds nothing and takes nothing.
  SessionShare() noexcept = default;

  /// Begins with a block that no session has evidence of yet. O(1).
  void begin_block() noexcept {
    entered_ = false;
    seen_count_ = 0;
  }
  /// Begins with a contribution: in each voxel those before it that have its name count, and it
  /// does not. Returns the work: names in the block. The first call takes O(rows touched) too.
  std::uint64_t begin(const MapSession& session) noexcept;
  /// Voxels in which one before it counts.
  [[nodiscard]] const VoxelMask& hidden() const noexcept { return voxels_->hidden; }
  /// Notes that it has evidence of the voxel, of whatever kind. row: a voxel's row order. O(1).
  void observe(int row) noexcept { add_row(voxels_->observed, row); }
  /// Adds label evidence; component 0: a rest. O(1).
  void add_labels(int row, int component, float count) noexcept {
    const float weighted = count * weight_;
    voxels_->labels[static_cast<std::size_t>(row)] += weighted;
    if (component == 0) {
      content_.add_rest(row, weighted);
    } else {
      content_.add(component, row, weighted);
    }
  }
  /// Adds free passes, from 1: rounded down, but never to none. O(1).
  void add_passes(int row, unsigned passes) noexcept {
    const unsigned weighted = passes * units_ / MapSession::kFullWeight;
    content_.add_passes(row, weighted != 0 ? weighted : 1);
  }
  /// After the last call for a contribution. O(names).
  void end() noexcept;
  /// Adds what sessions have of the block to sums, labels times omega. last_class: C. labelled: set
  /// iff there is any of a class. Returns the work, at most 512 (C + 2). O(512 + that).
  std::uint64_t end_block(BlockContent& sums, float omega, int last_class, bool& labelled) noexcept;

 private:
  struct Voxels {
    VoxelMask hidden{};
    VoxelMask observed{};  ///< Of this contribution.
    VoxelMask any{};       ///< Of all.
    std::array<float, kBlockVoxels> labels{};
  };
  /// Voxels of which contributions of this name have evidence.
  struct Seen {
    std::uint64_t digest = 0;
    VoxelMask voxels{};
  };
  [[nodiscard]] float scale_of(int row, unsigned passes) const noexcept;

  BlockContent content_{};
  Voxels* voxels_ = nullptr;
  std::span<Seen> seen_;
  std::size_t seen_count_ = 0;
  Seen* now_ = nullptr;
  std::uint32_t units_ = 0;  ///< Weight of the contribution.
  float weight_ = 0.0F;
  float most_ = 0.0F;  ///< Evidence of a voxel.
  float free_weight_ = 0.0F;
  bool entered_ = false;
};

}  // namespace tessera
