// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Thinning by brute force: points gathered by cell in a sorted map, then one for each cell.
#pragma once

#include "oracle/label_oracle.hpp"

namespace tessera::oracle {

/// One point a cell of cell_m, cells aligned with the origin: the centroid, the component with the
/// largest total weight (ties to the lowest, unlabelled only if all are) and the mean or summed
/// weight of the points that have it, with the labels of the first of these. By cell.
[[nodiscard]] std::map<Voxel, OraclePoint> thin_by_cell(const std::vector<OraclePoint>& points,
                                                        double cell_m, int unlabelled,
                                                        ThinningWeight rule);

}  // namespace tessera::oracle
