// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/window_totals.hpp"

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
  return {{"radius_m", w.radius_m},
          {"evicted", w.evicted},
          {"evictions_refused", w.evictions_refused},
          {"reloaded", w.reloaded},
          {"merged", w.merged},
          {"reloads_failed", w.reloads_failed},
          {"steps_without_room", w.steps_without_room},
          {"backlog", w.backlog},
          {"most_backlog", w.most_backlog},
          {"most_evicted", w.most_evicted},
          {"most_reloaded", w.most_reloaded},
          {"lost_blocks", w.lost_blocks},
          {"unpublished_blocks", w.unpublished_blocks},
          {"archived_blocks", w.archived_blocks},
          {"archive_bytes", w.archive_bytes},
          {"index_bytes", w.index_bytes}};
}

}  // namespace tessera
