// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// In which pixels of a CarveImage returns are, four at once on machines with AVX2, with the bits of
// CarveImage::add(). What kernel_rows.hpp says about such units holds here.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera {

/// Four returns, and where they are on the cube around the sensor.
struct SeenReturns {
  static constexpr int kCount = 4;
  // NOLINTBEGIN(cppcoreguidelines-avoid-c-arrays): nothing inline is called here
  const float* points = nullptr;  ///< Metres, map frame; x y z of return i at points[i * stride].
  std::ptrdiff_t stride = 3;
  double origin[3] = {};  ///< The sensor.
  double per_m = 1.0;     ///< Steps of depth.
  double most_depth = 0.0;
  double widest = 1.0;  ///< The tangent up to which a face's padding shows anything.
  // A pixel is tangent * (slope - bend * |tangent|) + middle.
  double slope = 0.0;
  double bend = 0.0;
  double middle = 0.0;
  double edge = 0.0;  ///< Pixels of a row.
  // What is found, by axis and return.
  std::int32_t column[3][kCount] = {};
  std::int32_t row[3][kCount] = {};
  std::int32_t depth[3][kCount] = {};
  // A bit for each return: whether it is on the face of that axis on its side of the sensor, and
  // whether that is the negative one.
  unsigned is_on_face[3] = {};
  unsigned is_negative[3] = {};
  // NOLINTEND(cppcoreguidelines-avoid-c-arrays)
};

using SeeReturns = void (*)(SeenReturns& returns) noexcept;
/// Null iff this was built for machines without AVX2.
[[nodiscard]] SeeReturns see_returns_by_fours() noexcept;

}  // namespace tessera
