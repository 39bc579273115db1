// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Nothing else here: units for one kind of machine include this.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera {

/// Labels that a point can have. As many classes as a voxel keeps apart (CompactTuple::kSlots).
inline constexpr std::size_t kMostLabels = 3;
/// The weight of a label that has all of its point's.
inline constexpr std::uint8_t kOneLabel = 255;

}  // namespace tessera
