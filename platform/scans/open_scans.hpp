// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Opens recorded scans of any format: a dataset, or a folder of clouds or of depth images with
// their poses.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/outcome.hpp"
#include "base/outputs.hpp"
#include "scans/recorded_scans.hpp"
#include "settings/source_options.hpp"

namespace tessera {

/// Fails with kUsage iff not exactly one of --dataset, --pcd, --ply and --depth is given, clouds or
/// depth images have no --poses or a dataset has, depth images have no --intrinsics or others have,
/// or an option is given that is for datasets only.
Outcome<void> check_source(const SourceOptions& options);

/// The files of a folder of clouds or images, which no output may be; none for a dataset. Fails
/// with kUsage iff list_by_number() does.
Outcome<std::vector<NamedFile>> cloud_files(const SourceOptions& options);
/// The folder of a dataset, which no output may be in; an empty one for others.
[[nodiscard]] DatasetFolder dataset_folder(const SourceOptions& options);

/// What is read beyond what mapping needs.
struct ExtraContent {
  bool motion = false;      ///< DatasetOptions::with_motion.
  bool times = false;       ///< DatasetOptions::with_times.
  bool images = false;      ///< DatasetOptions::with_images.
  bool no_returns = false;  ///< CloudOptions::with_no_returns.
};

struct OpenedScans {
  std::unique_ptr<RecordedScans> scans;
  std::vector<Message> warnings;  ///< About oddities; a sentence each.
};
/// Opens what check_source() accepts. Fails as Dataset::open(), CloudFolder::open() and
/// DepthFolder::open() do.
Outcome<OpenedScans> open_scans(const SourceOptions& options, const ExtraContent& extra = {});

}  // namespace tessera
