// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/source_arguments.hpp"

#include "cli/command.hpp"
#include "cli/number_options.hpp"

namespace tessera {

void declare_source_folders(CLI::App& command, SourceOptions& o) {
  // check_source() checks which of these are needed.
  command.add_option("--dataset", o.dataset,
                     "Folder in the KITTI layout; or --pcd, --ply, --depth");
  command.add_option("--pcd", o.pcd, "Folder of PCD files, with --poses");
  command.add_option("--ply", o.ply, "Folder of PLY files, with --poses");
  command.add_option("--depth", o.depth,
                     "Folder of 16-bit depth images, with --intrinsics and --poses");
  command.add_option("--label-images", o.label_images,
                     "Folder of label images, with the same names as those of --depth");
  command.add_option("--intrinsics", o.intrinsics, "TOML file of the camera of --depth");
}

void declare_pose_file(CLI::App& command, SourceOptions& o) {
  command.add_option("--poses", o.poses,
                     "File of poses, a row for each file: 3x4, 4x4, or stamp tx ty tz qx qy qz qw");
}

void declare_source_choice(CLI::App& command, SourceOptions& o) {
  command.add_option("--first", o.first, "First scan number")->check(whole_number<int>());
  command.add_option("--last", o.last, "Last scan number, inclusive")->check(whole_number<int>());
  command.add_option("--labels", o.labels, "Folder of labels to use, cameras or none")
      ->capture_default_str();
  command.add_option(
      "--deskew", o.deskew,
      "on or off: correct scans for motion by the times of points [if there are times]");
}

Json to_json(const SourceOptions& o) {
  return {{"dataset", o.dataset},
          {"pcd", o.pcd},
          {"ply", o.ply},
          {"depth", o.depth},
          {"label_images", o.label_images},
          {"intrinsics", o.intrinsics},
          {"poses", o.poses},
          {"first", o.first ? Json(*o.first) : Json()},
          {"last", o.last ? Json(*o.last) : Json()},
          {"labels", o.labels},
          {"deskew", o.deskew}};
}

Outcome<std::unique_ptr<RecordedScans>> open_source(const SourceOptions& options,
                                                    const ExtraContent& extra) {
  Outcome<OpenedScans> opened = open_scans(options, extra);
  if (!opened.ok()) return opened.failure();
  for (const std::string& warning : opened->warnings) warn(warning);
  return std::move(opened->scans);
}

}  // namespace tessera
