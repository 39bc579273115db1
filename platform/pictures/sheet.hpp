// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The finished picture: title, views with their captions and scale bars, legend, one below the
// other.
#pragma once

#include <cstdint>

#include "pictures/canvas.hpp"
#include "pictures/framing.hpp"

namespace tessera {

struct Sheet {
  Canvas canvas;
  std::uint64_t cut_off = 0;  ///< Drawable voxels that are outside of a view.
};

/// options: within their ranges. The canvas has options.width_px columns.
[[nodiscard]] Sheet draw_sheet(const Scene& scene, const ImageOptions& options);

}  // namespace tessera
