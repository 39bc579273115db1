// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How likely a one is at first, in units of 1 / 256, by Context: how often it was one in the blocks
// of scans 3-5 of SemanticKITTI's sequence 08 (0.1 m, 40 m, multi-entropy), 4 .. 252. Where these
// have no such decisions, or would teach which numbers classes have, even. codec_table prints
// it. Every change of it is another wire format.
#pragma once

#include <array>
#include <cstdint>

#include "block_model.hpp"

namespace tessera::detail {

// clang-format off
inline constexpr std::array<std::uint8_t, kContexts> kInitialProbabilities{
    // kLabels, kPasses
    93, 205,
    // kLabelled
    10, 134, 142, 227, 30, 200, 189, 238,
    // kFull
    252,
    // kVoxel
    128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128,
    // kSame
    198, 252,
    // kRest, kMore
    4, 252, 74, 38,
    // kComponent
    128, 32, 96, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128,
    128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128,
    128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128,
    128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128,
    // kPassed
    6, 134, 129, 221, 91, 183, 183, 217,
    // kVoxelPassed
    73, 191, 41,
    // kFreed
    18, 153, 252, 151, 233, 252, 252, 252, 252, 55, 218, 252, 215, 248, 252, 252,
    252, 252, 144, 241, 252, 233, 252, 252, 252, 252, 252,
    // kAllFreed
    77, 18, 227, 21, 12, 127, 226, 116, 248, 55, 19, 198, 21, 12, 123, 198,
    112, 238, 193, 47, 247, 44, 20, 158, 244, 142, 252,
    // kVoxelFreed
    27, 177, 176, 245, 16, 177, 161, 239,
    // kDifference, group 0
    248, 235, 214, 169, 92, 131, 121, 103, 69,
    // kDifference, group 1
    252, 224, 194, 141, 59, 128, 115, 86, 17,
    // kDifference, group 2
    252, 221, 191, 136, 58, 129, 113, 84, 19,
    // kDifference, group 3
    252, 165, 84, 27, 10, 127, 58, 31, 27,
    // kDifference, group 4
    252, 232, 207, 146, 72, 130, 124, 88, 16,
    // kDifference, group 5
    252, 137, 53, 21, 5, 121, 49, 28, 100,
    // kDifference, group 6
    252, 137, 52, 21, 5, 139, 50, 26, 128,
    // kDifference, group 7
    252, 136, 35, 13, 122, 61, 25, 70, 81,
    // kDifference, group 8
    234, 243, 229, 197, 131, 113, 121, 117, 90,
    // kDifference, group 9
    252, 180, 137, 126, 58, 123, 100, 85, 22,
    // kDifference, group 10
    252, 93, 58, 4, 128, 134, 4, 128, 128,
    // kDifference, group 11
    252, 50, 19, 4, 128, 121, 4, 128, 128,
};
// clang-format on

}  // namespace tessera::detail
