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
    84, 225,
    // kLabelled
    10, 134, 142, 227, 30, 200, 189, 238,
    // kFull
    252,
    // kVoxel
    188, 128, 128, 128, 109, 193, 128, 128, 43, 134, 207, 128, 30, 46, 183, 193,
    // kSame
    198, 252,
    // kRest, kMore
    4, 252, 75, 38,
    // kComponent
    128, 32, 96, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128,
    128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128,
    128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128,
    128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128,
    // kPassed
    12, 123, 133, 206, 87, 172, 180, 214,
    // kVoxelPassed
    79, 175, 72,
    // kFreed
    18, 162, 252, 162, 236, 252, 252, 252, 252, 71, 222, 252, 220, 249, 252, 252,
    252, 252, 137, 239, 252, 234, 252, 252, 252, 252, 252,
    // kAllFreed
    57, 18, 213, 22, 12, 126, 210, 106, 243, 50, 21, 191, 23, 14, 121, 187,
    103, 232, 160, 40, 238, 44, 20, 146, 235, 125, 249,
    // kVoxelFreed
    34, 173, 172, 240, 21, 165, 156, 232,
    // kDifference, group 0
    248, 234, 214, 170, 95, 132, 121, 102, 74,
    // kDifference, group 1
    252, 221, 195, 144, 67, 128, 114, 88, 30,
    // kDifference, group 2
    252, 218, 191, 140, 67, 129, 112, 86, 32,
    // kDifference, group 3
    252, 168, 95, 53, 77, 127, 61, 64, 73,
    // kDifference, group 4
    252, 230, 208, 152, 86, 129, 123, 93, 34,
    // kDifference, group 5
    252, 144, 75, 80, 98, 123, 62, 88, 54,
    // kDifference, group 6
    252, 143, 73, 80, 99, 137, 61, 85, 55,
    // kDifference, group 7
    252, 146, 64, 79, 67, 72, 60, 93, 49,
    // kDifference, group 8
    234, 242, 229, 197, 132, 113, 121, 118, 90,
    // kDifference, group 9
    252, 183, 143, 132, 68, 123, 100, 87, 43,
    // kDifference, group 10
    252, 82, 58, 4, 21, 101, 20, 21, 128,
    // kDifference, group 11
    252, 58, 13, 4, 128, 124, 4, 128, 128,
    // kCentroid, by the amount
    4, 4, 4, 31, 54, 88,
    7, 6, 9, 18, 87, 169,
    4, 4, 4, 29, 56, 108,
    // kCentroidLevel, x: by the last level, none first
    89, 125, 147, 140, 132,
    82, 117, 140, 142, 131,
    75, 109, 148, 147, 130,
    68, 106, 162, 153, 126,
    67, 102, 165, 153, 128,
    76, 108, 150, 145, 130,
    78, 115, 136, 132, 131,
    // kCentroidLevel, y: by the last level, none first
    92, 124, 152, 140, 135,
    71, 110, 135, 137, 128,
    67, 104, 147, 150, 126,
    61, 99, 169, 155, 126,
    64, 97, 173, 153, 130,
    78, 105, 155, 147, 129,
    85, 117, 148, 141, 131,
    // kCentroidLevel, z: by the last level, none first
    109, 151, 140, 140, 131,
    42, 160, 41, 70, 111,
    29, 130, 76, 178, 76,
    32, 105, 181, 186, 79,
    64, 69, 209, 154, 174,
    155, 76, 176, 127, 176,
    176, 189, 100, 85, 148,
};
// clang-format on

}  // namespace tessera::detail
