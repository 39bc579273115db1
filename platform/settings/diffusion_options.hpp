// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Options for fusing contributions into one map.
#pragma once

#include <optional>

#include "base/number_text.hpp"
#include "base/outcome.hpp"
#include "settings/setting.hpp"
#include "tessera/fusion/diffusion_config.hpp"
#include "tessera/map/map_config.hpp"

namespace tessera {

struct DiffusionOptions {
  DiffusionMode mode = DiffusionConfig{}.mode;
  EdgeTerm edge = DiffusionConfig{}.edge;
  std::optional<int> iterations;
  std::optional<double> length_m;
  double alpha = decimal_of(DiffusionConfig{}.alpha);
  double omega = 1.0;
  bool whole_map = false;
  bool reliability = DiffusionConfig{}.weigh_robots;
  double reliability_alarm = decimal_of(DiffusionConfig{}.reliability_alarm);
};

template <>
inline constexpr std::array kChoicesOf<DiffusionMode>{DiffusionMode::kContractive,
                                                      DiffusionMode::kPaper, DiffusionMode::kNone};
template <>
inline constexpr std::array kChoicesOf<EdgeTerm>{EdgeTerm::kNone, EdgeTerm::kLabel,
                                                 EdgeTerm::kSimilarity, EdgeTerm::kConfidence};

inline constexpr Setting kDiffusionRows[] = {
    row<&DiffusionOptions::mode>({"--diffusion", "fusion", "diffusion"},
                                 "How evidence spreads between voxels; none: the plain sum"),
    row<&DiffusionOptions::iterations>({"--iterations", "fusion", "iterations"},
                                       "Iterations n of the diffusion; paper: at least 1",
                                       {.value = "N",
                                        .otherwise = "4; paper: 2",
                                        .allowed = from_to(0.0, DiffusionConfig::kMostHalo)}),
    row<&DiffusionOptions::length_m>(
        {"--diffusion-length", "fusion", "diffusion_length_m"},
        "Length D of the diffusion kernel; times the iterations, it reaches 16 voxels at most",
        {.value = "M", .otherwise = "2 voxels; paper: 3", .allowed = above(0.0, 1000.0, "metres")}),
    row<&DiffusionOptions::alpha>({"--alpha", "fusion", "alpha"},
                                  "Share that neighbours contribute (contractive)",
                                  {.value = "A", .allowed = between(0.0, 1.0)}),
    row<&DiffusionOptions::omega>({"--omega", "fusion", "omega"}, "Factor for all evidence",
                                  {.value = "W", .allowed = from_to(1e-6, 1000.0)}),
    row<&DiffusionOptions::edge>({"--edge", "fusion", "edge"}, "Edge term (contractive)"),
    row<&DiffusionOptions::whole_map>(
        {"--whole-map", "fusion", "whole_map"},
        "Diffuse wherever there are labels, not only where robots overlap", {.flag = true}),
    row<&DiffusionOptions::reliability>(
        {"--reliability", "fusion", "reliability"},
        "A robot's labels count by how reliable they are (contractive)"),
    row<&DiffusionOptions::reliability_alarm>(
        {"--reliability-alarm", "fusion", "reliability_alarm"},
        "Robots and classes that are less reliable are named",
        {.value = "R", .allowed = from_to(0.0, 1.0)}),
};
inline constexpr SettingTable<DiffusionOptions> kDiffusionSettings{kDiffusionRows};

/// map: of the contributions. Fails with kUsage iff iterations and length reach too far together,
/// or there are none in paper mode; each option by itself is in its range.
Outcome<DiffusionConfig> diffusion_of(const DiffusionOptions& options, const MapConfig& map);

}  // namespace tessera
