// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/map_source.hpp"

#include <filesystem>
#include <string>
#include <utility>

#include "cli/command.hpp"
#include "scans/cloud_folder.hpp"
#include "scans/depth_folder.hpp"

namespace tessera {

namespace {

CloudFormat format_of(const MapOptions& options) {
  return options.pcd.empty() ? CloudFormat::kPly : CloudFormat::kPcd;
}

/// The option that names the clouds or depth images; null for a dataset.
const char* cloud_option(const MapOptions& options) {
  if (!options.pcd.empty()) return "--pcd";
  if (!options.depth.empty()) return "--depth";
  return options.ply.empty() ? nullptr : "--ply";
}

Outcome<std::unique_ptr<RecordedScans>> open_dataset(const MapOptions& options) {
  const Outcome<Deskewing> deskew = parse_deskewing(options.deskew);
  if (!deskew.ok()) return deskew.failure();
  Outcome<Dataset> dataset = Dataset::open(
      options.dataset,
      {.first = options.first, .last = options.last, .labels = options.labels, .deskew = *deskew});
  if (!dataset.ok()) return dataset.failure();
  if (!dataset->missing().empty()) warn("there are no scans " + to_text(dataset->missing()));
  return std::unique_ptr<RecordedScans>(std::make_unique<Dataset>(std::move(*dataset)));
}

void warn_of_oddities(const CloudFolder& clouds, const MapOptions& options) {
  const auto files = static_cast<int>(clouds.num_files());
  if (options.last && *options.last >= files)
    warn("there are no scans " + to_text({{files, *options.last}}));
  if (options.labels != kNoLabels && clouds.num_labelled() < clouds.num_scans()) {
    warn(std::to_string(clouds.num_scans() - clouds.num_labelled()) + " of " +
         std::to_string(clouds.num_scans()) +
         " clouds have no field label, class or semantic; their points are unlabelled");
  }
  if (clouds.num_viewpoints() > 0) {
    warn(counted(clouds.num_viewpoints(), "cloud") +
         " with a VIEWPOINT; it is ignored, --poses has the place of the sensor");
  }
}

Outcome<std::unique_ptr<RecordedScans>> open_clouds(const MapOptions& options) {
  Outcome<CloudFolder> clouds =
      CloudFolder::open(options.folder(), {.format = format_of(options),
                                           .poses = options.poses,
                                           .first = options.first,
                                           .last = options.last,
                                           .with_labels = options.labels != kNoLabels});
  if (!clouds.ok()) return clouds.failure();
  warn_of_oddities(*clouds, options);
  return std::unique_ptr<RecordedScans>(std::make_unique<CloudFolder>(std::move(*clouds)));
}

Outcome<std::unique_ptr<RecordedScans>> open_depth(const MapOptions& options) {
  Outcome<DepthFolder> images = DepthFolder::open(
      options.depth,
      {options.label_images, options.intrinsics, options.poses, options.first, options.last});
  if (!images.ok()) return images.failure();
  const auto files = static_cast<int>(images->num_files());
  if (options.last && *options.last >= files)
    warn("there are no scans " + to_text({{files, *options.last}}));
  return std::unique_ptr<RecordedScans>(std::make_unique<DepthFolder>(std::move(*images)));
}

Outcome<void> check_depth(const MapOptions& options) {
  if (options.depth.empty()) {
    if (options.intrinsics.empty() && options.label_images.empty()) return {};
    return Failure{"--intrinsics and --label-images are for --depth; leave them out"};
  }
  if (options.intrinsics.empty()) {
    return Failure{"--depth needs the camera of its images; name its TOML file with --intrinsics"};
  }
  if (!options.labels_given) return {};
  if (options.labels == kNoLabels) {
    if (options.label_images.empty()) return {};
    return Failure{"--labels none ignores all labels; leave --label-images out, or --labels"};
  }
  return Failure{"--depth has its labels in images; name their folder with --label-images"};
}

}  // namespace

Outcome<void> check_source(const MapOptions& options) {
  const int given = (options.dataset.empty() ? 0 : 1) + (options.pcd.empty() ? 0 : 1) +
                    (options.ply.empty() ? 0 : 1) + (options.depth.empty() ? 0 : 1);
  if (given == 0) {
    return Failure{
        "--dataset has no folder; name one, or a folder of clouds with --pcd or --ply, or of depth "
        "images with --depth"};
  }
  if (given > 1)
    return Failure{"--dataset, --pcd, --ply and --depth are mutually exclusive; give one"};
  const Outcome<void> depth = check_depth(options);
  if (!depth.ok()) return depth.failure();
  const char* const option = cloud_option(options);
  if (option == nullptr) {
    if (options.poses.empty()) return {};
    return Failure{"--poses is for --pcd, --ply and --depth; a dataset has its poses.txt"};
  }
  if (options.poses.empty()) {
    return Failure{std::string(option) +
                   " needs a pose for each file; name the file of poses with --poses"};
  }
  if (options.labels_given && options.labels != kNoLabels) {
    return Failure{std::string(option) +
                   " has labels in the clouds; leave --labels out, or give --labels none"};
  }
  if (!options.deskew.empty() && options.deskew != "off")
    return Failure{"--deskew is for datasets, which have times; leave it out"};
  return {};
}

Outcome<std::vector<NamedFile>> cloud_files(const MapOptions& options) {
  const char* const option = cloud_option(options);
  std::vector<NamedFile> files;
  if (option == nullptr) return files;
  const Outcome<std::vector<std::string>> paths =
      options.depth.empty() ? list_clouds(options.folder(), format_of(options))
                            : list_by_number(options.depth, ".png");
  if (!paths.ok()) return paths.failure();
  for (const std::string& path : *paths) {
    files.push_back({option, path});
    const std::filesystem::path labels(options.label_images);
    if (labels.empty()) continue;
    const std::filesystem::path name = std::filesystem::path(path).filename();
    files.push_back({"--label-images", (labels / name).string()});
  }
  files.push_back({"--poses", options.poses});
  files.push_back({"--intrinsics", options.intrinsics});
  const std::filesystem::path folder(options.folder());
  for (const char* const name : {"classes.toml", "T_global_map.txt"})
    files.push_back({option, (folder / name).string()});
  return files;
}

Outcome<std::unique_ptr<RecordedScans>> open_source(const MapOptions& options) {
  if (!options.depth.empty()) return open_depth(options);
  return cloud_option(options) == nullptr ? open_dataset(options) : open_clouds(options);
}

}  // namespace tessera
