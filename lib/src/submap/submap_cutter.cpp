// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/submap/submap_cutter.hpp"

#include <algorithm>

namespace tessera {

namespace {

/// So much of the way or time of SubmapCuts a submap has at least: one that fills at once must not
/// take all places.
constexpr double kLeastOfFull = 0.25;

}  // namespace

std::optional<SubmapEnd> SubmapCutter::note(const Point3d& p_map, std::int64_t stamp_us,
                                            const SubmapAllowance& may) noexcept {
  const double step_m = has_last_ ? norm(p_map - last_p_map_) : 0.0;
  last_us_ = has_last_ ? std::max(last_us_, stamp_us) : stamp_us;
  if (!has_last_) since_us_ = stamp_us;
  has_last_ = true;
  last_p_map_ = p_map;
  // What it did not drive is no way.
  if (cuts_.jump_m > 0.0 && step_m > cuts_.jump_m) return SubmapEnd::kJump;
  way_m_ += step_m;
  // Parts of what the submap may have; none of what has no limit.
  const double way = cuts_.length_m > 0.0 ? way_m_ / (cuts_.length_m * may.stretch) : 0.0;
  const double time = cuts_.time_us > 0 ? static_cast<double>(last_us_ - since_us_) /
                                              (static_cast<double>(cuts_.time_us) * may.stretch)
                                        : 0.0;
  if (way >= 1.0) return SubmapEnd::kLength;
  if (time >= 1.0) return SubmapEnd::kTime;
  if (may.is_full && std::max(way, time) * may.stretch >= kLeastOfFull) return SubmapEnd::kMemory;
  return std::nullopt;
}

}  // namespace tessera
