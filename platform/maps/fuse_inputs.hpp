// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The local maps to fuse: loads and compares them, and sorts them independently of the order in
// which they were named.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/outcome.hpp"
#include "base/outputs.hpp"
#include "maps/stored_map.hpp"
#include "tessera/replica/replicas.hpp"

namespace tessera {

struct FuseInput {
  std::string path;  ///< Or another name for messages.
  std::shared_ptr<const StoredMap> stored;
  std::uint64_t digest = 0;
  ContributionId id;
  bool placed = false;  ///< T_global_map was given, or is in the map.
  Matrix34d T_global_map = Matrix34d::Identity();
  Matrix34d T_map_submap = Matrix34d::Identity();  ///< Of a map that is in submaps.
  GridTransform frame;                             ///< Of these two.
  std::optional<MapSession> session{};  ///< Of a map of an earlier day (fuse_sessions.hpp).
};

/// Loads and arranges maps. transforms: as typed, FILE.tsm=T.txt. Fails as arrange_inputs, and with
/// kUsage iff a file is missing, damaged or a global map, or named twice, or a transform is invalid
/// or names no map.
Outcome<std::vector<FuseInput>> load_inputs(const std::vector<std::string>& paths,
                                            const std::vector<std::string>& transforms,
                                            std::vector<Message>& warnings);

/// The submaps of a file, each an input. header: as load_map_header gave it. Fails as load_submaps
/// and load_submap, and with kUsage iff there are over Replicas::kMostContributions.
Outcome<std::vector<FuseInput>> load_submap_inputs(const std::string& path,
                                                   const MapFileHeader& header);

/// A map that is already in memory, and must not change as long as it is an input. Content and
/// storage in the header must be those of the map. Fails with kUsage iff it is a global map.
Outcome<FuseInput> to_fuse(std::string name, std::shared_ptr<const StoredMap> stored);

/// Sorts by robot, epoch and content, and gives each its frame. Maps that name the same robot and
/// epoch are taken for different robots. Of maps of one robot and several epochs the newest counts
/// in each voxel of the global grid where it has evidence. Adds warnings
/// about the inputs. Fails with kUsage iff resolutions, classes, priors or free weights differ,
/// or a transform puts a map outside of the grid.
Outcome<std::vector<FuseInput>> arrange_inputs(std::vector<FuseInput> inputs,
                                               std::vector<Message>& warnings);

/// Adds a warning iff no map has a frame, for who puts them into one, or one for each that has none
/// beside others.
void warn_of_no_frame(const std::vector<FuseInput>& inputs, std::vector<Message>& warnings);

/// The options for the frames of maps.
inline constexpr SettingName kTransform{.option = "--transform", .argument = "transforms"};
inline constexpr SettingName kAlign{.option = "--align"};

/// The files named by these arguments, for check_outputs; option: of the maps.
std::vector<NamedFile> files_of(const std::vector<std::string>& paths,
                                const std::vector<std::string>& transforms, const char* option);

}  // namespace tessera
