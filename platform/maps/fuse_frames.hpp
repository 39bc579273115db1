// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Frames that are found from the maps to fuse themselves.
#pragma once

#include <vector>

#include "maps/pair_alignment.hpp"

namespace tessera {

/// Gives the maps the frames that are found from their contents: of the maps by ascending robot and
/// digest the first that was placed, or else the first one, keeps its frame, and the others follow
/// from pairs that were found from both sides (TeamFrames). A pure function of the maps. Fails with
/// kUsage iff a map is in submaps or there are over kMostAligned, or there are sessions and no map
/// was placed; with kFailure iff a map cannot be placed, with the reason, or the system does not
/// give the memory.
Outcome<std::vector<PairAlignment>> find_frames(std::vector<FuseInput>& inputs, bool with_sessions,
                                                const PairsProgress::Done& done = {});

/// As the options have it: frames are found, or those given are judged.
Outcome<std::vector<PairAlignment>> pairs_of(const FuseOptions& options, bool with_sessions,
                                             std::vector<FuseInput>& inputs,
                                             std::vector<Message>& warnings,
                                             const PairsProgress::Done& done = {});

}  // namespace tessera
