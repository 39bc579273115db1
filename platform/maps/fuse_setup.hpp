// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The options of "fuse", and their conversion to configurations of the library.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/outcome.hpp"
#include "maps/fuse_inputs.hpp"
#include "settings/diffusion_options.hpp"
#include "settings/map_options.hpp"
#include "tessera/fusion/global_map.hpp"

namespace tessera {

struct FuseOptions {
  std::vector<std::string> maps;
  std::string out;
  std::string report;
  std::vector<std::string> transforms;
  std::vector<std::string> sessions;
  bool align = false;
  DiffusionOptions diffusion;
  std::optional<TuplePolicy> counts;
  std::optional<std::size_t> memory_bytes;
};

inline constexpr Setting kFuseRows[] = {
    row<&FuseOptions::align>(
        kAlign, "Find the frames of the maps from their contents; T_global_map is a guess",
        {.flag = true}),
    row<&FuseOptions::counts>(
        {"--counts"}, "How counts of the global map are stored",
        {.otherwise = "dense in paper mode or if all maps are, else compact"}),
    bytes_row<&FuseOptions::memory_bytes>(
        {.option = "--memory", .argument = "memory_bytes"},
        "Memory for the global map and for fusing, without the local maps",
        {.value = "BYTES", .otherwise = "what the maps need", .allowed = {.most = 1e15}}),
};
inline constexpr SettingTable<FuseOptions> kFuseSettings{kFuseRows};

/// Memory for the replicas of all maps.
struct ReplicaDemand {
  std::uint32_t blocks = 0;
  std::uint32_t segments = 0;
};

/// Fails with kUsage iff there are fewer than two maps, sessions included, or more than a global
/// map can have.
Outcome<void> check_number_of_maps(std::size_t maps, std::size_t sessions = 0);
/// The same for robots.
Outcome<void> check_number_of_robots(const std::vector<FuseInput>& inputs);

/// Without a budget: capacities with which nothing is refused; unused memory is never touched. With
/// one: replicas and diffusion get what they need, the sums up to a quarter of the rest, and the
/// map what is left. Fails with kUsage iff that is too little for a map.
Outcome<GlobalMapConfig> config_for(const std::vector<FuseInput>& inputs,
                                    const FuseOptions& options, const DiffusionConfig& diffusion,
                                    const ReplicaDemand& demand);

}  // namespace tessera
