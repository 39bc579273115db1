// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How well the maps to fuse lie on each other in their frames, and frames that are found from the
// maps themselves.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "base/json.hpp"
#include "maps/frame_run.hpp"
#include "maps/fuse_setup.hpp"
#include "tessera/fusion/alignment.hpp"

namespace tessera {

/// Two of the maps.
struct PairAlignment {
  std::size_t first = 0;
  std::size_t second = 0;
  /// By labels, where there are common ones.
  std::optional<Alignment> labels{};
  /// By surfaces and free space, searched for near where the frames put the second map, or, where
  /// frames were to be found, anywhere.
  std::optional<FrameAnswer> frame{};
};

/// Gives the maps the frames that are found from their contents: the first map that was placed, or
/// else the first one, keeps its frame, and the others follow from pairs that were found from both
/// sides (TeamFrames). A pure function of the maps. Fails with kUsage iff a map is in submaps or
/// there are over kMostAligned; with kFailure iff a map cannot be placed, with the reason, or the
/// system does not give the memory.
Outcome<std::vector<PairAlignment>> find_frames(std::vector<FuseInput>& inputs);
inline constexpr std::size_t kMostAligned = 16;

/// Alignments of all pairs: by labels of up to 20,000 voxels each; and by surfaces, of whole maps,
/// of up to kMostAligned of them. Adds warnings about misaligned pairs.
std::vector<PairAlignment> align_inputs(const std::vector<FuseInput>& inputs,
                                        std::vector<Message>& warnings);

/// As the options have it: frames are found, or those given are judged.
Outcome<std::vector<PairAlignment>> pairs_of(const FuseOptions& options,
                                             std::vector<FuseInput>& inputs,
                                             std::vector<Message>& warnings);

/// The frames of pairs for a report.
[[nodiscard]] Json frames_json(const std::vector<PairAlignment>& pairs,
                               const std::vector<FuseInput>& inputs);

}  // namespace tessera
