// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/open_scans.hpp"

#include <fmt/core.h>

#include <filesystem>
#include <string>
#include <utility>

#include "base/number_text.hpp"
#include "scans/cloud_folder.hpp"
#include "scans/dataset.hpp"
#include "scans/depth_folder.hpp"

namespace tessera {

namespace {

CloudFormat format_of(const SourceOptions& options) {
  return options.pcd.empty() ? CloudFormat::kPly : CloudFormat::kPcd;
}

/// The option that names the clouds or depth images; null for a dataset.
const SettingName* cloud_option(const SourceOptions& options) {
  if (!options.pcd.empty()) return &kSourceSettings["--pcd"];
  if (!options.depth.empty()) return &kSourceSettings["--depth"];
  return options.ply.empty() ? nullptr : &kSourceSettings["--ply"];
}

/// The files of a folder are numbered from 0, and so are the rows of its poses.
template <class Folder>
void warn_of_numbers(const SourceOptions& options, const Folder& folder, OpenedScans& opened) {
  const auto files = static_cast<int>(folder.num_files());
  if (options.last && *options.last >= files)
    opened.warnings.push_back("there are no scans " + to_text({{files, *options.last}}));
  if (folder.num_poses() != folder.num_files()) {
    opened.warnings.push_back(
        fmt::format("there are {} poses for {} files: the first pose is taken for the first file, "
                    "and so on; stamps are not compared with the names of files",
                    folder.num_poses(), folder.num_files()));
  }
}

Outcome<OpenedScans> open_dataset(const SourceOptions& options, const ExtraContent& extra) {
  TESSERA_TRY_ASSIGN(Dataset dataset,
                     Dataset::open(options.dataset, {.first = options.first,
                                                     .last = options.last,
                                                     .labels = options.labels_or_default(),
                                                     .deskew = deskewing(options.deskew),
                                                     .with_motion = extra.motion,
                                                     .with_times = extra.times,
                                                     .with_images = extra.images}));
  OpenedScans opened;
  if (!dataset.missing().empty())
    opened.warnings.push_back("there are no scans " + to_text(dataset.missing()));
  opened.scans = std::make_unique<Dataset>(std::move(dataset));
  return opened;
}

Outcome<OpenedScans> open_clouds(const SourceOptions& options, const ExtraContent& extra) {
  TESSERA_TRY_ASSIGN(
      CloudFolder clouds,
      CloudFolder::open(options.folder(), {.format = format_of(options),
                                           .poses = options.poses,
                                           .first = options.first,
                                           .last = options.last,
                                           .with_motion = extra.motion,
                                           .with_labels = options.labels != kNoLabels,
                                           .with_no_returns = extra.no_returns}));
  OpenedScans opened;
  warn_of_numbers(options, clouds, opened);
  if (options.labels != kNoLabels && clouds.num_labelled() < clouds.num_scans()) {
    opened.warnings.push_back(fmt::format(
        "{} of {} clouds have no field label, class or semantic; their points are unlabelled",
        clouds.num_scans() - clouds.num_labelled(), clouds.num_scans()));
  }
  if (clouds.num_viewpoints() > 0) {
    opened.warnings.push_back(counted(clouds.num_viewpoints(), "cloud") +
                              " with a VIEWPOINT; it is ignored, " + kSourceSettings["--poses"] +
                              " has the place of the sensor");
  }
  opened.scans = std::make_unique<CloudFolder>(std::move(clouds));
  return opened;
}

Outcome<OpenedScans> open_depth(const SourceOptions& options, const ExtraContent& extra) {
  TESSERA_TRY_ASSIGN(
      DepthFolder images,
      DepthFolder::open(options.depth, {options.label_images, options.intrinsics, options.poses,
                                        options.first, options.last, extra.motion}));
  OpenedScans opened;
  warn_of_numbers(options, images, opened);
  opened.scans = std::make_unique<DepthFolder>(std::move(images));
  return opened;
}

Outcome<void> check_depth(const SourceOptions& options) {
  if (options.depth.empty()) {
    if (options.intrinsics.empty() && options.label_images.empty()) return {};
    return Failure{Message(kSourceSettings["--intrinsics"]) + " and " +
                   kSourceSettings["--label-images"] + " are for " + kSourceSettings["--depth"] +
                   "; leave them out"};
  }
  if (options.intrinsics.empty()) {
    return Failure{Message(kSourceSettings["--depth"]) +
                   " needs the camera of its images; name its TOML file with " +
                   kSourceSettings["--intrinsics"]};
  }
  if (!options.labels) return {};
  if (options.labels == kNoLabels) {
    if (options.label_images.empty()) return {};
    return Failure{Message(kSourceSettings["--labels"]) + " none ignores all labels; leave " +
                   kSourceSettings["--label-images"] + " out, or " + kSourceSettings["--labels"]};
  }
  return Failure{Message(kSourceSettings["--depth"]) +
                 " has its labels in images; name their folder with " +
                 kSourceSettings["--label-images"]};
}

}  // namespace

Outcome<void> check_source(const SourceOptions& options) {
  const int given = (options.dataset.empty() ? 0 : 1) + (options.pcd.empty() ? 0 : 1) +
                    (options.ply.empty() ? 0 : 1) + (options.depth.empty() ? 0 : 1);
  if (given == 0) {
    return Failure{Message(kSourceSettings["--dataset"]) +
                   " has no folder; name one, or a folder of clouds with " +
                   kSourceSettings["--pcd"] + " or " + kSourceSettings["--ply"] +
                   ", or of depth "
                   "images with " +
                   kSourceSettings["--depth"]};
  }
  if (given > 1)
    return Failure{Message(kSourceSettings["--dataset"]) + ", " + kSourceSettings["--pcd"] + ", " +
                   kSourceSettings["--ply"] + " and " + kSourceSettings["--depth"] +
                   " are mutually exclusive; give one"};
  TESSERA_TRY(check_depth(options));
  const SettingName* const option = cloud_option(options);
  if (option == nullptr) {
    if (options.poses.empty()) return {};
    return Failure{Message(kSourceSettings["--poses"]) + " is for " + kSourceSettings["--pcd"] +
                   ", " + kSourceSettings["--ply"] + " and " + kSourceSettings["--depth"] +
                   "; a dataset has its poses.txt"};
  }
  if (options.poses.empty()) {
    return Failure{Message(*option) + " needs a pose for each file; name the file of poses with " +
                   kSourceSettings["--poses"]};
  }
  if (options.labels && options.labels != kNoLabels) {
    return Failure{Message(*option) + " has labels in the clouds; leave " +
                   kSourceSettings["--labels"] + " out, or give " + kSourceSettings["--labels"] +
                   " none"};
  }
  if (options.deskew.value_or(false))
    return Failure{Message(kSourceSettings["--deskew"]) +
                   " is for datasets, which have times; leave it out"};
  return {};
}

Outcome<std::vector<NamedFile>> cloud_files(const SourceOptions& options) {
  const SettingName* const option = cloud_option(options);
  std::vector<NamedFile> files;
  if (option == nullptr) return files;
  TESSERA_TRY_ASSIGN(const std::vector<std::string> paths,
                     options.depth.empty() ? list_clouds(options.folder(), format_of(options))
                                           : list_by_number(options.depth, ".png"));
  for (const std::string& path : paths) {
    files.push_back({*option, path});
    const std::filesystem::path labels(options.label_images);
    if (labels.empty()) continue;
    const std::filesystem::path name = std::filesystem::path(path).filename();
    files.push_back({Message(kSourceSettings["--label-images"]), (labels / name).string()});
  }
  files.push_back({Message(kSourceSettings["--poses"]), options.poses});
  files.push_back({Message(kSourceSettings["--intrinsics"]), options.intrinsics});
  const std::filesystem::path folder(options.folder());
  for (const char* const name : {"classes.toml", "T_global_map.txt"})
    files.push_back({*option, (folder / name).string()});
  return files;
}

DatasetFolder dataset_folder(const SourceOptions& options) {
  return {.path = options.dataset, .labels = {options.labels_or_default()}};
}

Outcome<OpenedScans> open_scans(const SourceOptions& options, const ExtraContent& extra) {
  if (!options.depth.empty()) return open_depth(options, extra);
  return cloud_option(options) == nullptr ? open_dataset(options, extra)
                                          : open_clouds(options, extra);
}

}  // namespace tessera
