// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a robot keeps of its submaps beside their maps, over restarts: their frames with the poses
// that corrections need, and the rows of those that are in files. A small file, written as a whole.
#pragma once

#include <string>
#include <vector>

#include "base/outcome.hpp"
#include "maps/map_journal.hpp"
#include "tessera/submap/submap_file.hpp"
#include "tessera/submap/submap_frames.hpp"

namespace tessera {

struct SubmapState {
  std::uint32_t robot = 0;
  std::uint32_t epoch = 0;            ///< In which the map was begun.
  bool in_submaps = false;            ///< Else it is one map.
  std::uint64_t boot = 0;             ///< boot_id() when the last pose was noted.
  JournalNote last{};                 ///< Of the last scan that was mapped.
  std::uint32_t first = 0;            ///< Number of the first submap.
  std::uint32_t revision = 0;         ///< Of the last correction.
  std::vector<SubmapFrame> frames{};  ///< Of all, from the first on.
  std::vector<SubmapRow> kept{};      ///< Of those that are in files, by ascending numbers.
};

std::vector<std::byte> bytes_of(const SubmapState& state);
/// bytes_of() one, durable, instead of what is at the path. Fails as AtomicFile.
Outcome<void> write_submap_state(std::span<const std::byte> bytes, const std::string& path);
/// Fails with kUsage iff the file is missing or damaged.
Outcome<SubmapState> read_submap_state(const std::string& path);

}  // namespace tessera
