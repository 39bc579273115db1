// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The height field is stored at 0.25 m and walked in two levels: a tile of 4 m whose highest vertex
// is below the ray is skipped, so that grazing rays of 100 m are cheap.
#include "simulator/ground.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "simulator/random.hpp"
#include "simulator/smooth_noise.hpp"

namespace tessera::street {
namespace {

constexpr double kCell_m = 0.25;
constexpr int kTileCells = 16;
constexpr double kTile_m = kCell_m * kTileCells;
constexpr double kMargin_m = 2.0;
constexpr double kKerb_m = 0.12;

/// Distance at which the ray leaves its square of the lattice at t (a little beyond the border).
double next_border(const Ray& ray, double t, double edge_m, double origin_x, double origin_y) {
  constexpr double kStep = 1e-7;
  double leave = kNoHit;
  const double at[2] = {ray.origin.x() + t * ray.direction.x() - origin_x,
                        ray.origin.y() + t * ray.direction.y() - origin_y};
  for (int axis = 0; axis < 2; ++axis) {
    const double speed = ray.direction[axis];
    if (std::abs(speed) < 1e-12) continue;
    const double low = std::floor(at[axis] / edge_m) * edge_m;
    const double border = speed > 0.0 ? low + edge_m : low;
    leave = std::min(leave, t + (border - at[axis]) / speed);
  }
  return std::max(leave, t) + kStep;
}

double low_x(double half_length_m) { return -(half_length_m + kMargin_m); }
constexpr double kLowY = -(kStreetHalfWidth_m + kMargin_m);

}  // namespace

Ground::Ground(std::uint64_t seed, double half_length_m)
    : seed_(seed), half_length_m_(half_length_m) {
  const auto tiles = [](double length_m) {
    return static_cast<int>(std::ceil(length_m / kTile_m));
  };
  tile_columns_ = tiles(-2.0 * low_x(half_length_m));
  const int tile_rows = tiles(-2.0 * kLowY);
  columns_ = tile_columns_ * kTileCells + 1;
  rows_ = tile_rows * kTileCells + 1;
  heights_.reserve(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
  crests_.assign(static_cast<std::size_t>(tile_columns_) * static_cast<std::size_t>(tile_rows),
                 -1e9);
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      const double z = height(low_x(half_length_m) + column * kCell_m, kLowY + row * kCell_m);
      heights_.push_back(z);
      for (int dy = 0; dy < 2; ++dy) {
        for (int dx = 0; dx < 2; ++dx) {
          // A vertex on a tile's border belongs to both tiles.
          const int tile_x = std::max(column - dx, 0) / kTileCells;
          const int tile_y = std::max(row - dy, 0) / kTileCells;
          if (tile_x >= tile_columns_ || tile_y >= tile_rows) continue;
          double& crest = crests_[static_cast<std::size_t>(tile_y * tile_columns_ + tile_x)];
          crest = std::max(crest, z);
        }
      }
    }
  }
}

bool Ground::is_parking(int side, int slot) const {
  // Every fourth slot or so is grass with a tree; a bay is never alone for long.
  if (unit_of(hash_of(seed_, Stream::kVerge, side, slot)) < 0.22) return false;
  return ((slot % 4) + 4) % 4 != (side > 0 ? 1 : 3);
}

double Ground::road_height(double x_m) const {
  const double phase = (2.0 * std::numbers::pi) * unit_of(hash_of(seed_, Stream::kTerrain, 1));
  const double phase2 = (2.0 * std::numbers::pi) * unit_of(hash_of(seed_, Stream::kTerrain, 2));
  return 0.55 * std::sin((2.0 * std::numbers::pi) * x_m / 95.0 + phase) +
         0.12 * std::sin((2.0 * std::numbers::pi) * x_m / 38.0 + phase2);
}

double Ground::height(double x_m, double y_m) const {
  const double base = road_height(x_m);
  const double off = std::abs(y_m);
  if (off < kRoadHalfWidth_m) {
    const double across = off / kRoadHalfWidth_m;
    return base + 0.06 * (1.0 - across * across);
  }
  const std::uint64_t grass = hash_of(seed_, Stream::kTerrain, 3);
  const double tufts = 0.025 * smooth_normal<2>(grass, {x_m / 0.6, y_m / 0.6});
  if (off < kVergeEnd_m) {
    const int slot = static_cast<int>(std::floor(x_m / kVergeSlot_m));
    if (is_parking(y_m > 0.0 ? 1 : -1, slot)) return base;
    return base + kKerb_m + tufts;
  }
  if (off < kSidewalkEnd_m) return base + kKerb_m;
  const double inland = std::min((off - kSidewalkEnd_m) / 4.0, 1.0);
  const double hills =
      0.22 * smooth_normal<2>(hash_of(seed_, Stream::kTerrain, 4), {x_m / 9.0, y_m / 6.0}) +
      0.08 * smooth_normal<2>(hash_of(seed_, Stream::kTerrain, 5), {x_m / 2.5, y_m / 2.5});
  return base + kKerb_m + tufts + inland * (0.15 + hills);
}

Surface Ground::surface(double x_m, double y_m) const {
  const double off = std::abs(y_m);
  if (off < kRoadHalfWidth_m) return surface_of(RawId::kRoad);
  if (off < kVergeEnd_m) {
    const int slot = static_cast<int>(std::floor(x_m / kVergeSlot_m));
    const bool bay = is_parking(y_m > 0.0 ? 1 : -1, slot);
    return surface_of(bay ? RawId::kParking : RawId::kTerrain);
  }
  return surface_of(off < kSidewalkEnd_m ? RawId::kSidewalk : RawId::kTerrain);
}

double Ground::stored_height(double x_m, double y_m) const {
  const double u = (x_m - low_x(half_length_m_)) / kCell_m;
  const double v = (y_m - kLowY) / kCell_m;
  const int column = std::clamp(static_cast<int>(std::floor(u)), 0, columns_ - 2);
  const int row = std::clamp(static_cast<int>(std::floor(v)), 0, rows_ - 2);
  const double a = std::clamp(u - column, 0.0, 1.0);
  const double b = std::clamp(v - row, 0.0, 1.0);
  const double* low = &heights_[static_cast<std::size_t>(row * columns_ + column)];
  const double* high = low + columns_;
  return (1.0 - b) * ((1.0 - a) * low[0] + a * low[1]) + b * ((1.0 - a) * high[0] + a * high[1]);
}

double Ground::gap(const Ray& ray, double t) const {
  const Eigen::Vector3d at = ray.origin + t * ray.direction;
  return at.z() - stored_height(at.x(), at.y());
}

void Ground::record(const Ray& ray, double t, Hit& nearest) const {
  if (t >= nearest.range_m) return;
  const Eigen::Vector3d at = ray.origin + t * ray.direction;
  constexpr double kReach_m = 0.12;
  const double slope_x =
      (stored_height(at.x() + kReach_m, at.y()) - stored_height(at.x() - kReach_m, at.y())) /
      (2 * kReach_m);
  const double slope_y =
      (stored_height(at.x(), at.y() + kReach_m) - stored_height(at.x(), at.y() - kReach_m)) /
      (2 * kReach_m);
  const Eigen::Vector3d normal = Eigen::Vector3d(-slope_x, -slope_y, 1.0).normalized();
  nearest = {t, std::abs(normal.dot(ray.direction)), surface(at.x(), at.y()), 0};
}

bool Ground::walk_tile(const Ray& ray, double from, double to, Hit& nearest) const {
  double before = gap(ray, from);
  if (before <= 0.0) {
    record(ray, from, nearest);
    return true;
  }
  for (double t = from; t < to;) {
    const double next = std::min(next_border(ray, t, kCell_m, low_x(half_length_m_), kLowY), to);
    const double after = gap(ray, next);
    if (after <= 0.0) {
      record(ray, t + (next - t) * before / (before - after), nearest);
      return true;
    }
    before = after;
    t = next;
  }
  return false;
}

void Ground::meet(const Ray& ray, Hit& nearest) const {
  const double left = low_x(half_length_m_);
  if (ray.direction.head<2>().norm() < 1e-9) return;  // Straight down: no scanner measures there.
  double t = 0.0;
  while (t < nearest.range_m) {
    const double x = ray.origin.x() + t * ray.direction.x() - left;
    const double y = ray.origin.y() + t * ray.direction.y() - kLowY;
    if (x < 0.0 || y < 0.0 || x >= -2.0 * left || y >= -2.0 * kLowY) return;
    const double next = next_border(ray, t, kTile_m, left, kLowY);
    const auto tile = static_cast<std::size_t>(static_cast<int>(y / kTile_m) * tile_columns_ +
                                               static_cast<int>(x / kTile_m));
    const double z = ray.origin.z() + t * ray.direction.z();
    const double z_next = ray.origin.z() + next * ray.direction.z();
    // Rays that rise above everything ahead of them never hit the ground.
    if (ray.direction.z() >= 0.0 && z > 4.0) return;
    if (std::min(z, z_next) <= crests_[tile] && walk_tile(ray, t, next, nearest)) return;
    t = next;
  }
}

}  // namespace tessera::street
