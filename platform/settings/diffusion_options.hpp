// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Options for fusing contributions into one map.
#pragma once

#include <optional>
#include <string>

#include "base/number_text.hpp"
#include "base/outcome.hpp"
#include "tessera/fusion/diffusion_config.hpp"
#include "tessera/map/map_config.hpp"

namespace tessera {

struct DiffusionOptions {
  std::string mode = to_string(DiffusionConfig{}.mode);  ///< contractive, paper or none.
  std::string edge = to_string(DiffusionConfig{}.edge);  ///< none, label, similarity or confidence.
  std::optional<int> iterations;                         ///< Default: 8, in paper mode 2.
  std::optional<double> length_m;  ///< Default: two voxels, in paper mode three.
  double alpha = decimal_of(DiffusionConfig{}.alpha);
  double omega = 1.0;
  bool whole_map = false;
};

/// map: of the contributions. mode and edge must be valid names. Fails with kUsage, naming the
/// option, iff a value is out of its range.
Outcome<DiffusionConfig> diffusion_of(const DiffusionOptions& options, const MapConfig& map);

}  // namespace tessera
