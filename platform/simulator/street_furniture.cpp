// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Shapes are as fine as a map of 0.1 m voxels can distinguish, and no finer.
#include "simulator/street_furniture.hpp"

#include <algorithm>
#include <cmath>

namespace tessera::street {
namespace {

constexpr double kSunk_m = 0.35;  // Sunk into uneven ground, so that there is no gap on a slope.

Surface glass(RawId id) {
  Surface surface = surface_of(id);
  surface.loss = 0.65;
  surface.reflectivity = 0.08;
  return surface;
}

Surface leaves(double fill) {
  Surface surface = surface_of(RawId::kVegetation);
  surface.fill = fill;
  return surface;
}

}  // namespace

void add_car(Assembly& out, Random random, RawId id) {
  Surface paint = surface_of(id);
  paint.reflectivity = random.uniform(0.08, 0.45);
  const bool van = random.chance(0.18);
  const double length = van ? random.uniform(4.7, 5.3) : random.uniform(3.7, 4.7);
  const double half_width = van ? 0.95 : random.uniform(0.82, 0.9);
  const double half = 0.5 * length;
  const double waist = van ? 1.05 : random.uniform(0.85, 0.95);
  const double roof = van ? random.uniform(1.9, 2.2) : random.uniform(1.42, 1.55);
  constexpr double kClearance = 0.22;
  out.tapered({0, 0, kClearance}, {half, half_width}, {half - 0.08, half_width - 0.03},
              waist - kClearance, paint);
  // The cabin sits behind the bonnet; a van's and a hatchback's reaches the tail.
  const double front = van ? half - 0.75 : half - random.uniform(1.05, 1.25);
  const double back = (van || random.chance(0.5)) ? -half + 0.08 : -half + 0.65;
  const double middle = 0.5 * (front + back);
  const double cabin_half = 0.5 * (front - back);
  const double rake = van ? 0.25 : 0.45;
  out.tapered({middle, 0, waist}, {cabin_half, half_width - 0.05},
              {cabin_half - rake, half_width - 0.22}, roof - waist - 0.06, van ? paint : glass(id));
  out.box({middle - 0.05, 0, roof - 0.07}, {cabin_half - rake, half_width - 0.22}, 0.07, paint);
  for (const double x : {half - 0.85, -half + 0.8}) {
    for (const double y : {half_width - 0.1, -half_width + 0.1}) {
      out.ellipsoid({x, y, 0.31}, {0.31, 0.12, 0.31}, surface_of(id));
    }
  }
  for (const double y : {half_width + 0.08, -half_width - 0.08}) {
    out.box({front - 0.35, y, waist}, {0.07, 0.1}, 0.14, paint);
  }
}

void add_person(Assembly& out, Random random, RawId id, double stride_rad) {
  Surface cloth = surface_of(id);
  cloth.reflectivity = random.uniform(0.15, 0.6);
  const double scale = random.uniform(0.92, 1.08);
  const double swing = 0.26 * std::sin(stride_rad);
  for (const double side : {1.0, -1.0}) {
    out.ellipsoid({side * swing * 0.6, side * 0.1, 0.42 * scale},
                  {0.1 + 0.5 * std::abs(swing), 0.085, 0.45 * scale}, cloth);
    out.ellipsoid({-side * swing * 0.5, side * 0.25, 1.12 * scale}, {0.09, 0.06, 0.32 * scale},
                  cloth);
  }
  out.ellipsoid({0.0, 0.0, 1.13 * scale}, {0.16, 0.23, 0.36 * scale}, cloth);
  out.ellipsoid({0.02, 0.0, 1.6 * scale}, {0.1, 0.09, 0.13}, surface_of(id));
  if (random.chance(0.3)) out.box({-0.24, 0.0, 0.95 * scale}, {0.1, 0.16}, 0.45, cloth);
}

void add_bicycle(Assembly& out, Random random) {
  Surface metal = surface_of(RawId::kBicycle);
  Surface wheel = metal;
  wheel.fill = 0.55;  // Most of a beam passes between spokes.
  for (const double x : {0.52, -0.52}) out.ellipsoid({x, 0, 0.34}, {0.34, 0.035, 0.34}, wheel);
  out.box({0.0, 0, 0.5}, {0.42, 0.03}, 0.16, metal);
  out.box({-0.2, 0, 0.3}, {0.05, 0.04}, 0.6, metal);
  out.box({-0.24, 0, 0.9}, {0.13, 0.07}, 0.06, metal);
  out.box({0.44, 0, 0.7}, {0.03, 0.03}, 0.3, metal);
  out.box({0.4, 0, 0.98}, {0.06, 0.27}, 0.05, metal);
  if (random.chance(0.4)) out.box({0.62, 0, 0.72}, {0.16, 0.18}, 0.22, metal);
}

void add_tree(Assembly& trunk, Assembly& crown, Random random) {
  const double height = random.uniform(5.5, 9.5);
  const double clear = random.uniform(2.2, 3.1);
  const double radius = random.uniform(0.13, 0.26);
  const Surface bark = surface_of(RawId::kTrunk);
  trunk.cylinder({0, 0, -kSunk_m}, radius, clear + 0.9 + kSunk_m, bark);
  trunk.tapered({0, 0, -kSunk_m}, {radius * 1.7, radius * 1.7}, {radius * 0.7, radius * 0.7},
                0.35 + kSunk_m, bark);
  trunk.cylinder({0, 0, clear + 0.9}, 0.6 * radius, 0.45 * (height - clear), bark);
  const double spread = random.uniform(1.5, 2.5);
  const int clumps = 7 + random.below(5);
  for (int i = 0; i < clumps; ++i) {
    const double turn = random.uniform(0.0, 6.283185307179586);
    const double out_m = spread * std::sqrt(random.uniform()) * 0.75;
    const double up = random.uniform(0.0, 1.0);
    const double size = random.uniform(0.65, 1.15);
    crown.ellipsoid(
        {out_m * std::cos(turn), out_m * std::sin(turn), clear + 0.7 + up * (height - clear - 1.2)},
        {size * 1.15, size * 1.15, size * 0.8}, leaves(random.uniform(0.16, 0.3)));
  }
}

void add_bush(Assembly& out, Random random) {
  const int clumps = 2 + random.below(4);
  for (int i = 0; i < clumps; ++i) {
    const double size = random.uniform(0.3, 0.7);
    out.ellipsoid({random.uniform(-0.6, 0.6), random.uniform(-0.5, 0.5), size * 0.75},
                  {size, size, size * 0.9}, leaves(0.4));
  }
}

void add_hedge(Assembly& out, Random random, double length_m) {
  const double height = random.uniform(1.1, 1.8);
  constexpr double kPiece_m = 1.5;
  const int pieces = static_cast<int>(length_m / kPiece_m);
  for (int i = 0; i < pieces; ++i) {
    const double x = (i + 0.5) * length_m / pieces - 0.5 * length_m;
    const double top = height + random.uniform(-0.12, 0.12) + kSunk_m;
    const double half = 0.5 * length_m / pieces;
    out.tapered({x, random.uniform(-0.06, 0.06), -kSunk_m}, {half, 0.42}, {half, 0.33}, top,
                leaves(0.5));
  }
}

void add_fence(Assembly& out, Random random, double length_m, FenceKind kind) {
  const Surface wood = surface_of(RawId::kFence);
  const double height =
      kind == FenceKind::kBoards ? random.uniform(1.3, 1.8) : random.uniform(0.95, 1.25);
  constexpr double kBay_m = 2.0;
  const int bays = std::max(1, static_cast<int>(length_m / kBay_m));
  const double bay = length_m / bays;
  for (int i = 0; i <= bays; ++i) {
    out.box({i * bay - 0.5 * length_m, 0, -kSunk_m}, {0.06, 0.06}, height + 0.1 + kSunk_m, wood);
  }
  if (kind == FenceKind::kMesh) {
    Surface mesh = wood;
    mesh.fill = 0.5;
    for (int i = 0; i < bays; ++i) {
      out.box({(i + 0.5) * bay - 0.5 * length_m, 0, 0.05}, {0.5 * bay, 0.03}, height - 0.05, mesh);
    }
    out.box({0, 0, height - 0.04}, {0.5 * length_m, 0.03}, 0.05, wood);
    return;
  }
  for (const double z : {0.25, height - 0.25})
    out.box({0, -0.04, z}, {0.5 * length_m, 0.02}, 0.09, wood);
  const double pitch = kind == FenceKind::kBoards ? 0.5 : 0.22;
  const double half = kind == FenceKind::kBoards ? 0.245 : 0.05;
  const int boards = static_cast<int>(length_m / pitch);
  for (int i = 0; i < boards; ++i) {
    const double step = kind == FenceKind::kBoards && i % 2 == 1 ? 0.04 : 0.0;
    out.box({(i + 0.5) * pitch - 0.5 * length_m, step, 0.06}, {half, 0.015},
            height + random.uniform(-0.03, 0.03), wood);
  }
}

void add_lamp(Assembly& out, Random random) {
  const Surface metal = surface_of(RawId::kPole);
  const double height = random.uniform(5.2, 6.4);
  out.cylinder({0, 0, -kSunk_m}, 0.12, 0.9 + kSunk_m, metal);
  out.cylinder({0, 0, 0.9}, 0.075, height - 0.9, metal);
  out.box({0, 0.75, height}, {0.05, 0.8}, 0.08, metal);
  out.box({0, 1.5, height - 0.04}, {0.12, 0.3}, 0.14, metal);
}

void add_sign(Assembly& post, Assembly& plate, Random random) {
  const double height = random.uniform(2.2, 2.7);
  post.cylinder({0, 0, -kSunk_m}, 0.04, height + kSunk_m, surface_of(RawId::kPole));
  const bool board = random.chance(0.35);
  const double half = board ? random.uniform(0.4, 0.55) : random.uniform(0.3, 0.36);
  const double tall = board ? random.uniform(0.4, 0.55) : 2.0 * half;
  const double top = height + 0.05;
  plate.box({0.06, 0, top - tall}, {0.015, half}, tall, surface_of(RawId::kTrafficSign));
  if (random.chance(0.3)) {
    plate.box({0.06, 0, top - tall - 0.35}, {0.015, 0.3}, 0.28, surface_of(RawId::kTrafficSign));
  }
}

void add_bin(Assembly& out, Random random) {
  const Surface plastic = surface_of(RawId::kUnlabelled);
  const double height = random.uniform(0.85, 1.15);
  out.tapered({0, 0, -kSunk_m}, {0.24, 0.24}, {0.3, 0.3}, height + kSunk_m, plastic);
  out.box({0.03, 0, height}, {0.34, 0.32}, 0.06, plastic);
}

}  // namespace tessera::street
