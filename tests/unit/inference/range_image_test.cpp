// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The range image against all returns, one by one: in the open, at the cube's rims and at its
// corners.
#include "tessera/inference/internal/range_image.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <memory>
#include <vector>

#include "support/random.hpp"

namespace tessera {
namespace {

using oracle::Random;

struct Memory {
  alignas(kArenaAlignment) std::array<std::byte, RangeImage::required_bytes()> bytes;
};

struct Return {
  Point3d direction;
  double range_m;
};

/// The angle between two directions, exact for small ones too.
double angle_between(const Point3d& a, const Point3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

Point3d any_direction(Random& random) {
  for (;;) {
    const Point3d d(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0),
                    random.uniform(-1.0, 1.0));
    if (d.norm() > 0.1 && d.norm() < 1.0) return d;
  }
}

/// A direction at angle_rad from d, all around it.
Point3d beside(Random& random, const Point3d& d, double angle_rad) {
  const Point3d side = d.cross(any_direction(random)).normalized();
  return std::cos(angle_rad) * d.normalized() + std::sin(angle_rad) * side;
}

/// The cube's 6 face centres, 12 rims and 8 corners, and its faces in between: where a cone is cut
/// by 1, 2 or 3 faces.
Point3d place(int i, Random& random) {
  Point3d d(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
  if (d.isZero()) return any_direction(random);
  for (int axis = 0; axis < 3; ++axis) {
    if (random.uniform() < 0.3 && std::abs(d[axis]) < 0.5) d[axis] = random.uniform(-1.0, 1.0);
  }
  return d;
}

float any_angle(Random& random) {
  constexpr std::array<float, 5> kAngles{0.001F, 0.005F, 0.015F, 0.03F, RangeImage::kMaxAngle_rad};
  if (random.uniform() < 0.5) return kAngles[static_cast<std::size_t>(random.below(5))];
  return static_cast<float>(random.uniform(0.001, 0.04999));
}

class Image {
 public:
  RangeImage* operator->() { return &image_; }
  RangeImage& operator*() { return image_; }

 private:
  std::unique_ptr<Memory> memory_ = std::make_unique<Memory>();
  Arena arena_{memory_->bytes};
  RangeImage image_ = *RangeImage::make(arena_);
};

}  // namespace

TEST_CASE("range image: a return just within the angle is found, whatever faces it is across") {
  Image image;
  Random random(71);
  int missed = 0;
  for (int trial = 0; trial < 27 * 400; ++trial) {
    const float angle_rad = any_angle(random);
    const Point3d d = beside(random, place(trial % 27, random), random.uniform(0.0, 0.06));
    image->clear();
    image->add_return(3.0 * beside(random, d, 0.9999999 * static_cast<double>(angle_rad)), 3.0);
    if (image->nearest_m(random.uniform(0.01, 80.0) * d, angle_rad) != 3.0F) ++missed;
  }
  CHECK(missed == 0);
}

TEST_CASE("range image: a return farther off than the angle and the slack does not count") {
  Image image;
  Random random(72);
  int wrong = 0;
  for (int trial = 0; trial < 27 * 400; ++trial) {
    const float angle_rad = any_angle(random);
    const Point3d d = beside(random, place(trial % 27, random), random.uniform(0.0, 0.06));
    image->clear();
    const double limit_rad = static_cast<double>(angle_rad) + RangeImage::kSlack_rad;
    image->add_return(beside(random, d, limit_rad * random.uniform(1.0000001, 1.5)), 1.0);
    if (image->nearest_m(d, angle_rad) != RangeImage::kNone_m) ++wrong;
  }
  CHECK(wrong == 0);
}

TEST_CASE("range image: of many returns, the nearest within the angle or the slack beyond it") {
  Image image;
  Random random(73);
  int too_far = 0;
  int too_near = 0;
  int found = 0;
  for (int trial = 0; trial < 27 * 8; ++trial) {
    image->clear();
    const Point3d middle = place(trial % 27, random);
    std::vector<Return> returns;
    for (int i = 0; i < 150; ++i) {
      returns.push_back({beside(random, middle, random.uniform(0.0, 0.25)),
                         static_cast<double>(static_cast<float>(random.uniform(0.5, 80.0)))});
      image->add_return(returns.back().direction, returns.back().range_m);
    }
    for (int query = 0; query < 60; ++query) {
      const float angle_rad = any_angle(random);
      const Point3d d = beside(random, middle, random.uniform(0.0, 0.25));
      double within_m = static_cast<double>(RangeImage::kNone_m);
      double with_slack_m = within_m;
      for (const Return& r : returns) {
        const double off_rad = angle_between(d, r.direction) - static_cast<double>(angle_rad);
        if (off_rad <= 0.0) within_m = std::fmin(within_m, r.range_m);
        if (off_rad <= RangeImage::kSlack_rad) with_slack_m = std::fmin(with_slack_m, r.range_m);
      }
      const auto nearest_m = static_cast<double>(image->nearest_m(d, angle_rad));
      too_far += nearest_m > within_m ? 1 : 0;
      too_near += nearest_m < with_slack_m ? 1 : 0;
      found += within_m < 100.0 ? 1 : 0;
    }
  }
  CHECK(found > 3000);
  CHECK(too_far == 0);
  CHECK(too_near == 0);
}

TEST_CASE("range image: a return in the very direction is found, on the borders of pixels too") {
  Image image;
  int missed = 0;
  for (int row = 0; row <= RangeImage::kFacePixels; ++row) {
    for (int column = 0; column <= RangeImage::kFacePixels; column += 3) {
      const double u = 2.0 * column / RangeImage::kFacePixels - 1.0;
      const double v = 2.0 * row / RangeImage::kFacePixels - 1.0;
      for (const Point3d& d : {Point3d(7.3, 7.3 * u, 7.3 * v), Point3d(-0.7 * u, 0.7, -0.7 * v)}) {
        const double range_m = 1.0 + row;
        image->add_return(d, range_m);
        if (!(static_cast<double>(image->nearest_m(d, 0.0F)) <= range_m)) ++missed;
      }
    }
    image->clear();
  }
  CHECK(missed == 0);
}

TEST_CASE("range image: the nearer of two returns in one direction counts, in either order") {
  Image image;
  const Point3d d(1.0, 0.2, -0.3);
  image->add_return(d, 7.0);
  image->add_return(d, 4.0);
  image->add_return(d, 5.0);
  CHECK(image->nearest_m(d, 0.0F) == 4.0F);
}

TEST_CASE("range image: cleared, it holds no return in any direction") {
  Image image;
  Random random(74);
  for (int i = 0; i < 1000; ++i) image->add_return(any_direction(random), 2.0);
  image->clear();
  for (int i = 0; i < 1000; ++i) {
    REQUIRE(image->nearest_m(any_direction(random), RangeImage::kMaxAngle_rad) ==
            RangeImage::kNone_m);
  }
}

TEST_CASE("range image: memory one byte short is refused") {
  const auto memory = std::make_unique<Memory>();
  Arena arena(std::span<std::byte>(memory->bytes).first(RangeImage::required_bytes() - 1));
  CHECK(RangeImage::make(arena).status() == Status::kResourceExhausted);
}

}  // namespace tessera
