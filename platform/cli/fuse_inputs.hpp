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
  std::string path;
  std::unique_ptr<StoredMap> stored;
  std::uint64_t digest = 0;
  ContributionId id;
  Matrix34d T_global_map = Matrix34d::Identity();
  GridTransform frame;
};

/// transforms: as typed, FILE.tsm=T.txt. Sorted by robot, epoch and content. Maps that name the
/// same robot and epoch are taken for different robots. Fails with kUsage iff a file is missing,
/// damaged or a global map, or named twice; resolutions, classes, priors or free weights differ; or
/// a transform is bad or names no map.
Outcome<std::vector<FuseInput>> load_inputs(const std::vector<std::string>& paths,
                                            const std::vector<std::string>& transforms);

/// The files that these words name, for check_outputs; option: of the maps.
std::vector<NamedFile> files_of(const std::vector<std::string>& paths,
                                const std::vector<std::string>& transforms, const char* option);

/// How two of the maps lie on each other.
struct PairAlignment {
  std::size_t first = 0;
  std::size_t second = 0;
  Alignment alignment;
};
/// Of all pairs that have labels in common, by up to 20,000 voxels each. Warns where they are off.
std::vector<PairAlignment> align_inputs(const std::vector<FuseInput>& inputs);

}  // namespace tessera
