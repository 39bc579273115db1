// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>

#include "settings/map_options.hpp"

namespace tessera {
namespace {

std::string refused(const MapOptions& options) {
  const Outcome<MapSetup> setup = set_up(options);
  return setup.ok() ? "" : setup.failure().text();
}

TEST_CASE("MapOptions: what is not given follows from the mode and the resolution") {
  MapOptions options;
  options.resolution_m = 0.2;
  const MapOptions usual = options.complete();
  CHECK(usual.downsample_m == Approx(0.2));
  CHECK(usual.counts == TuplePolicy::kCompact);
  CHECK(usual.thinning_weight == ThinningWeight::kMean);
  CHECK(usual.max_evidence == Approx(100.0));
  CHECK(usual.free_weight == Approx(0.4));
  CHECK_FALSE(usual.kernel_length_m);
  options.inference = InferenceMode::kKernel;
  const MapOptions kernel = options.complete();
  CHECK(kernel.counts == TuplePolicy::kDense);
  CHECK(kernel.thinning_weight == ThinningWeight::kSum);
  CHECK(kernel.max_evidence == Approx(250.0));
  CHECK(kernel.free_weight == Approx(1.0));
  CHECK(kernel.kernel_length_m == Approx(0.5));
}

TEST_CASE("set_up: options that contradict each other are refused, each with the others' names") {
  MapOptions options;
  CHECK(refused(options).empty());
  options.max_evidence = 0.1;
  CHECK(refused(options) ==
        "--max-evidence 0.1 is not allowed; give 0, or 1 to 255 times --free-weight");
  options = {};
  options.kernel_length_m = 0.5;
  CHECK(refused(options) ==
        "--kernel-length applies to --inference kernel only; leave it out, or choose that mode");
  options.inference = InferenceMode::kKernel;
  options.resolution_m = 2.0;
  CHECK(refused(options) ==
        "--kernel-length 0.5 is not allowed; give metres from 0.5 to 32 voxels");
  options = {};
  options.min_range_m = 50.0;
  CHECK(refused(options) == "--min-range 50 is not allowed; give metres, under --max-range");
  options.max_range_m = 0.0;
  CHECK(refused(options).empty());
  options.archive = "folder";
  CHECK(refused(options) == "--archive needs --window where --max-range is 0; give --window too");
  options.window_m = 3201.0;
  CHECK(refused(options) == "--window 3201 is not allowed; give metres above 0, to 32000 voxels");
  options = {};
  options.prior_map_weight = 2.0;
  CHECK(refused(options) ==
        "--prior-map-weight is for --prior-map; name an OctoMap file, or leave it out");
  options.prior_map = "map.bt";
  CHECK(refused(options).empty());
  options.prior_map_weight = 200.0;
  CHECK(refused(options) ==
        "--prior-map-weight 200 is not allowed; give evidence from 0.001 to --max-evidence");
}

TEST_CASE("split_budget: what is too little for a map is refused with what is enough") {
  MapOptions options;
  options.memory_bytes = std::size_t{1} << 20U;
  Outcome<MapSetup> setup = set_up(options);
  REQUIRE(setup.ok());
  const Outcome<ScanCapacity> none = split_budget(*setup, 100'000);
  REQUIRE_FALSE(none.ok());
  CHECK_THAT(none.failure().text(),
             Catch::StartsWith("--memory 1M is too little for a map; give at least "));
  CHECK_THAT(none.failure().text(Speaker::kPython),
             Catch::StartsWith("memory_bytes 1048576 bytes is too little"));
}

TEST_CASE("to_json: a report has the values that hold, and paths of another source only if given") {
  MapOptions options;
  options.dataset = "street";
  options.downsample_m = 0.0;
  const Outcome<MapSetup> setup = set_up(options);
  REQUIRE(setup.ok());
  const Json json = to_json(options, *setup);
  CHECK(json["dataset"] == "street");
  CHECK(json["labels"] == "predictions");
  CHECK(json["deskew"] == "where timed");
  CHECK(json["resolution"] == 0.1);
  CHECK(json["kernel_length"].is_null());
  CHECK(json["downsample"] == "off");
  CHECK(json["free_space"] == "on");
  CHECK(json["counts"] == "compact");
  CHECK(json["memory"] == 536870912);
  CHECK(json["window"].is_null());
  CHECK_FALSE(json.contains("pcd"));
  CHECK_FALSE(json.contains("prior_map_weight"));
  CHECK_FALSE(settings_of(json).contains("memory"));
}

}  // namespace
}  // namespace tessera
