// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What an earlier start of a node has left of its map in the folder of the robot's state: a journal
// of each submap that is in no file of its own yet, files of the others, and a small file with the
// frames of all.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "maps/map_journal.hpp"
#include "maps/submap_state.hpp"

namespace tessera {

/// Whose map it is, and where its files are.
struct MapName {
  std::string folder;
  std::uint32_t robot = 0;
  std::uint32_t epoch = 0;  ///< In which it was begun.
  /// "folder/robot_1.epoch-2": what the names of its files begin with.
  [[nodiscard]] std::string stem() const;
  [[nodiscard]] std::string journal(std::uint32_t submap) const;
  [[nodiscard]] std::string frames() const { return stem() + ".frames"; }
};

struct FoundMap {
  struct Journal {
    std::uint32_t submap = 0;
    std::optional<MapFileHeader> header;  ///< Nothing: it is damaged.
  };
  MapName name;
  /// Of the submap that was mapped into, and before it of the one that had ended and was in no file
  /// yet, if there was one. Empty: the last submap is in a file, so that the next one begins.
  std::vector<Journal> journals;
  std::uint32_t next = 0;   ///< Above all numbers that there are files of.
  SubmapState state;        ///< kept: those whose files are there, and are of this map.
  bool has_frames = false;  ///< Otherwise where the submaps lie is not known.
  std::vector<MapFileHeader> kept_headers;
  std::vector<std::string> notes;  ///< What is missing, damaged or of another map, a line each.

  /// Number of the first submap that is mapped into or waits for its file.
  [[nodiscard]] std::uint32_t first() const noexcept {
    return journals.empty() ? next : journals.front().submap;
  }
  /// And of the last.
  [[nodiscard]] std::uint32_t last() const noexcept {
    return journals.empty() ? next : journals.back().submap;
  }
};

/// Looks for it; nothing: there is no map. Fails with kFailure iff the system does. Of what cannot
/// be used, files get other names, so that they are not overwritten. Removes journals of submaps
/// that are in files, and what was not written whole.
Outcome<std::optional<FoundMap>> find_map(const MapName& name);

/// Whether a map with these settings, in submaps or not, can continue it.
[[nodiscard]] bool can_continue(const FoundMap& found, const MapConfig& config,
                                const ClassTable& classes, bool in_submaps);

/// Gives all files of a map other names, as another map gets these: the robot's state was lost.
/// Returns a line for each.
std::vector<std::string> set_aside(const MapName& name);

}  // namespace tessera
