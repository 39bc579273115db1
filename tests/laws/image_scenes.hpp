// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Scans of simple scenes, to be carved by their image.
#pragma once

#include <cmath>
#include <functional>
#include <numbers>

#include "oracle/carving_oracle.hpp"
#include "support/mapper.hpp"

namespace tessera::oracle {

inline constexpr double kRadians = std::numbers::pi / 180.0;

inline InferenceConfig by_image(double max_range_m) {
  InferenceConfig config;
  config.mode = InferenceMode::kCounting;
  config.free_space.carving = Carving::kImage;
  config.min_range_m = 0.05F;
  config.max_range_m = static_cast<float>(max_range_m);
  config.thinning_m = 0.0;
  return config;
}

/// Range of a return in a direction, metres; 0: none.
using Scene = std::function<double(double azimuth_rad, double elevation_rad)>;

/// A sensor that looks around from low to high in rows step_deg apart.
inline Cloud scan_of(const Scene& scene, double low_deg, double high_deg, double row_deg,
                     double column_deg) {
  Cloud cloud;
  for (double e = low_deg; e <= high_deg; e += row_deg) {
    for (double a = -180.0; a < 180.0; a += column_deg) {
      const double range_m = scene(a * kRadians, e * kRadians);
      if (range_m <= 0.0) continue;
      const double level_m = range_m * std::cos(e * kRadians);
      cloud.add(level_m * std::cos(a * kRadians), level_m * std::sin(a * kRadians),
                range_m * std::sin(e * kRadians), 1);
    }
  }
  return cloud;
}

/// Steps of depth in all directions, and gaps.
inline double broken_room(double azimuth_rad, double elevation_rad) {
  const double wave = std::sin(7.0 * azimuth_rad) + std::sin(9.0 * elevation_rad + azimuth_rad);
  if (wave > 1.7) return 0.0;
  return wave < -0.9 ? 1.1 : wave < 0.0 ? 2.3 : wave < 0.8 ? 2.9 + 0.3 * wave : 5.0;
}

inline bool is_free(const Mapper& mapper, const Vector& p) {
  return mapper.map().evidence(Point3d(p[0], p[1], p[2]).cast<float>()).sigma[0] > 0.0F;
}

}  // namespace tessera::oracle
