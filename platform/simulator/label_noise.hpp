// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Labels as a range-image network would predict them: errors that cover an object or a patch of a
// surface, last for several scans of one robot and differ between robots; labels that bleed over
// borders in the image; some random single errors.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "simulator/lidar.hpp"
#include "tessera/registration/label_limits.hpp"

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

/// Labels that a network holds for likely, and how likely; the first is what it says.
struct Belief {
  static constexpr std::size_t kLabels = kMostLabels;
  std::array<std::uint16_t, kLabels> ids{};
  std::array<float, kLabels> probabilities{};  ///< Falling; at most one in all.
};
/// The same predictions with what the network holds for likely beside them. Where it has errors,
/// its answer is as sure as errors so deep are rare: so of a calibrated network the odds would be,
/// for a normal field that is below the quantile of p or above it by m, exp(2 m quantile(p)). These
/// are too sure by kOverconfidence, as networks are (Guo et al., ICML 2017). Of what an answer
/// leaves, most goes to what it was confused with: not always the truth. Near borders what is
/// beside a pixel mixes in.
std::vector<Belief> predict_beliefs(std::uint64_t seed, const Viewpoint& viewpoint,
                                    const EchoImage& image);
inline constexpr double kOverconfidence = 1.25;  ///< Factor of the odds' logarithm.

/// The true raw id of each pixel; a small share (borders and stray points) is unlabelled, as in
/// annotated data.
std::vector<std::uint16_t> true_labels(std::uint64_t seed, const Viewpoint& viewpoint,
                                       const EchoImage& image);

}  // namespace tessera::street
