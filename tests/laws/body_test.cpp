// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The robot's own body: what returns on it must not do, with rays and with the image of the scan.
#include <catch2/catch.hpp>
#include <limits>

#include "laws/image_scenes.hpp"

namespace tessera::oracle {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

RobotBody body_of(const std::vector<BodyBox>& boxes) {
  RobotBody body;
  for (const BodyBox& box : boxes) body.boxes[body.count++] = box;
  return body;
}

InferenceConfig with_body(Carving carving, const RobotBody& body) {
  InferenceConfig config = by_image(20.0);
  config.free_space.carving = carving;
  config.body = body;
  return config;
}

/// A mast 1 m in front of the sensor, 0.4 m wide, before a wall all around.
double mast_and_wall(double azimuth_rad, double /*elevation_rad*/) {
  return std::abs(azimuth_rad) < 0.2 ? 1.0 / std::cos(azimuth_rad) : 10.0;
}
/// The same without the directions of the mast.
double wall_beside_mast(double azimuth_rad, double elevation_rad) {
  return std::abs(azimuth_rad) < 0.2 ? 0.0 : mast_and_wall(azimuth_rad, elevation_rad);
}
Cloud scanned(const Scene& scene) { return scan_of(scene, -10.0, 10.0, 0.5, 0.3); }

const BodyBox kMast{{0.9F, -0.3F, -0.5F}, {1.1F, 0.3F, 0.5F}};

}  // namespace

TEST_CASE("body: a scan with returns on it gives the map of the scan without them") {
  const Carving carving = GENERATE(Carving::kRays, Carving::kImage);
  const double thinning_m = GENERATE(0.0, 0.1);
  InferenceConfig config = with_body(carving, body_of({kMast}));
  config.thinning_m = thinning_m;
  const Cloud all = scanned(mast_and_wall);
  const Cloud others = scanned(wall_beside_mast);
  Mapper mapper(uncapped_map(0.1), config, 5, {.points = 60000, .tiles = 9000, .ray_blocks = 9000});
  Mapper bare(uncapped_map(0.1), config, 5, {.points = 60000, .tiles = 9000, .ray_blocks = 9000});
  const Matrix34d T = pose_at({0.05, 0.05, 0.05});
  const ScanReport report = mapper.integrate(all, T);
  const ScanReport expected = bare.integrate(others, T);
  REQUIRE(all.size() - others.size() > 1000);
  CHECK(report.on_body == all.size() - others.size());
  CHECK(report.in_range == others.size());
  CHECK(expected.on_body == 0);
  CHECK(same_content(mapper.map(), bare.map()));
  // Neither the mast nor anything behind it is known; beside it space is free.
  for (double x = 1.05; x < 9.0; x += 0.1)
    CHECK(mapper.map().evidence(Point3f(static_cast<float>(x), 0.05F, 0.05F)).sigma[0] == 0.0F);
  CHECK(is_free(mapper, {0.05, 5.05, 0.05}));
}

TEST_CASE("body: without boxes, and with none where returns are, maps are as before") {
  const Carving carving = GENERATE(Carving::kRays, Carving::kImage);
  const Cloud all = scanned(mast_and_wall);
  const ScanCapacity capacity{.points = 60000, .tiles = 9000, .ray_blocks = 9000};
  Mapper none(uncapped_map(0.1), with_body(carving, {}), 5, capacity);
  Mapper beside(uncapped_map(0.1), with_body(carving, body_of({{{-2, -2, -2}, {-1, 2, 2}}})), 5,
                capacity);
  CHECK(none.integrate(all).on_body == 0);
  CHECK(beside.integrate(all).on_body == 0);
  CHECK(same_content(none.map(), beside.map()));
  CHECK(none.map().evidence(Point3f(1.0F, 0.05F, 0.05F)).sigma[1] > 0.0F);
}

TEST_CASE("body: boxes are in the body's frame, and their faces belong to them") {
  // A sensor that looks to the left, 2 m above the body's origin and 1 m ahead of it.
  Matrix34d T_body_sensor;
  T_body_sensor << 0, -1, 0, 1, 1, 0, 0, 0, 0, 0, 1, 2;
  const InferenceConfig config =
      with_body(Carving::kRays, body_of({{{-4, 1, 0}, {-1, 3, 1}}, {{8, -1, -1}, {9, 1, 1}}}));
  struct Return {
    double x, y, z;
    bool is_on_body;
  };
  // p_body = (1 - y, x, z + 2)
  for (const Return& r : {Return{2, 3, -1.5, true},
                          {1, 2, -2, true},
                          {3, 5, -1, true},
                          {0.99, 2, -2, false},
                          {1, 1.99, -2, false},
                          {1, 2, -2.01, false},
                          {3.01, 5, -1, false},
                          {0, -7.5, -2, true},
                          {0, -8.01, -2, false},
                          {-2, 3, -1.5, false}}) {
    CAPTURE(r.x, r.y, r.z);
    Cloud cloud;
    cloud.add(r.x, r.y, r.z, 1);
    ScanView view = cloud.view();
    view.T_body_sensor = T_body_sensor;
    Mapper mapper(uncapped_map(0.1), config, 5);
    const ScanReport report = mapper.integrator().integrate(mapper.map(), view);
    CHECK(report.pose == Status::kOk);
    CHECK(report.on_body == (r.is_on_body ? 1U : 0U));
    CHECK(report.in_range == (r.is_on_body ? 0U : 1U));
  }
}

TEST_CASE("body: a scan of a sensor in a box, or of none, is refused whole") {
  const RobotBody body = body_of({{{-1, -1, -1}, {1, 1, 1}}});
  Matrix34d beside = Matrix34d::Identity();
  beside(0, 3) = 1.001;
  Matrix34d on_face = beside;
  on_face(0, 3) = 1.0;
  Matrix34d skewed = beside;
  skewed(0, 0) = 2.0;
  Matrix34d nowhere = beside;
  nowhere(1, 3) = std::numeric_limits<double>::quiet_NaN();
  Cloud cloud;
  cloud.add(5, 0, 0, 1);
  for (const auto& [T, is_refused] : {std::pair{beside, false},
                                      {on_face, true},
                                      {Matrix34d(Matrix34d::Identity()), true},
                                      {skewed, true},
                                      {nowhere, true}}) {
    Mapper mapper(uncapped_map(0.1), with_body(Carving::kImage, body), 5);
    ScanView view = cloud.view();
    view.T_body_sensor = T;
    const ScanReport report = mapper.integrator().integrate(mapper.map(), view);
    CHECK((report.pose == Status::kInvalidArgument) == is_refused);
    CHECK(observed_voxels(mapper.map()).empty() == is_refused);
    CHECK(mapper.integrator().admitted().size() == (is_refused ? 0 : 1));
    // Where there is no body, its frame does not matter.
    Mapper bare(uncapped_map(0.1), with_body(Carving::kImage, {}), 5);
    CHECK(bare.integrator().integrate(bare.map(), view).pose == Status::kOk);
  }
}

TEST_CASE("body: boxes that are none are refused, in whatever number they are hidden") {
  const BodyBox good{{1, 1, 1}, {2, 2, 2}};
  CHECK(body_of(std::vector<BodyBox>(RobotBody::kMostBoxes, good)).is_valid());
  CHECK(RobotBody{}.is_valid());
  RobotBody too_many = body_of({good});
  too_many.count = RobotBody::kMostBoxes + 1;
  CHECK_FALSE(too_many.is_valid());
  AlignedMemory memory(Integrator::required_bytes(test_capacity(), InferenceConfig{}));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const auto& [low, high] :
         std::vector<std::pair<float, float>>{{kNaN, 1.0F},
                                              {0.0F, kNaN},
                                              {1.0F, 1.0F},
                                              {2.0F, 1.0F},
                                              {-100.5F, 1.0F},
                                              {0.0F, std::numeric_limits<float>::infinity()},
                                              {0.0F, std::numeric_limits<float>::max()},
                                              {-0.0F, 0.0F}}) {
      for (const std::uint32_t at : {0U, 3U, 7U}) {
        RobotBody body = body_of(std::vector<BodyBox>(RobotBody::kMostBoxes, good));
        body.boxes[at].low[axis] = low;
        body.boxes[at].high[axis] = high;
        CHECK_FALSE(body.is_valid());
        InferenceConfig config;
        config.body = body;
        Arena arena = memory.arena();
        CHECK(Integrator::make(arena, config, test_capacity()).status() ==
              Status::kInvalidArgument);
        body.count = at;  // It does not count.
        CHECK(body.is_valid());
      }
    }
  }
}

}  // namespace tessera::oracle
