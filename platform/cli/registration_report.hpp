// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The part of map's report about cameras, depth images and motion.
#pragma once

#include <optional>

#include "mapping/report.hpp"
#include "tessera/registration/depth_image.hpp"
#include "tessera/registration/deskew.hpp"
#include "tessera/registration/label_projection.hpp"

namespace tessera {

/// What was done to a scan before it was integrated.
struct RegistrationRecord {
  std::optional<DeskewReport> deskew;
  std::optional<LabelReport> projection;
  std::optional<DepthReport> depth{};
};

/// Sums over the scans.
struct RegistrationTotals {
  std::uint64_t swept_scans = 0;
  std::uint64_t not_deskewed_scans = 0;  ///< Of these: no pose at the stamp.
  std::uint64_t moved = 0;
  std::uint64_t unplaced = 0;  ///< Points without time or pose; they stayed where they were.
  std::uint64_t projected_scans = 0;
  std::uint64_t points = 0;  ///< Of these scans.
  std::uint64_t labelled = 0;
  std::uint64_t occluded = 0;          ///< By a camera each.
  std::uint64_t cameras_left_out = 0;  ///< For a scan each.
  std::uint64_t depth_images = 0;
  std::uint64_t depth_points = 0;
  std::uint64_t no_depth = 0;  ///< Sampled pixels, as the next.
  std::uint64_t depth_refused = 0;

  void add(const RegistrationRecord& record);
  /// Adds "deskew", "projection" and "depth" to the totals, where there was any.
  void write(Json& totals) const;
  /// A line each on stdout, and warnings on stderr.
  void print() const;
};

/// Adds "deskew", "projection" and "depth" to a scan's record, where there was any.
void write_registration(const RegistrationRecord& record, Json& scan);

}  // namespace tessera
