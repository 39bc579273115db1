// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/slab_walk.hpp"

#include <algorithm>

namespace tessera {

namespace {

std::int64_t fixed(double v, std::int64_t one) noexcept {
  return floor_to_int64(v * static_cast<double>(one));
}

/// The step nearest to `step` with which a walk that meets the first slab's border at `first`, in
/// the grid, meets the next `borders` ones in the grid too. Rounded steps add up: a ray that ends
/// on the grid's lower face would leave the grid where it comes into its last slab at its end.
std::int64_t step_in_grid(std::int64_t first, std::int64_t step, std::int64_t borders,
                          std::int64_t lowest, std::int64_t highest) noexcept {
  const std::int64_t last = first + borders * step;
  if (borders <= 0 || (last >= lowest && last <= highest)) return step;
  // A division rounds towards zero, so away from the face.
  return ((last < lowest ? lowest : highest) - first) / borders;
}

}  // namespace

SlabWalk::SlabWalk(const Point3d& a, const Point3d& b, double part) noexcept {
  const Point3d d = b - a;
  const Point3d size = d.cwiseAbs();
  axis_ = longest_axis(d);
  direction_ = d[axis_] < 0.0 ? -1 : 1;
  Point3d end = b;
  if (part < 1.0) {
    // Clamped, so that rounding never takes a part beyond the whole.
    for (int i = 0; i < 3; ++i)
      end[i] = std::clamp(a[i] + d[i] * part, std::min(a[i], b[i]), std::max(a[i], b[i]));
  }
  from_ = floor_to_int(a[axis_]);
  slabs_ = (floor_to_int(end[axis_]) - from_) * direction_;
  // Of the whole, so that a part meets borders where the whole does.
  const std::int64_t borders = std::int64_t{floor_to_int(b[axis_]) - from_} * direction_ - 1;
  const double first_part = direction_ > 0 ? from_ + 1 - a[axis_] : a[axis_] - from_;
  const std::array<int, 2> axes = axes_across(axis_);
  for (std::size_t k = 0; k < 2; ++k) {
    const int i = axes[k];
    const double slope = size[axis_] > 0.0 ? d[i] / size[axis_] : 0.0;
    Across& across = across_[k];
    across.start = fixed(a[i], kOne);
    across.first =
        std::clamp(fixed(a[i] + slope * first_part, kOne), std::max(across.start - kOne, kLowest),
                   std::min(across.start + kOne, kHighest));
    across.step = step_in_grid(across.first, std::clamp(fixed(slope, kOne), -kOne, kOne), borders,
                               kLowest, kHighest);
    const std::int64_t enter =
        slabs_ == 0 ? across.start : across.first + (slabs_ - 1) * across.step;
    const std::int64_t leave = slabs_ == 0 ? across.first : enter + across.step;
    across.end = std::clamp(fixed(end[i], kOne), std::min(enter, leave), std::max(enter, leave));
  }
}

std::uint64_t SlabWalk::voxels() const noexcept {
  std::int64_t voxels = 1 + std::int64_t{slabs_};
  for (const Across& across : across_)
    voxels += std::abs(std::int64_t{cell(across.end)} - cell(across.start));
  return static_cast<std::uint64_t>(voxels);
}

}  // namespace tessera
