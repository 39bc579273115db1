// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/submap/submap_cutter.hpp"

#include <algorithm>

namespace tessera {

std::optional<SubmapEnd> SubmapCutter::note(const Point3d& p_map, std::int64_t stamp_us) noexcept {
  const double step_m = has_last_ ? norm(p_map - last_p_map_) : 0.0;
  last_us_ = has_last_ ? std::max(last_us_, stamp_us) : stamp_us;
  if (!has_last_) since_us_ = stamp_us;
  has_last_ = true;
  last_p_map_ = p_map;
  // What it did not drive is no way.
  if (cuts_.jump_m > 0.0 && step_m > cuts_.jump_m) return SubmapEnd::kJump;
  way_m_ += step_m;
  if (cuts_.length_m > 0.0 && way_m_ >= cuts_.length_m) return SubmapEnd::kLength;
  if (cuts_.time_us > 0 && last_us_ - since_us_ >= cuts_.time_us) return SubmapEnd::kTime;
  return std::nullopt;
}

}  // namespace tessera
