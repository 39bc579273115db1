// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Points of a sensor before anything is known about them.
#pragma once

#include <cstddef>

namespace tessera {

/// A view: x y z of point i in metres at points[i * stride_floats], stride_floats at least 3.
struct PointsView {
  const float* points = nullptr;
  std::size_t stride_floats = 4;
  std::size_t count = 0;
};

}  // namespace tessera
