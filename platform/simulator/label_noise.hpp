// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Labels as a range-image network would predict them: errors that cover an object or a patch of a
// surface, last for several scans of one robot and differ between robots; labels that bleed over
// borders in the image; some random single errors.
#pragma once

#include <cstdint>
#include <vector>

#include "simulator/lidar.hpp"

namespace tessera::street {

/// Place of a scan: errors are similar for one robot over some metres of driving.
struct Viewpoint {
  int robot = 0;
  double driven_m = 0.0;
  int scan = 0;
};

/// One raw id for each pixel of the image, static classes only; 0 without a return.
std::vector<std::uint16_t> predict_labels(std::uint64_t seed, const Viewpoint& viewpoint,
                                          const EchoImage& image);

/// The true raw id of each pixel; a small share (borders and stray points) is unlabelled, as in
/// annotated data.
std::vector<std::uint16_t> true_labels(std::uint64_t seed, const Viewpoint& viewpoint,
                                       const EchoImage& image);

}  // namespace tessera::street
