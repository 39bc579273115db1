// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Eye-dome lighting: a picture with a depth for each pixel is darkened behind edges, so that the
// eye sees what is in front.
#pragma once

#include <limits>
#include <vector>

#include "pictures/canvas.hpp"

namespace tessera {

inline constexpr float kNoDepth = std::numeric_limits<float>::max();

/// depth_m: one for each pixel, row by row, kNoDepth where nothing was drawn; these pixels keep
/// their colour.
void apply_eye_dome(Canvas& canvas, const std::vector<float>& depth_m);

}  // namespace tessera
