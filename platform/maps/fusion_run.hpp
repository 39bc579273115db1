// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Fuses local maps into one global map that is up to date.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "maps/fuse_report.hpp"
#include "maps/fuse_setup.hpp"
#include "maps/stored_map.hpp"

namespace tessera {

/// Called from time to time with the number of finished blocks and of all.
using FuseProgress = std::function<void(std::uint32_t done, std::uint32_t total)>;

class FusionRun {
 public:
  /// Allocates the memory. inputs: two or more, as returned by arrange_inputs. Fails with kUsage
  /// iff an option is out of its range or the budget is too small for a map; with kFailure iff the
  /// system does not give the memory.
  static Outcome<std::unique_ptr<FusionRun>> prepare(const std::vector<FuseInput>& inputs,
                                                     const FuseOptions& options,
                                                     const DiffusionConfig& diffusion);
  FusionRun(const FusionRun&) = delete;
  FusionRun& operator=(const FusionRun&) = delete;
  FusionRun(FusionRun&&) = delete;
  FusionRun& operator=(FusionRun&&) = delete;
  ~FusionRun() = default;

  /// Publishes every block and fuses, once. inputs: those of prepare. Does not use the heap unless
  /// it fails. Counts what does not fit in the report. Fails with kFailure iff the global map
  /// refuses a map or a block.
  Outcome<void> fuse(const std::vector<FuseInput>& inputs, const FuseProgress& progress);
  /// Measures the result. digest: of the global map, where it is known already.
  void measure(std::optional<std::uint64_t> digest = {});

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
