// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "map_arguments.hpp"

#include "base/number_text.hpp"

namespace tessera::python {

MapOptions options_of(const FixedArguments& fixed, const InferenceArguments& how) {
  MapOptions o;
  o.labels = "arrays";
  o.deskew = "off";
  o.resolution_m = fixed.resolution_m;
  o.prior = fixed.prior;
  o.max_evidence = fixed.max_evidence;
  o.free_weight = fixed.free_weight;
  o.counts = fixed.counts.value_or("");
  o.robot = fixed.robot;
  o.memory = std::to_string(how.memory_bytes);
  o.inference = how.inference;
  o.kernel_length_given = how.kernel_length_m.has_value();
  if (how.kernel_length_m) o.kernel_length_m = *how.kernel_length_m;
  o.max_range_m = how.max_range_m;
  o.min_range_m = how.min_range_m;
  if (how.downsample_m)
    o.downsample = *how.downsample_m == 0.0 ? "off" : text_of(*how.downsample_m);
  o.thinning_weight = how.thinning_weight.value_or("");
  o.free_space = how.free_space ? "on" : "off";
  o.min_weight = how.min_weight;
  o.work_budget = how.work_budget;
  o.deadline_ms = how.deadline_ms;
  o.window_m = how.window_m;
  if (how.archive && how.archive->empty())
    throw InputError("archive is empty; name a folder, or give None");
  if (how.archive) o.archive = how.archive->string();
  return o;
}

}  // namespace tessera::python
