// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Camera models against the formulas in long double with libm, and back again; what distortion
// folds into the image is not seen.
#include "tessera/registration/camera_model.hpp"

#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "support/random.hpp"
#include "tessera/base/internal/digest.hpp"

namespace tessera {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

CameraIntrinsics pinhole(const std::array<double, 5>& distortion) {
  return {CameraKind::kPinhole, 640, 384, 520.0, 515.0, 322.5, 190.25, distortion};
}
CameraIntrinsics fisheye(const std::array<double, 5>& distortion) {
  return {CameraKind::kFisheye, 640, 480, 180.0, 182.0, 318.0, 241.0, distortion};
}

CameraModel made(const CameraIntrinsics& intrinsics) {
  const Result<CameraModel> model = CameraModel::make(intrinsics);
  REQUIRE(model.ok());
  return *model;
}

/// The models of real calibrations' sizes, and their extremes.
std::vector<CameraIntrinsics> sample_cameras() {
  return {pinhole({}),
          pinhole({-0.3, 0.11, 0.0008, -0.0005, -0.018}),
          pinhole({0.2, -0.05, -0.002, 0.003, 0.01}),
          pinhole({-0.25, 0.0, 0.0, 0.0, 0.0}),
          pinhole({0.0, 0.0, 0.02, -0.015, 0.0}),
          fisheye({}),
          fisheye({-0.012, 0.004, -0.0015, 0.0002, 0.0}),
          fisheye({0.1, 0.02, 0.0, 0.0, 0.0}),
          fisheye({-0.05, 0.0, 0.0, 0.0, 0.0})};
}

/// The formulas as they stand in the header, wherever the point is.
Pixel formula(const CameraIntrinsics& c, const Point3d& p) {
  const auto wide = [](double number) { return static_cast<long double>(number); };
  const long double X = wide(p.x());
  const long double Y = wide(p.y());
  const long double Z = wide(p.z());
  long double x = 0.0L;
  long double y = 0.0L;
  std::array<long double, 5> k{};
  for (std::size_t i = 0; i < k.size(); ++i) k[i] = wide(c.distortion[i]);
  if (c.kind == CameraKind::kPinhole) {
    const long double u = X / Z;
    const long double v = Y / Z;
    const long double s = u * u + v * v;
    const long double q = 1.0L + k[0] * s + k[1] * s * s + k[4] * s * s * s;
    x = u * q + 2.0L * k[2] * u * v + k[3] * (s + 2.0L * u * u);
    y = v * q + k[2] * (s + 2.0L * v * v) + 2.0L * k[3] * u * v;
  } else {
    const long double aside = std::hypot(X, Y);
    const long double t = std::atan2(aside, Z);
    const long double d = t * (1.0L + k[0] * t * t + k[1] * std::pow(t, 4.0L) +
                               k[2] * std::pow(t, 6.0L) + k[3] * std::pow(t, 8.0L));
    x = aside > 0.0L ? d * X / aside : 0.0L;
    y = aside > 0.0L ? d * Y / aside : 0.0L;
  }
  return {static_cast<double>(wide(c.focal_x_px) * x + wide(c.centre_x_px)),
          static_cast<double>(wide(c.focal_y_px) * y + wide(c.centre_y_px))};
}

Point3d drawn_point(oracle::Random& random) {
  const double x = random.uniform(-20, 20);
  const double y = random.uniform(-20, 20);
  return {x, y, random.uniform(-20, 20)};
}

TEST_CASE("camera: a pinhole's distortion gives the pixel worked out by hand") {
  CameraIntrinsics c = pinhole({-0.3, 0.1, 0.001, -0.002, 0.0});
  c.focal_x_px = c.focal_y_px = 1000.0;
  c.width_px = c.height_px = 1400;
  c.centre_x_px = c.centre_y_px = 700.0;
  const CameraModel model = made(c);
  Pixel pixel;
  // x = 0.5, y = -0.25: r^2 = 0.3125, q = 0.916015625.
  REQUIRE(model.project({1.0, -0.5, 2.0}, pixel) == Sight::kSeen);
  CHECK(pixel.column == Approx(700.0 + 456.1328125).epsilon(1e-14));
  CHECK(pixel.row == Approx(700.0 - 228.06640625).epsilon(1e-14));
}

TEST_CASE("camera: a fisheye without distortion is as far from the centre as the angle") {
  CameraIntrinsics c = fisheye({});
  c.width_px = c.height_px = 1200;
  c.centre_x_px = c.centre_y_px = 600.0;
  const CameraModel model = made(c);
  const double half = 1.5707963267948966;
  Pixel pixel;
  REQUIRE(model.project({3.0, 0.0, 3.0}, pixel) == Sight::kSeen);
  CHECK(pixel.column == Approx(600.0 + 180.0 * half / 2));
  REQUIRE(model.project({0.0, -2.0, 0.0}, pixel) == Sight::kSeen);
  CHECK(pixel.row == Approx(600.0 - 182.0 * half));
  REQUIRE(model.project({-1.0, 0.0, -1.0}, pixel) == Sight::kSeen);
  CHECK(pixel.column == Approx(600.0 - 180.0 * 1.5 * half));
}

TEST_CASE("camera: what is seen is where the formulas put it, and its pixel looks at it again") {
  constexpr std::uint64_t kSeed = 81;
  INFO("seed " << kSeed);
  oracle::Random random(kSeed);
  for (const CameraIntrinsics& c : sample_cameras()) {
    const CameraModel model = made(c);
    int seen = 0;
    for (int round = 0; round < 20000; ++round) {
      const Point3d p = drawn_point(random);
      Pixel pixel;
      if (model.project(p, pixel) != Sight::kSeen) continue;
      ++seen;
      const Pixel expected = formula(c, p);
      REQUIRE(std::abs(pixel.column - expected.column) < 1e-9);
      REQUIRE(std::abs(pixel.row - expected.row) < 1e-9);
      // One-to-one: no other direction has this pixel.
      const Result<Point3d> back = model.unproject(pixel);
      REQUIRE(back.ok());
      REQUIRE((*back - p.normalized()).norm() < 1e-6);
    }
    CHECK(seen > 500);
  }
}

TEST_CASE("camera: every pixel of a pinhole's image sees a direction that projects to it") {
  for (const CameraIntrinsics& c : sample_cameras()) {
    const CameraModel model = made(c);
    for (int row = 0; row < c.height_px; row += 7) {
      for (int column = 0; column < c.width_px; column += 7) {
        const Result<Point3d> ray = model.unproject({column * 1.0, row * 1.0});
        if (c.kind == CameraKind::kPinhole) REQUIRE(ray.ok());
        if (!ray.ok()) continue;
        REQUIRE(std::abs(ray->norm() - 1.0) < 1e-12);
        Pixel pixel;
        REQUIRE(model.project(*ray * 7.5, pixel) == Sight::kSeen);
        REQUIRE(std::abs(pixel.column - column) < 1e-6);
        REQUIRE(std::abs(pixel.row - row) < 1e-6);
      }
    }
  }
}

TEST_CASE("camera: what the formulas fold back into the image from far beside it is outside") {
  const CameraIntrinsics barrel = pinhole({-0.25, 0.0, 0.0, 0.0, 0.0});
  const CameraModel model = made(barrel);
  // 62 degrees to the side, where the image ends at 40.
  const Point3d p(1.9, 0.1, 1.0);
  const Pixel folded = formula(barrel, p);
  REQUIRE((folded.column > 0.0 && folded.column < 639.0 && folded.row > 0.0 && folded.row < 383.0));
  Pixel pixel{-7.0, -7.0};
  CHECK(model.project(p, pixel) == Sight::kOutside);
  CHECK(pixel.column == -7.0);

  CameraIntrinsics narrow = fisheye({-0.15, 0.0, 0.0, 0.0, 0.0});
  narrow.width_px = narrow.height_px = 240;
  narrow.centre_x_px = narrow.centre_y_px = 120.0;
  const CameraModel round = made(narrow);
  const Point3d behind(0.4, 0.0, -1.0);
  const Pixel wrapped = formula(narrow, behind);
  REQUIRE((wrapped.column > 0.0 && wrapped.column < 239.0));
  CHECK(round.project(behind, pixel) == Sight::kBehind);
}

TEST_CASE("camera: a model that folds within its image is refused") {
  CHECK(CameraModel::make(pinhole({-0.5, 0.0, 0.0, 0.0, 0.0})).status() == Status::kMismatch);
  CHECK(CameraModel::make(pinhole({-0.3, 0.0, 0.0, 0.0, -0.4})).status() == Status::kMismatch);
  CHECK(CameraModel::make(pinhole({0.0, 0.0, 0.2, 0.2, 0.0})).status() == Status::kMismatch);
  CHECK(CameraModel::make(pinhole({1e6, -1e6, 1e6, 1e6, -1e6})).status() == Status::kMismatch);
  CHECK(CameraModel::make(fisheye({-1.0, 0.0, 0.0, 0.0, 0.0})).status() == Status::kMismatch);
  CameraIntrinsics wide = pinhole({});
  wide.focal_x_px = 1e-3;
  CHECK(CameraModel::make(wide).status() == Status::kMismatch);
}

TEST_CASE("camera: a fisheye's corners beyond its one-to-one part see nothing") {
  const CameraModel model = made(fisheye({-0.05, 0.0, 0.0, 0.0, 0.0}));
  CHECK(model.limit() == Approx(2.5819888974716112));  // 1 = 3 * 0.05 theta^2
  CHECK(model.unproject({0.0, 0.0}).status() == Status::kOutOfRange);
  CHECK(model.unproject({318.0, 2.0}).ok());
}

TEST_CASE("camera: numbers that are no calibration are refused") {
  const auto refused = [](auto change) {
    for (CameraIntrinsics c : {pinhole({}), fisheye({})}) {
      change(c);
      if (CameraModel::make(c).status() != Status::kInvalidArgument) return false;
    }
    return true;
  };
  for (const double bad : {kNaN, kInfinity, -kInfinity, 1e300}) {
    CHECK(refused([&](CameraIntrinsics& c) { c.focal_x_px = bad; }));
    CHECK(refused([&](CameraIntrinsics& c) { c.focal_y_px = bad; }));
    CHECK(refused([&](CameraIntrinsics& c) { c.centre_x_px = bad; }));
    CHECK(refused([&](CameraIntrinsics& c) { c.centre_y_px = bad; }));
    for (std::size_t i = 0; i < 5; ++i)
      CHECK(refused([&](CameraIntrinsics& c) { c.distortion[i] = bad; }));
  }
  for (const double bad : {0.0, -400.0}) {
    CHECK(refused([&](CameraIntrinsics& c) { c.focal_x_px = bad; }));
    CHECK(refused([&](CameraIntrinsics& c) { c.focal_y_px = bad; }));
  }
  for (const int bad : {0, -1, CameraModel::kMostPixels + 1}) {
    CHECK(refused([&](CameraIntrinsics& c) { c.width_px = bad; }));
    CHECK(refused([&](CameraIntrinsics& c) { c.height_px = bad; }));
  }
  CHECK(CameraModel::make(fisheye({0, 0, 0, 0, 0.1})).status() == Status::kInvalidArgument);
}

TEST_CASE("camera: the camera's centre, points behind it and points that are not finite") {
  for (const CameraIntrinsics& c : sample_cameras()) {
    const CameraModel model = made(c);
    Pixel pixel;
    CHECK(model.project({0.0, 0.0, 0.0}, pixel) == Sight::kBehind);
    CHECK(model.project({0.0, 0.0, -1.0}, pixel) == Sight::kBehind);
    CHECK(model.project({0.0, 0.0, 1e-300}, pixel) == Sight::kSeen);
    CHECK(model.project({1e300, 1e300, 1e300}, pixel) != Sight::kBehind);
    for (const double bad : {kNaN, kInfinity, -kInfinity}) {
      CHECK(model.project({bad, 0.0, 1.0}, pixel) != Sight::kSeen);
      CHECK(model.project({0.0, bad, 1.0}, pixel) != Sight::kSeen);
      CHECK(model.project({bad, bad, bad}, pixel) != Sight::kSeen);
    }
    CHECK_FALSE(model.unproject({kNaN, 1.0}).ok());
    CHECK_FALSE(model.unproject({-0.6, 1.0}).ok());
    CHECK_FALSE(model.unproject({1.0, c.height_px - 0.5}).ok());
  }
  Pixel pixel;
  CHECK(CameraModel().project({0.0, 0.0, 1.0}, pixel) != Sight::kSeen);
  CHECK_FALSE(CameraModel().unproject({0.0, 0.0}).ok());
}

TEST_CASE("camera: the half pixel around the outermost pixels is in the image") {
  const CameraModel model = made(pinhole({}));
  const CameraIntrinsics& c = model.intrinsics();
  Pixel pixel;
  const auto at = [&](double column, double row) {
    return model.project({(column - c.centre_x_px) / c.focal_x_px * 4.0,
                          (row - c.centre_y_px) / c.focal_y_px * 4.0, 4.0},
                         pixel);
  };
  CHECK(at(-0.499, -0.499) == Sight::kSeen);
  CHECK(at(639.499, 383.499) == Sight::kSeen);
  CHECK(at(-0.501, 5.0) == Sight::kOutside);
  CHECK(at(5.0, -0.501) == Sight::kOutside);
  CHECK(at(639.501, 5.0) == Sight::kOutside);
  CHECK(at(5.0, 383.501) == Sight::kOutside);
}

TEST_CASE("golden digest: pixels and rays are the same to the bit on every machine") {
  oracle::Random random(82);
  Digest digest;
  const auto add = [&digest](double number) { digest.add(std::bit_cast<std::uint64_t>(number)); };
  for (const CameraIntrinsics& c : sample_cameras()) {
    const CameraModel model = made(c);
    add(model.limit());
    for (int round = 0; round < 2000; ++round) {
      const Point3d p = drawn_point(random);
      Pixel pixel;
      digest.add(static_cast<std::uint64_t>(model.project(p, pixel)));
      add(pixel.column);
      add(pixel.row);
      const double column = random.uniform(0, c.width_px);
      const Result<Point3d> ray = model.unproject({column, random.uniform(0, c.height_px)});
      if (!ray.ok()) continue;
      for (int axis = 0; axis < 3; ++axis) add((*ray)[axis]);
    }
  }
  CHECK(digest.value() == 0x643e8c0351499165U);
}

}  // namespace
}  // namespace tessera
