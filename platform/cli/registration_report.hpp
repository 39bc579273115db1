// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The part of the report of map about cameras, depth images and motion.
#pragma once

#include <optional>

#include "base/json.hpp"
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
  std::uint64_t unplaced = 0;  ///< Points without time or pose; they were not moved.
  std::uint64_t projected_scans = 0;
  std::uint64_t points = 0;  ///< Of these scans.
  std::uint64_t labelled = 0;
  std::uint64_t occluded = 0;          ///< By one camera each.
  std::uint64_t cameras_left_out = 0;  ///< For one scan each.
  std::uint64_t depth_images = 0;
  std::uint64_t depth_points = 0;
  std::uint64_t no_depth = 0;  ///< Sampled pixels, as the next.
  std::uint64_t depth_refused = 0;

  void add(const RegistrationRecord& record);
  /// Adds "deskew", "projection" and "depth" to the totals, if there was any.
  void write(Json& totals) const;
  /// Prints a line for each on stdout, and warnings on stderr.
  void print() const;
};

/// Adds "deskew", "projection" and "depth" to the record of a scan, if there was any.
void write_registration(const RegistrationRecord& record, Json& scan);

}  // namespace tessera
