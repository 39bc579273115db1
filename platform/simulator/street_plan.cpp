// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// From the kerb outwards: parked cars and trees in the kerb strip, lamps and signs next to it, bins
// and bicycles along the garden fences, gardens, houses, and hedges at the back that close the
// view.
#include "simulator/street_plan.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "simulator/building.hpp"
#include "simulator/street_furniture.hpp"

namespace tessera::street {
namespace {

constexpr double kLot_m = 12.0;
constexpr double kFenceLine_m = kSidewalkEnd_m + 0.3;
constexpr double kBackHedge_m = kStreetHalfWidth_m - 0.6;

/// Draws one lot or slot: numbers its objects and puts them on the ground.
class Drawing {
 public:
  Drawing(std::uint64_t seed, int side, int place, const Ground& ground,
          std::vector<Primitive>& solids)
      : random(seed), side_(side), place_(place), seed_(seed), ground_(ground), solids_(solids) {}

  /// An object whose foot is `off` metres from the street's axis on this side; yaw as if on the
  /// right side.
  Assembly object(double x, double off, double yaw) {
    const double y = side_ * off;
    const double turned = side_ > 0 ? yaw + std::numbers::pi : yaw;
    return {solids_, {{x, y, ground_.height(x, y)}, turned}, next_object()};
  }
  Random fork() { return Random(random.next()); }
  [[nodiscard]] int side() const { return side_; }
  [[nodiscard]] int place() const { return place_; }
  [[nodiscard]] const Ground& ground() const { return ground_; }

  Random random;

 private:
  /// Never 0, which is the ground's.
  std::uint32_t next_object() {
    return static_cast<std::uint32_t>(hash_of(seed_, Stream::kLot, ++objects_)) | 1U;
  }

  int side_;
  int place_;
  std::uint64_t seed_;
  const Ground& ground_;
  std::vector<Primitive>& solids_;
  int objects_ = 0;
};

void plant_tree(Drawing& draw, double x, double off) {
  Assembly trunk = draw.object(x, off, 0.0);
  Assembly crown = draw.object(x, off, 0.0);
  add_tree(trunk, crown, draw.fork());
}

void plant_bush(Drawing& draw, double x, double off) {
  Assembly bush = draw.object(x, off, draw.random.uniform(0.0, std::numbers::pi));
  add_bush(bush, draw.fork());
}

/// A fence or hedge of the length along the street, in short pieces that follow the ground.
void draw_border(Drawing& draw, double x, double off, double length_m, int kind) {
  const int pieces = std::max(1, static_cast<int>(std::round(length_m / 3.0)));
  const double piece = length_m / pieces;
  const Random looks = draw.fork();
  for (int i = 0; i < pieces; ++i) {
    Assembly border = draw.object(x - 0.5 * length_m + (i + 0.5) * piece, off, 0.0);
    if (kind == 3) {
      add_hedge(border, looks, piece);
    } else {
      add_fence(border, looks, piece, static_cast<FenceKind>(kind));
    }
  }
}

/// Two pieces with a gate between them.
void draw_front_border(Drawing& draw, double x) {
  const int kind = draw.random.below(5);
  if (kind == 4) return;
  constexpr double kGate_m = 2.0;
  const double left = draw.random.uniform(3.0, 7.0);
  const double right = kLot_m - kGate_m - left;
  draw_border(draw, x - 0.5 * kLot_m + 0.5 * left, kFenceLine_m, left, kind);
  draw_border(draw, x + 0.5 * kLot_m - 0.5 * right, kFenceLine_m, right, kind);
}

void draw_park(Drawing& draw, double x) {
  if (draw.random.chance(0.5)) {
    draw_border(draw, x, kFenceLine_m, kLot_m, draw.random.below(4));
  }
  for (double off = 10.5; off < 18.5; off += 3.6) {
    plant_tree(draw, x + draw.random.uniform(-4.5, -1.0), off + draw.random.uniform(-0.8, 0.8));
    if (draw.random.chance(0.6)) plant_tree(draw, x + draw.random.uniform(1.5, 5.0), off);
    plant_bush(draw, x + draw.random.uniform(-5.0, 5.0), off + 1.5);
  }
  draw_border(draw, x, kBackHedge_m, kLot_m, 3);
}

void draw_house(Drawing& draw, double x) {
  const double style = draw.random.uniform();
  const bool flats = style < 0.3;
  const bool detached = style > 0.6;
  House house;
  house.width_m = detached ? draw.random.uniform(7.5, 9.0) : kLot_m;
  house.storeys = flats ? 3 + draw.random.below(2) : 2 + draw.random.below(detached ? 1 : 2);
  house.balconies = flats;
  const double setback = draw.random.uniform(2.2, detached ? 4.2 : 3.4);
  const double front = kSidewalkEnd_m + setback;
  house.depth_m = kStreetHalfWidth_m - front - (detached ? 2.0 : 0.0);
  Assembly walls = draw.object(x, front, 0.0);
  add_house(walls, draw.fork(), house);
  draw_front_border(draw, x);
  for (int i = draw.random.below(4); i > 0; --i) {
    plant_bush(draw, x + draw.random.uniform(-5.0, 5.0),
               kSidewalkEnd_m + draw.random.uniform(0.9, setback - 0.6));
  }
  if (!detached) return;
  const double gap = 0.5 * (kLot_m - house.width_m);
  for (const double side : {1.0, -1.0}) {
    if (draw.random.chance(0.5))
      draw_border(draw, x + side * 0.5 * (kLot_m - gap), front + 1.5, gap, 0);
  }
  if (setback > 3.2) plant_tree(draw, x + draw.random.uniform(-4.0, 4.0), kSidewalkEnd_m + 1.5);
  draw_border(draw, x, kBackHedge_m, kLot_m, 3);
}

void draw_kerb_slot(Drawing& draw, double x) {
  const double strip = 0.5 * (kRoadHalfWidth_m + kVergeEnd_m);
  if (draw.ground().is_parking(draw.side(), draw.place())) {
    if (draw.random.chance(0.48)) {
      Assembly car = draw.object(
          x + draw.random.uniform(-0.4, 0.4), strip + draw.random.uniform(-0.1, 0.12),
          draw.random.uniform(-0.03, 0.03) + (draw.random.chance(0.15) ? std::numbers::pi : 0.0));
      add_car(car, draw.fork(), RawId::kCar);
    }
  } else if (draw.random.chance(0.8)) {
    plant_tree(draw, x + draw.random.uniform(-1.2, 1.2), strip);
  }
}

void draw_sidewalk_slot(Drawing& draw, double x) {
  if ((draw.place() % 4 + 4) % 4 == (draw.side() > 0 ? 0 : 2)) {
    Assembly lamp = draw.object(x + 2.6, kVergeEnd_m + 0.3, 0.0);
    add_lamp(lamp, draw.fork());
  }
  if (draw.random.chance(0.3)) {
    const double at = x + draw.random.uniform(-2.0, 1.5);
    Assembly post = draw.object(at, kVergeEnd_m + 0.3, std::numbers::pi);
    Assembly plate = draw.object(at, kVergeEnd_m + 0.3, std::numbers::pi);
    add_sign(post, plate, draw.fork());
  }
  if (draw.random.chance(0.2)) {
    Assembly bin = draw.object(x + draw.random.uniform(-2.5, 2.5), kSidewalkEnd_m - 0.35,
                               draw.random.uniform(0.0, 0.4));
    add_bin(bin, draw.fork());
  }
  if (draw.random.chance(0.25)) {
    Assembly bicycle = draw.object(x + draw.random.uniform(-2.0, 2.0), kSidewalkEnd_m - 0.15,
                                   draw.random.uniform(-0.15, 0.15));
    add_bicycle(bicycle, draw.fork());
  }
  if (draw.random.chance(0.14)) {
    Assembly person = draw.object(x + draw.random.uniform(-2.5, 2.5), draw.random.uniform(6.6, 7.6),
                                  draw.random.uniform(0.0, 6.0));
    add_person(person, draw.fork(), RawId::kPerson, 0.3);
  }
}

}  // namespace

std::vector<Primitive> lay_out_street(std::uint64_t seed, const Ground& ground,
                                      double half_length_m) {
  std::vector<Primitive> solids;
  const auto places = [&](double step_m) { return static_cast<int>(half_length_m / step_m); };
  for (const int side : {-1, 1}) {
    for (int lot = -places(kLot_m); lot < places(kLot_m); ++lot) {
      Drawing draw(hash_of(seed, Stream::kLot, side, lot), side, lot, ground, solids);
      const double x = (lot + 0.5) * kLot_m;
      // The middle of the left side is a small park, so that every street has one within sight of
      // both robots.
      const bool park = draw.random.chance(0.14) || (side > 0 && lot == 0);
      park ? draw_park(draw, x) : draw_house(draw, x);
    }
    for (int slot = -places(kVergeSlot_m); slot < places(kVergeSlot_m); ++slot) {
      Drawing draw(hash_of(seed, Stream::kVerge, side, slot, 7), side, slot, ground, solids);
      const double x = (slot + 0.5) * kVergeSlot_m;
      draw_kerb_slot(draw, x);
      draw_sidewalk_slot(draw, x);
    }
  }
  return solids;
}

}  // namespace tessera::street
