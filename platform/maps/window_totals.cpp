// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/window_totals.hpp"

#include "base/counters_json.hpp"

namespace tessera {

WindowTotals totals_of(const WindowReport& window, double radius_m, const HeldArchive* archive) {
  WindowTotals totals{window};
  totals.radius_m = radius_m;
  if (archive == nullptr) return totals;
  const ArchiveFile& file = **archive;
  totals.merged += file.blocks().counts().evictions_merged;
  totals.archived_blocks = file.blocks().index().size();
  totals.archive_bytes = file.file_bytes();
  totals.index_bytes = archive->memory_bytes();
  return totals;
}

Json to_json(const WindowTotals& w) {
  Json json = {{"radius_m", w.radius_m},
               {"archived_blocks", w.archived_blocks},
               {"archive_bytes", w.archive_bytes},
               {"index_bytes", w.index_bytes}};
  add_counters(json, static_cast<const WindowReport&>(w));
  return json;
}

}  // namespace tessera
