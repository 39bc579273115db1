// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "settings/source_options.hpp"

namespace tessera {

Json to_json(const SourceOptions& o) {
  Json json = json_of(kSourceSettings, o);
  const bool is_cloud = !o.pcd.empty() || !o.ply.empty();
  json["labels"] = is_cloud && o.labels != kNoLabels ? "field" : o.labels_or_default();
  if (!o.depth.empty()) json["labels"] = o.label_images.empty() ? "none" : "images";
  if (!o.deskew) json["deskew"] = is_cloud || !o.depth.empty() ? "off" : "where timed";
  return json;
}

}  // namespace tessera
