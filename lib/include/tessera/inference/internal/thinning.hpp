// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Thinning by a voxel grid: one point a cell, so that the density of a sensor's pattern does not
// pass for evidence.
#pragma once

#include <span>

#include "tessera/base/internal/radix_sort.hpp"
#include "tessera/inference/inference_config.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera {

/// Thins points to one a cell of cell_m, cells aligned with the map frame's origin: the centroid of
/// the cell's points, the component with the largest total weight (ties to the lowest; unlabelled
/// only if all are), and the mean or summed weight of the points that have it, with the labels of
/// the first of these. Cells come out by
/// cubes of eight cells a side, in these by cubes of two, in these by cell, each in (z, y, x)
/// order. points: registered with lattice, at most 2^20 cells from each other on an axis. out: at
/// least points.size(); its points have the voxels of lattice. sort: at least 2 * points.size().
/// unlabelled: the component C + 1. Returns the cells. O(n).
[[nodiscard]] std::size_t thin(std::span<const ScanPoint> points, const Lattice& lattice,
                               double cell_m, int unlabelled, std::span<ScanPoint> out,
                               std::span<KeyedIndex> sort,
                               ThinningWeight weight = ThinningWeight::kMean) noexcept;

}  // namespace tessera
