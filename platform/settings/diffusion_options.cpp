// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "settings/diffusion_options.hpp"

#include <initializer_list>
#include <optional>

#include "base/number_text.hpp"
#include "tessera/fusion/internal/diffusion_brick.hpp"

namespace tessera {

namespace {

template <class Value>
std::optional<Value> named(const std::string& name, std::initializer_list<Value> values) {
  for (const Value value : values) {
    if (name == to_string(value)) return value;
  }
  return std::nullopt;
}

}  // namespace

Outcome<DiffusionConfig> diffusion_of(const DiffusionOptions& options, const MapConfig& map) {
  DiffusionConfig config;
  config.mode = *named(options.mode,
                       {DiffusionMode::kContractive, DiffusionMode::kPaper, DiffusionMode::kNone});
  config.edge = *named(options.edge, {EdgeTerm::kNone, EdgeTerm::kLabel, EdgeTerm::kSimilarity,
                                      EdgeTerm::kConfidence});
  const bool paper = config.mode == DiffusionMode::kPaper;
  config.iterations = options.iterations.value_or(paper ? 2 : DiffusionConfig{}.iterations);
  config.length_m =
      static_cast<float>(options.length_m.value_or((paper ? 3.0 : 2.0) * map.resolution_m));
  config.alpha = static_cast<float>(options.alpha);
  config.omega = static_cast<float>(options.omega);
  config.prior = static_cast<float>(map.prior);
  config.whole_map = options.whole_map;
  const int least = paper ? 1 : 0;
  if (config.iterations < least || config.iterations > DiffusionConfig::kMostHalo)
    return not_allowed("--iterations", std::to_string(config.iterations),
                       paper ? "1 to 16" : "0 to 16");
  if (!(config.alpha > 0.0F && config.alpha < 1.0F))
    return not_allowed("--alpha", text_of(options.alpha), "a number between 0 and 1");
  if (!(config.omega >= 1e-6F && config.omega <= 1000.0F))
    return not_allowed("--omega", text_of(options.omega), "a number from 1e-6 to 1000");
  if (!(config.length_m > 0.0F && config.length_m <= 1e3F))
    return not_allowed("--diffusion-length", text_of(static_cast<double>(config.length_m)),
                       "metres above 0");
  const DiffusionStencil stencil(static_cast<double>(config.length_m) / map.resolution_m);
  if (static_cast<double>(config.length_m) > 9.0 * map.resolution_m ||
      DiffusionBrick::halo_of(config, stencil.reach()) > DiffusionConfig::kMostHalo) {
    return Failure{
        "--diffusion-length times --iterations reaches over 16 voxels; give less of one"};
  }
  return config;
}

}  // namespace tessera
