// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which recorded scans a command or a node reads.
#pragma once

#include <optional>
#include <string>

namespace tessera {

struct SourceOptions {
  std::string dataset{};  ///< Exactly one of this, pcd, ply and depth is given.
  std::string pcd{};
  std::string ply{};
  std::string depth{};         ///< A folder of depth images,
  std::string label_images{};  ///< of their labels, optionally,
  std::string intrinsics{};    ///< and the file of their camera.
  std::string poses{};         ///< For pcd, ply and depth.
  std::string labels = "predictions";
  std::string deskew{};  ///< "on" or "off"; empty: if the dataset has times.
  std::optional<int> first{};
  std::optional<int> last{};
  bool labels_given = false;

  /// The folder of the scans.
  [[nodiscard]] const std::string& folder() const noexcept {
    return !pcd.empty() ? pcd : !ply.empty() ? ply : !depth.empty() ? depth : dataset;
  }
};

}  // namespace tessera
