// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/posed_files.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <limits>

#include "base/number_text.hpp"
#include "scans/scan_listing.hpp"
#include "settings/source_options.hpp"

namespace tessera {

Outcome<std::vector<PosedFile>> choose_files(const FileChoice& choice,
                                             const std::vector<std::string>& paths,
                                             const PoseRows& poses) {
  const int first = choice.first.value_or(0);
  const int last = choice.last.value_or(std::numeric_limits<int>::max());
  if (first < 0 || last < 0) return Failure{"a scan number is negative; give numbers from 0 on"};
  const std::size_t end = std::min(paths.size(), static_cast<std::size_t>(last) + 1);
  const auto begin = static_cast<std::size_t>(first);
  if (begin >= end) {
    return Failure{fmt::format("no scan is in the range, {} has numbers from 0 to {}",
                               one_line(choice.folder), paths.size() - 1) +
                   choose_scans()};
  }
  const std::size_t rows = poses.T_map_sensor.size();
  if (rows < end) {
    return Failure{fmt::format("{} has {} {} files, but {} has {} poses; add the missing rows, one "
                               "for each file in the order of their numbers, or choose fewer with ",
                               one_line(choice.folder), paths.size(), choice.kind,
                               one_line(choice.poses), rows) +
                   kSourceSettings["--last"]};
  }
  std::vector<PosedFile> files;
  for (std::size_t i = begin; i < end; ++i)
    files.push_back({static_cast<int>(i), paths[i], poses.T_map_sensor[i]});
  return files;
}

}  // namespace tessera
