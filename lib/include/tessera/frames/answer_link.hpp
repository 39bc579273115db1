// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a search has found, as a link between the worlds that the maps are in.
#pragma once

#include "tessera/frames/frame_finder.hpp"
#include "tessera/frames/frame_link.hpp"

namespace tessera {

/// The transform and the covariance of a link; its robots, epochs, versions and revision are the
/// caller's. T_world_a, T_world_b: where the maps that were compared are in the worlds of the
/// robots that have them; rotations to rounding. O(1).
[[nodiscard]] FrameLink link_of(const FrameAnswer& answer, const Matrix34d& T_world_a,
                                const Matrix34d& T_world_b) noexcept;

}  // namespace tessera
