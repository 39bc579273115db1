// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The options that name recorded scans, the same for every command that reads any format.
#pragma once

#include <CLI/CLI.hpp>

#include "base/json.hpp"
#include "base/outcome.hpp"
#include "scans/open_scans.hpp"
#include "settings/source_options.hpp"

namespace tessera {

/// --dataset, --pcd, --ply, --depth, --label-images and --intrinsics.
void declare_source_folders(CLI::App& command, SourceOptions& options);
/// --poses, the file of clouds and depth images.
void declare_pose_file(CLI::App& command, SourceOptions& options);
/// --first, --last, --labels and --deskew.
void declare_source_choice(CLI::App& command, SourceOptions& options);

/// open_scans() after check_source(), with its warnings on stderr.
Outcome<std::unique_ptr<RecordedScans>> open_source(const SourceOptions& options,
                                                    const ExtraContent& extra = {});

/// The options as given, for reports.
Json to_json(const SourceOptions& options);

}  // namespace tessera
