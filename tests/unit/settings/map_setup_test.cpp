// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <limits>

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
  CHECK(refused(options).empty());
  options.resolution_m = 0.25;
  CHECK(refused(options) ==
        "--kernel-length applies to --inference lattice where voxels are under 0.25 m; leave it "
        "out, or give a finer --resolution");
  options.kernel_length_m = {};
  options.kernels = "kernels.toml";
  CHECK(refused(options).starts_with("--kernels applies to --inference lattice where voxels"));
  options = {};
  options.kernel_length_m = 0.5;
  options.inference = InferenceMode::kMultiEntropy;
  CHECK(refused(options) ==
        "--kernel-length applies to --inference kernel and lattice; leave it out, or choose one of "
        "these modes");
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

TEST_CASE("set_up: boxes of the body are six numbers each, and no box is refused silently") {
  MapOptions options;
  options.body = {-1, -2, -3, 4, 5, 6, 0.5, 0.25, 0.125, 1, 1, 1};
  const Outcome<MapSetup> setup = set_up(options);
  REQUIRE(setup.ok());
  const RobotBody& body = setup->inference.body;
  REQUIRE(body.count == 2);
  CHECK(body.boxes[0] == BodyBox{{-1, -2, -3}, {4, 5, 6}});
  CHECK(body.boxes[1] == BodyBox{{0.5, 0.25, 0.125}, {1, 1, 1}});
  CHECK(to_json(options, *setup)["body"] == Json(options.body));
  CHECK_FALSE(to_json({}, *setup).contains("body"));
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const std::vector<double>& bad :
       std::vector<std::vector<double>>{{0, 0, 0, 1, 1, kNaN},
                                        {kNaN, 0, 0, 1, 1, 1},
                                        {0, 0, 0, 0, 1, 1},
                                        {1, 1, 1, 0, 0, 0},
                                        {0, 0, 0, 1, 1, 101},
                                        {-kInfinity, 0, 0, 1, 1, 1},
                                        {0, 0, 0, 1, 1, 1e300}}) {
    options.body = {1, 1, 1, 2, 2, 2};
    options.body.insert(options.body.end(), bad.begin(), bad.end());
    CHECK(refused(options) ==
          "--body has a box 2 that is empty or too large; give its low corner and then its high "
          "one, each coordinate from -100 to 100");
  }
  for (const std::size_t numbers : {std::size_t{5}, std::size_t{7}, std::size_t{54}}) {
    options.body.assign(numbers, 1.0);
    CHECK(refused(options) == "--body has " + std::to_string(numbers) +
                                  " numbers; give six for each box, and at most 8 boxes");
  }
  const Matrix34d beside = (Matrix34d() << 1, 0, 0, 7, 0, 1, 0, 0, 0, 0, 1, 0).finished();
  CHECK(check_body(body, beside, "the sensor").ok());
  CHECK(check_body(body, Matrix34d::Identity(), "the lidar").failure().text() ==
        "--body has a box around the lidar, which would see nothing near it; give boxes beside "
        "the sensor");
  CHECK(check_body({}, Matrix34d::Zero(), "the sensor").ok());
}

TEST_CASE("set_up: what did not come back frees nothing, or from the least range on") {
  MapOptions options;
  CHECK(set_up(options)->inference.no_return_range_m == 0.0F);
  options.no_return_range_m = 0.5;
  CHECK(set_up(options)->inference.no_return_range_m == 0.5F);
  options.no_return_range_m = 0.4;
  CHECK(refused(options) ==
        "--no-return-range 0.4 is not allowed; give metres from --min-range, or 0");
}

TEST_CASE("split_budget: what is too little for a map is refused with what is enough") {
  MapOptions options;
  options.memory_bytes = std::size_t{1} << 20U;
  Outcome<MapSetup> setup = set_up(options);
  REQUIRE(setup.ok());
  const Outcome<ScanCapacity> none = split_budget(*setup, 100'000);
  REQUIRE_FALSE(none.ok());
  CHECK_THAT(none.failure().text(),
             Catch::StartsWith("--memory 1M is too little for a map; take --carving rays, which "
                               "needs 16M less, or give at least "));
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
