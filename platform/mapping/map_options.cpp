// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "mapping/map_options.hpp"

namespace tessera {

Json to_json(const MapOptions& o, const MapSetup& setup) {
  Json json;
  json["dataset"] = o.dataset;
  json["out"] = o.out;
  json["report"] = o.report;
  json["first"] = o.first ? Json(*o.first) : Json();
  json["last"] = o.last ? Json(*o.last) : Json();
  json["labels"] = o.labels;
  json["deskew"] = o.deskew.empty() ? "where timed" : o.deskew;
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
  json["window"] = o.window_m ? Json(*o.window_m) : Json();
  json["archive"] = o.archive;
  return json;
}

}  // namespace tessera
