// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Local maps into one global map, from their blocks to a map that is up to date.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "mapping/fuse_report.hpp"
#include "mapping/fuse_setup.hpp"
#include "mapping/stored_map.hpp"

namespace tessera {

/// Told from time to time how many blocks are done, and of how many.
using FuseProgress = std::function<void(std::uint32_t done, std::uint32_t total)>;

class FusionRun {
 public:
  /// Takes the memory for it. inputs: two or more, as arrange_inputs gives them. Fails with kUsage
  /// iff an option is out of its range or the budget holds no map; with kFailure iff the system
  /// does not give the memory.
  static Outcome<std::unique_ptr<FusionRun>> prepare(const std::vector<FuseInput>& inputs,
                                                     const FuseOptions& options,
                                                     const DiffusionConfig& diffusion);
  FusionRun(const FusionRun&) = delete;
  FusionRun& operator=(const FusionRun&) = delete;
  FusionRun(FusionRun&&) = delete;
  FusionRun& operator=(FusionRun&&) = delete;
  ~FusionRun() = default;

  /// Publishes every block and fuses, once. inputs: those that it was prepared for. Does not use
  /// the heap unless it fails. What has no room is counted in the report. Fails with kFailure iff
  /// the global map refuses a map or a block.
  Outcome<void> fuse(const std::vector<FuseInput>& inputs, const FuseProgress& progress);
  /// Measures what has come of it.
  void measure();

  [[nodiscard]] FuseRun& run() noexcept { return run_; }
  [[nodiscard]] const LocalMap& map() const noexcept { return global_.map(); }

 private:
  FusionRun() = default;

  ArenaMemory scratch_;
  ArenaMemory memory_;
  GlobalMap global_;
  FuseRun run_;
};

}  // namespace tessera
