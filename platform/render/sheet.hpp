// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The finished picture: title, views with their captions and scale bars, legend, one below the
// other.
#pragma once

#include "render/canvas.hpp"
#include "render/framing.hpp"

namespace tessera {

/// options: within their ranges. The result has options.width_px columns.
[[nodiscard]] Canvas draw_sheet(const Scene& scene, const ImageOptions& options);

}  // namespace tessera
