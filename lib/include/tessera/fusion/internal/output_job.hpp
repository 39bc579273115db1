// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Blocks of the graph whose outputs are under way, from step to step: those that wait in one cube
// go through the diffusion together, for they depend on much the same nodes. Nothing else is
// brought up to date meanwhile, so that the sums stay as they were gathered.
#pragma once

#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/fusion/internal/diffusion_brick.hpp"
#include "tessera/fusion/internal/global_records.hpp"
#include "tessera/fusion/internal/sum_store.hpp"

namespace tessera {

class OutputJob {
 public:
  [[nodiscard]] static constexpr std::size_t required_bytes(const DiffusionConfig& config,
                                                            double resolution_m,
                                                            int num_components) noexcept {
    return DiffusionBrick::required_bytes(config, resolution_m, num_components) +
           arena_bytes<std::uint32_t>(cube(DiffusionBrick::kMostBlocks)) +
           arena_bytes<std::uint32_t>(cube(DiffusionBrick::kMostEdge / kBlockEdge));
  }
  /// Fails as DiffusionBrick::make.
  [[nodiscard]] static Result<OutputJob> make(Arena& arena, const DiffusionConfig& config,
                                              double resolution_m, int num_components) noexcept;
  OutputJob() noexcept = default;

  /// Whether a job is under way.
  [[nodiscard]] bool busy() const noexcept { return stage_ != Stage::kNone; }
  /// Blocks that are not finished.
  [[nodiscard]] std::uint32_t waiting() const noexcept { return last_ - first_; }
  /// Takes those that wait around a block off the agenda and gathers what they depend on. Returns
  /// the work done. number: waits for its output; no job is under way.
  std::uint64_t begin(GlobalRecords& records, SumStore& sums, std::uint32_t number) noexcept;
  /// Links the nodes, or iterates once. Returns the work done. The job is under way, and not
  /// finishing.
  std::uint64_t work_on(GlobalRecords& records, SumStore& sums) noexcept;
  /// Whether the results are there: of next(), until done() is called.
  [[nodiscard]] bool finishing() const noexcept { return stage_ == Stage::kFinishing; }
  [[nodiscard]] std::uint32_t next() const noexcept { return blocks_[first_]; }
  [[nodiscard]] DiffusionBrick& brick() noexcept { return brick_; }
  [[nodiscard]] const DiffusionBrick& brick() const noexcept { return brick_; }
  void done() noexcept;
  /// Blocks that depend on this one's sums.
  [[nodiscard]] GridTransform::BlockRange around(BlockCoord block) const noexcept {
    const int r = reach();
    return {{block.x - r, block.y - r, block.z - r}, {block.x + r, block.y + r, block.z + r}};
  }

 private:
  enum class Stage : std::uint8_t { kNone, kLinking, kIterating, kFinishing };
  [[nodiscard]] static constexpr std::size_t cube(int edge) noexcept {
    const auto e = static_cast<std::size_t>(edge);
    return e * e * e;
  }
  /// How far what a block depends on reaches, in blocks.
  [[nodiscard]] int reach() const noexcept { return (brick_.halo() + kBlockEdge - 1) / kBlockEdge; }
  [[nodiscard]] static BlockBox waiting_around(const GlobalRecords& records, BlockCoord block,
                                               int edge) noexcept;
  [[nodiscard]] std::span<const std::uint32_t> find_sums(const GlobalRecords& records,
                                                         const BlockBox& box,
                                                         std::uint64_t& classes) noexcept;
  [[nodiscard]] bool gather(const GlobalRecords& records, SumStore& sums, const BlockBox& box,
                            std::uint64_t& work) noexcept;
  std::uint64_t begin_smaller(GlobalRecords& records, SumStore& sums) noexcept;

  DiffusionBrick brick_{};
  std::span<std::uint32_t> blocks_;  ///< Records of the job's box.
  std::span<std::uint32_t> near_;    ///< Scratch: records that the job depends on.
  Stage stage_ = Stage::kNone;
  int edge_ =
      DiffusionBrick::kMostBlocks;  ///< Of the cube that the next job is part of, in blocks.
  std::uint32_t first_ = 0;         ///< In blocks_: of those that are not finished.
  std::uint32_t last_ = 0;
};

}  // namespace tessera
