// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a moving window and its archive did, for reports.
#pragma once

#include "base/json.hpp"
#include "maps/held_archive.hpp"

namespace tessera {

/// Totals of the moving window, and what the archive holds in the end.
struct WindowTotals : WindowReport {
  double radius_m = 0.0;
  std::uint64_t archived_blocks = 0;
  std::uint64_t archive_bytes = 0;  ///< Of the file.
  std::uint64_t index_bytes = 0;    ///< Of the budget.
};

/// archive: null if there is none.
WindowTotals totals_of(const WindowReport& window, double radius_m, const HeldArchive* archive);

Json to_json(const WindowTotals& totals);

}  // namespace tessera
