// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "settings/map_options.hpp"

namespace tessera {

Json to_json(const MapOptions& o, const MapSetup& setup) {
  Json json;
  json["dataset"] = o.dataset;
  // Only if given, so that the settings for a dataset stay the same.
  if (!o.pcd.empty()) json["pcd"] = o.pcd;
  if (!o.ply.empty()) json["ply"] = o.ply;
  if (!o.depth.empty()) {
    json["depth"] = o.depth;
    json["label_images"] = o.label_images;
    json["intrinsics"] = o.intrinsics;
  }
  if (!o.poses.empty()) json["poses"] = o.poses;
  json["out"] = o.out;
  json["report"] = o.report;
  json["first"] = o.first ? Json(*o.first) : Json();
  json["last"] = o.last ? Json(*o.last) : Json();
  const bool is_cloud = !o.pcd.empty() || !o.ply.empty();
  json["labels"] = is_cloud && o.labels != "none" ? "field" : o.labels;
  if (!o.depth.empty()) json["labels"] = o.label_images.empty() ? "none" : "images";
  const char* const deskew = is_cloud || !o.depth.empty() ? "off" : "where timed";
  json["deskew"] = o.deskew.empty() ? deskew : o.deskew;
  json["resolution"] = setup.map.resolution_m;
  json["inference"] = o.inference;
  json["kernel_length"] =
      setup.inference.mode == InferenceMode::kKernel ? Json(o.kernel_length_m) : Json();
  json["prior"] = setup.map.prior;
  json["max_range"] = o.max_range_m;
  json["min_range"] = o.min_range_m;
  json["downsample"] =
      setup.inference.thinning_m > 0.0 ? Json(setup.inference.thinning_m) : Json("off");
  json["thinning_weight"] =
      setup.inference.thinning_weight == ThinningWeight::kSum ? "sum" : "mean";
  json["free_space"] = o.free_space;
  json["memory"] = setup.budget_bytes;
  json["counts"] = to_string(setup.map.tuple);
  json["robot"] = o.robot.value_or(0);
  json["min_weight"] = o.min_weight;
  json["max_evidence"] = setup.max_evidence;
  json["free_weight"] = setup.free_weight;
  json["work_budget"] = o.work_budget;
  json["deadline"] = o.deadline_ms;
  json["continue"] = o.continue_from;
  json["window"] = setup.window ? Json(setup.window->radius_m) : Json();
  json["archive"] = o.archive;
  if (!o.prior_map.empty()) {
    json["prior_map"] = o.prior_map;
    json["prior_map_weight"] = o.prior_map_weight;
  }
  return json;
}

Json settings_of(Json config) {
  for (const char* const key :
       {"dataset", "pcd", "ply", "depth", "label_images", "intrinsics", "poses", "prior_map", "out",
        "report", "continue", "memory", "first", "last", "window", "archive"})
    config.erase(key);
  return config;
}

}  // namespace tessera
