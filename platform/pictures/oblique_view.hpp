// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The map from behind and above, in perspective: every voxel a cube with three visible faces, the
// nearest in front.
#pragma once

#include "pictures/camera.hpp"

namespace tessera {

/// width and height of the camera's picture.
[[nodiscard]] Canvas draw_oblique_view(const Scene& scene, const Camera& camera, Color background);

}  // namespace tessera
