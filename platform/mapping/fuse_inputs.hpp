// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The local maps that are to become one: loaded, compared, and put into an order that does not hang
// on the order in which they were named.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "mapping/outputs.hpp"
#include "mapping/stored_map.hpp"
#include "posix/outcome.hpp"
#include "tessera/fusion/alignment.hpp"
#include "tessera/fusion/replicas.hpp"

namespace tessera {

struct FuseInput {
  std::string path;  ///< Or whatever names it in messages.
  std::shared_ptr<const StoredMap> stored;
  std::uint64_t digest = 0;
  ContributionId id;
  bool placed = false;  ///< T_global_map was given, or the map says it.
  Matrix34d T_global_map = Matrix34d::Identity();
  GridTransform frame;
};

/// transforms: as typed, FILE.tsm=T.txt. As arrange_inputs. Fails with kUsage iff a file is
/// missing, damaged or a global map, or named twice; a transform is bad or names no map; or as
/// arrange_inputs.
Outcome<std::vector<FuseInput>> load_inputs(const std::vector<std::string>& paths,
                                            const std::vector<std::string>& transforms,
                                            std::vector<std::string>& warnings);

/// A map that is in memory already, which must not change as long as it is an input. The header's
/// content and storage are to be those of the map. Fails with kUsage iff it is a global map.
Outcome<FuseInput> to_fuse(std::string name, std::shared_ptr<const StoredMap> stored);

/// Sorts by robot, epoch and content, and gives each its frame. Maps that name the same robot and
/// epoch are taken for different robots. Of maps of one robot and several epochs the newest counts
/// in each voxel of the global grid where it has evidence. What people should know about the inputs
/// is added to warnings. Fails with kUsage iff resolutions, classes, priors or free weights differ,
/// or a transform puts a map out of the grid.
Outcome<std::vector<FuseInput>> arrange_inputs(std::vector<FuseInput> inputs,
                                               std::vector<std::string>& warnings);

/// The files that these words name, for check_outputs; option: of the maps.
std::vector<NamedFile> files_of(const std::vector<std::string>& paths,
                                const std::vector<std::string>& transforms, const char* option);

/// How two of the maps lie on each other.
struct PairAlignment {
  std::size_t first = 0;
  std::size_t second = 0;
  Alignment alignment;
};
/// Of all pairs that have labels in common, by up to 20,000 voxels each. Where they are off, that
/// is added to warnings.
std::vector<PairAlignment> align_inputs(const std::vector<FuseInput>& inputs,
                                        std::vector<std::string>& warnings);

}  // namespace tessera
