// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "settings/diffusion_options.hpp"

#include <fmt/core.h>

#include "tessera/fusion/internal/diffusion_brick.hpp"

namespace tessera {

Outcome<DiffusionConfig> diffusion_of(const DiffusionOptions& options, const MapConfig& map) {
  DiffusionConfig config;
  config.mode = options.mode;
  config.edge = options.edge;
  const bool paper = config.mode == DiffusionMode::kPaper;
  config.iterations = options.iterations.value_or(paper ? 2 : DiffusionConfig{}.iterations);
  config.length_m =
      static_cast<float>(options.length_m.value_or((paper ? 3.0 : 2.0) * map.resolution_m));
  config.alpha = static_cast<float>(options.alpha);
  config.omega = static_cast<float>(options.omega);
  config.prior = static_cast<float>(map.prior);
  config.whole_map = options.whole_map;
  config.weigh_robots = options.reliability;
  config.reliability_alarm = static_cast<float>(options.reliability_alarm);
  if (!(config.alpha > 0.0F && config.alpha < 1.0F))  // as a float
    return not_allowed(kDiffusionSettings["--alpha"], text_of(options.alpha),
                       "a number between 0 and 1");
  const SettingName& iterations = kDiffusionSettings["--iterations"];
  if (paper && config.iterations == 0)
    return not_allowed(iterations, "0", fmt::format("1 to {}", DiffusionConfig::kMostHalo));
  const DiffusionStencil stencil(static_cast<double>(config.length_m) / map.resolution_m);
  if (static_cast<double>(config.length_m) > 9.0 * map.resolution_m ||
      DiffusionBrick::halo_of(config, stencil) > DiffusionConfig::kMostHalo) {
    return Failure{Message(kDiffusionSettings["--diffusion-length"]) + " times " + iterations +
                   " reaches over 16 voxels; give less of one"};
  }
  return config;
}

}  // namespace tessera
