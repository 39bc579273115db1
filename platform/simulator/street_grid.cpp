// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "simulator/street_grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace tessera::street {
namespace {

constexpr double kGridCell_m = 4.0;
constexpr double kFrontToKerb_m = 2.5;  ///< From the front to the kerb.
constexpr double kPavementHeight_m = 0.12;
constexpr double kFoot_m = -1.0;  ///< Where things that stand on the ground end.
constexpr double kFrontDepth_m = 9.0;
constexpr double kHouseLot_m = 11.0;
constexpr double kKerbSlot_m = 6.0;  ///< Of a parked car, along the kerb.

/// Along a side of a block. Sides 0 and 1 face -y and +y, 2 and 3 face -x and +x.
struct Side {
  Eigen::Vector2d begin;
  Eigen::Vector2d along;
  Eigen::Vector2d out;
  double length_m;
};

Side side_of(const Eigen::Vector2d& low, const Eigen::Vector2d& high, int side) {
  switch (side) {
    case 0:
      return {low, {1, 0}, {0, -1}, high.x() - low.x()};
    case 1:
      return {{low.x(), high.y()}, {1, 0}, {0, 1}, high.x() - low.x()};
    case 2:
      return {low, {0, 1}, {-1, 0}, high.y() - low.y()};
    default:
      return {{high.x(), low.y()}, {0, 1}, {1, 0}, high.y() - low.y()};
  }
}

/// The rectangle between two places along a side, and two distances out of it.
struct Rectangle {
  Rectangle(const Side& side, double from_m, double to_m, double in_m, double out_m) {
    const Eigen::Vector2d a = side.begin + from_m * side.along + in_m * side.out;
    const Eigen::Vector2d b = side.begin + to_m * side.along + out_m * side.out;
    low = a.cwiseMin(b);
    high = a.cwiseMax(b);
  }
  Eigen::Vector2d low;
  Eigen::Vector2d high;
};

Eigen::Vector3d at(const Eigen::Vector2d& p, double z) { return {p.x(), p.y(), z}; }

/// Where a ray enters a box that it does not begin in: the distance, or kNoHit, and the axis of the
/// face.
struct Entry {
  double range_m = kNoHit;
  int axis = 0;
};

Entry entry_of(const StreetGrid::Box& box, const Ray& ray) {
  double enter_m = -kNoHit;
  double leave_m = kNoHit;
  int entered = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double origin = ray.origin[axis];
    const double step = ray.direction[axis];
    if (step == 0.0) {
      if (origin < box.low[axis] || origin > box.high[axis]) return {};
      continue;
    }
    const double to_low_m = (box.low[axis] - origin) / step;
    const double to_high_m = (box.high[axis] - origin) / step;
    if (const double near_m = std::min(to_low_m, to_high_m); near_m > enter_m) {
      enter_m = near_m;
      entered = axis;
    }
    leave_m = std::min(leave_m, std::max(to_low_m, to_high_m));
  }
  if (enter_m <= 0.0 || enter_m >= leave_m) return {};
  return {enter_m, entered};
}

/// From a place to the surface of a box, from either side.
double to_surface_m(const StreetGrid::Box& box, const Eigen::Vector3d& p) {
  const Eigen::Vector3d below = box.low - p;
  const Eigen::Vector3d above = p - box.high;
  const Eigen::Vector3d out = below.cwiseMax(above);
  const double most = out.maxCoeff();
  return most <= 0.0 ? -most : out.cwiseMax(0.0).norm();
}

}  // namespace

StreetGrid::StreetGrid(const StreetGridConfig& config) : config_(config) {
  // One more all around: the outer streets have two sides too.
  for (int y = -1; y <= config_.blocks; ++y) {
    for (int x = -1; x <= config_.blocks; ++x) add_block(x, y);
  }
  sort_into_cells();
}

void StreetGrid::add(const Eigen::Vector3d& low, const Eigen::Vector3d& high, RawId id) {
  boxes_.push_back({low, high, surface_of(id)});
}

void StreetGrid::add_block(int x, int y) {
  Random random(hash_of(config_.seed, Stream::kLot, x, y));
  const double half_m = 0.5 * config_.street_m;
  const Eigen::Vector2d low = crossing(x, y) + Eigen::Vector2d::Constant(half_m);
  const Eigen::Vector2d high = crossing(x + 1, y + 1) - Eigen::Vector2d::Constant(half_m);
  const Eigen::Vector2d pavement = Eigen::Vector2d::Constant(kFrontToKerb_m);
  add(at(low - pavement, kFoot_m), at(high + pavement, kPavementHeight_m), RawId::kSidewalk);
  for (int side = 0; side < 4; ++side) {
    add_front(random, low, high, side);
    add_kerb_side(random, low, high, side);
  }
}

/// Houses with steps between them, and gaps through which the court is seen.
void StreetGrid::add_front(Random& random, const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                           int side) {
  const Side along = side_of(low, high, side);
  const int lots = std::max(1, static_cast<int>(along.length_m / kHouseLot_m));
  const double lot_m = along.length_m / lots;
  for (int lot = 0; lot < lots; ++lot) {
    const double set_back_m = random.uniform(0.0, 1.2);
    const double height_m = random.uniform(5.0, 12.0);
    const bool is_gap = random.chance(0.15);
    const bool has_bay = random.chance(0.4);
    const bool has_hedge = random.chance(0.5);
    const double from_m = lot * lot_m;
    if (is_gap) {
      if (!has_hedge) continue;
      const Rectangle hedge(along, from_m, from_m + lot_m, -1.0, -0.4);
      add(at(hedge.low, kFoot_m), at(hedge.high, 1.3), RawId::kVegetation);
      continue;
    }
    const Rectangle house(along, from_m, from_m + lot_m, -set_back_m - kFrontDepth_m, -set_back_m);
    add(at(house.low, kFoot_m), at(house.high, height_m), RawId::kBuilding);
    if (!has_bay) continue;
    const Rectangle bay(along, from_m + 0.3 * lot_m, from_m + 0.7 * lot_m, -set_back_m - 1.0,
                        -set_back_m + 0.6);
    add(at(bay.low, 2.6), at(bay.high, 0.8 * height_m), RawId::kBuilding);
  }
}

/// Lamps and trees on the pavement, cars along the kerb; not near the crossings.
void StreetGrid::add_kerb_side(Random& random, const Eigen::Vector2d& low,
                               const Eigen::Vector2d& high, int side) {
  const Side along = side_of(low, high, side);
  const int slots = static_cast<int>(along.length_m / kKerbSlot_m);
  const double first_m = 0.5 * (along.length_m - slots * kKerbSlot_m);
  for (int slot = 0; slot < slots; ++slot) {
    const double middle_m = first_m + (slot + 0.5) * kKerbSlot_m;
    const double length_m = random.uniform(3.8, 4.8);
    const double height_m = random.uniform(1.4, 1.9);
    const bool has_car = random.chance(0.35);
    const double what = random.uniform();
    if (has_car) {
      const Rectangle body(along, middle_m - 0.5 * length_m, middle_m + 0.5 * length_m,
                           kFrontToKerb_m + 0.3, kFrontToKerb_m + 2.0);
      add(at(body.low, 0.3), at(body.high, 0.95), RawId::kCar);
      const Rectangle cabin(along, middle_m - 0.3 * length_m, middle_m + 0.25 * length_m,
                            kFrontToKerb_m + 0.4, kFrontToKerb_m + 1.9);
      add(at(cabin.low, 0.95), at(cabin.high, height_m), RawId::kCar);
    }
    const double post_m = middle_m - 0.5 * kKerbSlot_m + 0.4;
    if (what < 0.25) {
      const Rectangle lamp(along, post_m, post_m + 0.16, kFrontToKerb_m - 0.6,
                           kFrontToKerb_m - 0.44);
      add(at(lamp.low, kFoot_m), at(lamp.high, 5.5), RawId::kPole);
    } else if (what < 0.45) {
      const Rectangle trunk(along, post_m, post_m + 0.36, kFrontToKerb_m - 0.9,
                            kFrontToKerb_m - 0.54);
      add(at(trunk.low, kFoot_m), at(trunk.high, 3.0), RawId::kTrunk);
      const Rectangle crown(along, post_m - 1.1, post_m + 1.4, kFrontToKerb_m - 1.9,
                            kFrontToKerb_m + 0.5);
      add(at(crown.low, 3.0), at(crown.high, 5.6), RawId::kVegetation);
    }
  }
}

int StreetGrid::column_of(double metres) const {
  const double column = std::floor((metres - low_m_) / kGridCell_m);
  return static_cast<int>(std::clamp(column, -1.0, static_cast<double>(cells_)));
}

void StreetGrid::sort_into_cells() {
  low_m_ = kNoHit;
  double high_m = -kNoHit;
  for (const Box& box : boxes_) {
    low_m_ = std::min({low_m_, box.low.x(), box.low.y()});
    high_m = std::max({high_m, box.high.x(), box.high.y()});
  }
  cells_ = static_cast<int>((high_m - low_m_) / kGridCell_m) + 1;
  const auto each_cell = [&](const Box& box, auto&& visit) {
    for (int y = column_of(box.low.y()); y <= column_of(box.high.y()); ++y) {
      for (int x = column_of(box.low.x()); x <= column_of(box.high.x()); ++x)
        visit(static_cast<std::size_t>(y) * static_cast<std::size_t>(cells_) +
              static_cast<std::size_t>(x));
    }
  };
  first_.assign(static_cast<std::size_t>(cells_) * static_cast<std::size_t>(cells_) + 1, 0);
  for (const Box& box : boxes_) each_cell(box, [&](std::size_t cell) { ++first_[cell + 1]; });
  for (std::size_t cell = 1; cell < first_.size(); ++cell) first_[cell] += first_[cell - 1];
  numbers_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (std::uint32_t number = 0; number < boxes_.size(); ++number)
    each_cell(boxes_[number], [&](std::size_t cell) { numbers_[next[cell]++] = number; });
}

void StreetGrid::meet(const Ray& ray, Hit& nearest) const {
  const auto record = [&](double range_m, int axis, const Surface& surface) {
    if (range_m >= nearest.range_m) return;
    nearest.range_m = range_m;
    nearest.cos_incidence = std::abs(ray.direction[axis]);
    nearest.surface = surface;
  };
  if (ray.direction.z() < 0.0 && ray.origin.z() > 0.0)
    record(-ray.origin.z() / ray.direction.z(), 2, surface_of(RawId::kRoad));
  // Cell by cell, until the next one is behind the nearest hit.
  std::array<int, 2> cell{column_of(ray.origin.x()), column_of(ray.origin.y())};
  std::array<int, 2> step{};
  std::array<double, 2> next_m{};
  std::array<double, 2> cell_m{};
  for (int axis = 0; axis < 2; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    const double direction = ray.direction[axis];
    step[i] = direction > 0.0 ? 1 : -1;
    const double border_m = low_m_ + (cell[i] + (direction > 0.0 ? 1 : 0)) * kGridCell_m;
    next_m[i] = direction == 0.0 ? kNoHit : (border_m - ray.origin[axis]) / direction;
    cell_m[i] = direction == 0.0 ? kNoHit : kGridCell_m / std::abs(direction);
  }
  while (cell[0] >= 0 && cell[1] >= 0 && cell[0] < cells_ && cell[1] < cells_) {
    const std::size_t here = static_cast<std::size_t>(cell[1]) * static_cast<std::size_t>(cells_) +
                             static_cast<std::size_t>(cell[0]);
    for (std::uint32_t i = first_[here]; i < first_[here + 1]; ++i) {
      const Box& box = boxes_[numbers_[i]];
      const Entry entry = entry_of(box, ray);
      record(entry.range_m, entry.axis, box.surface);
    }
    const std::size_t axis = next_m[0] < next_m[1] ? 0 : 1;
    if (next_m[axis] >= nearest.range_m) return;
    cell[axis] += step[axis];
    next_m[axis] += cell_m[axis];
  }
}

double StreetGrid::distance_m(const Eigen::Vector3d& p, double most_m) const {
  double least_m = std::min(most_m, std::abs(p.z()));
  const int last_y = std::min(column_of(p.y() + most_m), cells_ - 1);
  const int last_x = std::min(column_of(p.x() + most_m), cells_ - 1);
  for (int y = std::max(column_of(p.y() - most_m), 0); y <= last_y; ++y) {
    for (int x = std::max(column_of(p.x() - most_m), 0); x <= last_x; ++x) {
      const std::size_t cell = static_cast<std::size_t>(y) * static_cast<std::size_t>(cells_) +
                               static_cast<std::size_t>(x);
      for (std::uint32_t i = first_[cell]; i < first_[cell + 1]; ++i)
        least_m = std::min(least_m, to_surface_m(boxes_[numbers_[i]], p));
    }
  }
  return least_m;
}

}  // namespace tessera::street
