// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "settings/map_options.hpp"

namespace tessera {

MapOptions MapOptions::complete() const {
  MapOptions o = *this;
  const auto set = [](auto& value, auto otherwise) { value = value.value_or(otherwise); };
  set(o.resolution_m, 0.1);
  if (is_kernel()) set(o.kernel_length_m, 0.5);
  set(o.prior, 0.001);
  set(o.downsample_m, *o.resolution_m);
  set(o.thinning_weight, is_kernel() ? ThinningWeight::kSum : ThinningWeight::kMean);
  // A long kernel brings many classes into a voxel: three slots are too few for them.
  set(o.counts, is_kernel() ? TuplePolicy::kDense : TuplePolicy::kCompact);
  set(o.robot, 0U);
  // Their sums have other sizes.
  set(o.max_evidence, is_kernel() ? 250.0 : 100.0);
  set(o.free_weight, is_kernel() ? 1.0 : 0.4);
  if (!prior_map.empty()) set(o.prior_map_weight, 1.0);
  return o;
}

Json to_json(const MapOptions& options, const MapSetup& setup) {
  const MapOptions o = options.complete();
  Json json = to_json(static_cast<const SourceOptions&>(o));
  json.update(json_of(kMapSettings, o));
  json.update(json_of(kMapFileSettings, o));
  json["window"] = setup.window ? Json(setup.window->radius_m) : Json();
  // Only if given, so that the settings for a dataset stay the same.
  for (const char* const key : {"pcd", "ply", "depth", "label_images", "intrinsics", "poses",
                                "prior_map", "prior_map_weight", "submap_length"}) {
    if (json[key].is_null() || json[key] == "") json.erase(key);
  }
  if (o.body.empty()) json.erase("body");
  json.erase("kernels");
  for (const NamedKernel& kernel : setup.kernels)
    json["kernels"][kernel.name] = {kernel.reach_m, kernel.height_m};
  if (!(o.no_return_range_m > 0.0)) json.erase("no_return_range");
  if (!o.corrections.empty()) json["corrections"] = o.corrections;
  return json;
}

Json settings_of(Json config) {
  for (const char* const key :
       {"dataset", "pcd", "ply", "depth", "label_images", "intrinsics", "poses", "prior_map", "out",
        "report", "continue", "memory", "first", "last", "window", "archive", "corrections"})
    config.erase(key);
  return config;
}

}  // namespace tessera
