// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What was left out of scans, and the sentences about it: of the command, the node and Python.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/message.hpp"
#include "scans/scan.hpp"
#include "tessera/inference/scan_report.hpp"

namespace tessera {

/// Returns, thinned points and rays that a larger budget of memory would admit.
[[nodiscard]] std::uint64_t left_out_for_memory(const ScanTotals& totals) noexcept;
/// Thinned points and rays that a larger work budget would admit.
[[nodiscard]] std::uint64_t left_out_for_work(const ScanTotals& totals) noexcept;

/// Why no return of scans, or next to none, was mapped: the reason of most of them.
enum class NothingMapped {
  kNoPoints,
  kBeyondRange,
  kTooNear,
  kOnBody,
  kNoReturn,
  kBadPose,
  kNotFinite,
  kOutOfGrid,
  kLeftOut,  ///< In range, but for lack of memory, work or time.
};

/// None iff some return was mapped, and at least one of a hundred was in range. of_bad_poses:
/// points of scans whose pose was refused.
[[nodiscard]] std::optional<NothingMapped> why_nothing_mapped(
    const ScanTotals& totals, std::uint64_t of_bad_poses = 0) noexcept;
[[nodiscard]] Message text_of(NothingMapped why, const ScanTotals& totals,
                              std::uint64_t of_bad_poses = 0);

/// "4 points of FOLDER with class ids that are in no class (7, 300)". folder: of the labels; empty:
/// not named.
[[nodiscard]] std::string text_of(const UnknownRawIds& ids, const std::string& folder = {});

}  // namespace tessera
