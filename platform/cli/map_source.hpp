// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where "map" takes its scans from: a dataset, or a folder of clouds or of depth images with their
// poses.
#pragma once

#include <memory>
#include <vector>

#include "base/outcome.hpp"
#include "base/outputs.hpp"
#include "scans/dataset.hpp"
#include "settings/map_options.hpp"

namespace tessera {

/// Fails with kUsage iff not exactly one of --dataset, --pcd, --ply and --depth is given, clouds or
/// depth images have no --poses or a dataset has, depth images have no --intrinsics or others have,
/// or an option is given that is for datasets only.
Outcome<void> check_source(const MapOptions& options);

/// The files of a folder of clouds or images, which no output may be; none for a dataset. Fails
/// with kUsage iff list_by_number() does.
Outcome<std::vector<NamedFile>> cloud_files(const MapOptions& options);

/// Opens what check_source() accepts, and warns about oddities. Fails as
/// Dataset::open(), CloudFolder::open() and DepthFolder::open() do.
Outcome<std::unique_ptr<RecordedScans>> open_source(const MapOptions& options);

}  // namespace tessera
