// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "settings/window_setup.hpp"

#include <algorithm>

namespace tessera {

SlabPool::Counts half_of_storage(const MapSetup& setup) {
  constexpr std::size_t kOctetBytes = 512;
  SlabPool::Counts counts = WindowConfig{}.reserve;
  const std::size_t bytes = counts[0] * sizeof(Block) +
                            counts[1] * label_page_bytes(setup.map.label_votes) +
                            counts[2] * sizeof(FreePage) + counts[3] * kOctetBytes;
  const double times =
      static_cast<double>(setup.map.storage_bytes / 2) / static_cast<double>(bytes);
  for (std::uint32_t& count : counts)
    count = static_cast<std::uint32_t>(times * static_cast<double>(count));
  return counts;
}

void move_all_at_once(WindowConfig& window) {
  constexpr std::uint32_t kAll = 1U << 30U;
  window.entries_per_step = window.evictions_per_step = window.pressed_evictions_per_step = kAll;
  window.regions_per_step = window.reloads_per_step = window.label_voxels_per_step = kAll;
}

void let_near_blocks_leave(MapSetup& setup, bool may_wait) {
  if (!setup.window || setup.archive_bytes == 0) return;
  WindowConfig& window = *setup.window;
  window.evicts_near = true;
  const SlabPool::Counts half = half_of_storage(setup);
  for (std::size_t i = 0; i < half.size(); ++i)
    window.reserve[i] = std::min(half[i], window.reserve[i]);
  if (may_wait) move_all_at_once(window);
}

}  // namespace tessera
