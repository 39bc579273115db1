// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which recorded scans a command or a node reads.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "settings/setting.hpp"

namespace tessera {

inline constexpr std::string_view kNoLabels = "none";
/// Labels by projection from the cameras of cameras.toml.
inline constexpr std::string_view kCameraLabels = "cameras";

struct SourceOptions {
  std::string dataset{};  ///< Exactly one of this, pcd, ply and depth is given.
  std::string pcd{};
  std::string ply{};
  std::string depth{};         ///< A folder of depth images,
  std::string label_images{};  ///< of their labels, optionally,
  std::string intrinsics{};    ///< and the file of their camera.
  std::string poses{};         ///< For pcd, ply and depth.
  std::optional<int> first{};
  std::optional<int> last{};
  std::optional<std::string> labels{};  ///< A folder, kCameraLabels or kNoLabels.
  std::optional<bool> deskew{};         ///< Default: if the dataset has times.

  /// The folder of the scans.
  [[nodiscard]] const std::string& folder() const noexcept {
    return !pcd.empty() ? pcd : !ply.empty() ? ply : !depth.empty() ? depth : dataset;
  }
  [[nodiscard]] std::string labels_or_default() const { return labels.value_or("predictions"); }
};

/// A scan number is never negative.
inline constexpr Setting kSourceRows[] = {
    path_row<&SourceOptions::dataset>(
        {"--dataset", "replay", "dataset"},
        "Folder of scans in the KITTI layout; or clouds, or depth images", {.value = "DIR"}),
    path_row<&SourceOptions::pcd>({"--pcd", "replay", "pcd"},
                                  "Folder of PCD files; needs a file of poses", {.value = "DIR"}),
    path_row<&SourceOptions::ply>({"--ply", "replay", "ply"},
                                  "Folder of PLY files; needs a file of poses", {.value = "DIR"}),
    path_row<&SourceOptions::depth>(
        {"--depth", "replay", "depth"},
        "Folder of 16-bit depth images; needs a camera and a file of poses", {.value = "DIR"}),
    path_row<&SourceOptions::label_images>(
        {"--label-images", "replay", "label_images"},
        "Folder of label images, with the same names as the depth images", {.value = "DIR"}),
    path_row<&SourceOptions::intrinsics>({"--intrinsics", "replay", "intrinsics"},
                                         "TOML file of the camera of depth images",
                                         {.value = "FILE.toml"}),
    path_row<&SourceOptions::poses>(
        {"--poses", "replay", "poses"},
        "File of poses, a row for each file: 3x4, 4x4, or stamp tx ty tz qx qy qz qw",
        {.value = "FILE"}),
    row<&SourceOptions::first>({"--first", "replay", "first"}, "Number of the first scan",
                               {.value = "N", .otherwise = "the first", .allowed = {.least = 0}}),
    row<&SourceOptions::last>({"--last", "replay", "last"},
                              "Number of the last scan, itself included",
                              {.value = "N", .otherwise = "the last", .allowed = {.least = 0}}),
    row<&SourceOptions::labels>(
        {"--labels", "replay", "labels"},
        "Folder of labels; cameras: from their label images; none: all is unlabelled",
        {.value = "FOLDER|cameras|none", .otherwise = "predictions"}),
    row<&SourceOptions::deskew>({"--deskew", "replay", "deskew"},
                                "Correct scans for motion by the times of points",
                                {.otherwise = "if there are times"}),
};
inline constexpr SettingTable<SourceOptions> kSourceSettings{kSourceRows};

/// "; choose --first and --last among them".
inline Message choose_scans() {
  return "; choose " + Message(kSourceSettings["--first"]) + " and " + kSourceSettings["--last"] +
         " among them";
}

/// The options of a source for reports. labels: the folder, "cameras" or "none"; of clouds "field",
/// of depth images "images". deskew: "on", "off" or "where timed".
Json to_json(const SourceOptions& options);

}  // namespace tessera
