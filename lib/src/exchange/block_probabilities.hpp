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
    88, 127, 149, 139, 131,
    79, 120, 143, 141, 128,
    75, 113, 150, 146, 125,
    65, 109, 166, 150, 124,
    65, 107, 170, 149, 128,
    76, 112, 154, 142, 129,
    76, 120, 140, 131, 130,
    // kCentroidLevel, y: by the last level, none first
    91, 126, 153, 138, 134,
    70, 112, 140, 136, 125,
    67, 104, 151, 147, 123,
    58, 104, 173, 151, 122,
    61, 104, 175, 151, 128,
    75, 110, 156, 143, 129,
    82, 120, 150, 139, 128,
    // kCentroidLevel, z: by the last level, none first
    107, 149, 141, 139, 130,
    42, 160, 44, 70, 107,
    28, 129, 77, 179, 79,
    32, 109, 181, 181, 76,
    62, 72, 208, 149, 175,
    153, 75, 174, 120, 176,
    171, 186, 102, 83, 144,
};
// clang-format on

}  // namespace tessera::detail
