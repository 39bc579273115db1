// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/frames/internal/surface_fit.hpp"

#include <cmath>

#include "tessera/base/internal/quaternion.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {

namespace {

using Surface = MapSketch::Surface;

Symmetric3 covariance_of(const Surface& surface) noexcept {
  Symmetric3 result{};
  for (std::size_t i = 0; i < 6; ++i) result[i] = static_cast<double>(surface.looseness_m2[i]);
  return result;
}

/// The surface whose mean is nearest to a point, within reach.
const Surface* nearest(const MapSketch& sketch, const Point3d& p, double reach_m) noexcept {
  const double cell_m = sketch.cell_m();
  const VoxelCoord at{floor_to_int(p.x() / cell_m), floor_to_int(p.y() / cell_m),
                      floor_to_int(p.z() / cell_m)};
  const Surface* best = nullptr;
  double least = reach_m * reach_m;
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        const Surface* const found = sketch.find_surface({at.x + x, at.y + y, at.z + z});
        if (found == nullptr) continue;
        const double square = squared_norm(Point3d(sketch.center_of(*found) - p));
        if (square >= least) continue;
        least = square;
        best = found;
      }
    }
  }
  return best;
}

/// Adds a pair. d: from a to b; M: information; arm: of b's mean from the pivot.
void add_pair(FitSums& sums, const Point3d& d, const Symmetric3& M, const Point3d& arm,
              double weight) noexcept {
  // A motion (t, w) moves b's mean by t + w x arm: J = [I, -[arm]x].
  const std::array<std::array<double, 6>, 3> J{{{1, 0, 0, 0, arm.z(), -arm.y()},
                                                {0, 1, 0, -arm.z(), 0, arm.x()},
                                                {0, 0, 1, arm.y(), -arm.x(), 0}}};
  const std::array<std::array<double, 3>, 3> full{
      {{M[0], M[1], M[2]}, {M[1], M[3], M[4]}, {M[2], M[4], M[5]}}};
  std::array<std::array<double, 6>, 3> weighted{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 6; ++j)
      weighted[i][j] =
          weight * (full[i][0] * J[0][j] + full[i][1] * J[1][j] + full[i][2] * J[2][j]);
  }
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = i; j < 6; ++j)
      sums.information[6 * i + j] +=
          J[0][i] * weighted[0][j] + J[1][i] * weighted[1][j] + J[2][i] * weighted[2][j];
    sums.right[i] -= weighted[0][i] * d.x() + weighted[1][i] * d.y() + weighted[2][i] * d.z();
  }
}

/// T after a small motion about a pivot.
Matrix34d moved(const Matrix34d& T, const Point3d& pivot, const Vector6& motion) noexcept {
  Quaternion q{1.0, motion[3] / 2.0, motion[4] / 2.0, motion[5] / 2.0};
  normalise(q);
  const Matrix34d turn = transform_of(q, Point3d::Zero());
  const Point3d held = apply(turn, pivot);
  Matrix34d step = turn;
  for (int i = 0; i < 3; ++i) step(i, 3) = pivot(i) - held(i) + motion[static_cast<std::size_t>(i)];
  const Matrix34d result = product(step, T);
  // A rotation again, to rounding.
  return transform_of(rotation_of(result), {result(0, 3), result(1, 3), result(2, 3)});
}

}  // namespace

bool are_opposite(const MapSketch::Surface& moving, const Matrix3& rotation,
                  const MapSketch::Surface& fixed) noexcept {
  const auto of = [](const std::array<std::int8_t, 3>& side, std::size_t i) {
    return static_cast<double>(side[i]);
  };
  double sum = 0.0;
  for (std::size_t i = 0; i < 3; ++i)
    sum += of(fixed.open, i) *
           (rotation[3 * i] * of(moving.open, 0) + rotation[3 * i + 1] * of(moving.open, 1) +
            rotation[3 * i + 2] * of(moving.open, 2));
  constexpr double kOpposite = -3'000.0;  // of 100 times 100
  return sum < kOpposite;
}

void SurfaceFit::begin(const MapSketch& a, const MapSketch& b, const Matrix34d& T_a_b,
                       const Point3d& pivot_a, const Round& round,
                       std::uint32_t most_surfaces) noexcept {
  a_ = &a;
  b_ = &b;
  T_a_b_ = T_a_b;
  rotation_ = rotation_rows(T_a_b);
  pivot_a_ = pivot_a;
  round_ = round;
  sums_ = {};
  TESSERA_ASSERT(most_surfaces > 0);
  stride_ = (b.surface_count() + most_surfaces - 1) / most_surfaces;
  if (stride_ == 0) stride_ = 1;
  next_ = 0;
}

bool SurfaceFit::add(std::uint32_t surfaces) noexcept {
  for (std::uint32_t n = 0; n < surfaces && next_ < b_->surface_count(); ++n, next_ += stride_)
    add_surface(b_->surface(next_));
  return next_ >= b_->surface_count();
}

void SurfaceFit::add_surface(const Surface& moving) noexcept {
  constexpr double kScale2 = 9.0;       // of the robust weight: three sigmas
  constexpr double kOtherLabel = 0.25;  // weight where labels differ
  const Point3d p = apply(T_a_b_, b_->center_of(moving));
  const Surface* const fixed = nearest(*a_, p, round_.reach_cells * a_->cell_m());
  if (fixed == nullptr || are_opposite(moving, rotation_, *fixed)) return;
  Symmetric3 C = rotated(rotation_, covariance_of(moving));
  const Symmetric3 of_fixed = covariance_of(*fixed);
  for (std::size_t k = 0; k < 6; ++k) C[k] += of_fixed[k];
  const double floor = round_.floor_m * round_.floor_m;
  C[0] += floor;
  C[3] += floor;
  C[5] += floor;
  const Symmetric3 M = inverse(C);
  const Point3d d = p - a_->center_of(*fixed);
  const Point3d pull = product(M, d);
  const double square = d.x() * pull.x() + d.y() * pull.y() + d.z() * pull.z();
  const double robust = kScale2 / (kScale2 + square);
  double weight = robust * robust;
  if (moving.label != 0 && fixed->label != 0 && moving.label != fixed->label) weight *= kOtherLabel;
  add_pair(sums_, d, M, p - pivot_a_, weight);
  ++sums_.pairs;
  sums_.weight += weight;
  sums_.squares += weight * square;
  sums_.middle_a += p;
}

bool SurfaceFit::solve() noexcept {
  if (sums_.pairs != 0) sums_.middle_a /= static_cast<double>(sums_.pairs);
  Matrix6& A = sums_.information;
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < i; ++j) A[6 * i + j] = A[6 * j + i];
  }
  // What nothing holds stays where it is.
  Matrix6 damped = A;
  for (std::size_t i = 0; i < 6; ++i) damped[7 * i] = damped[7 * i] * (1.0 + 1e-6) + 1e-3;
  Matrix6 inverse_of{};
  constexpr std::uint32_t kLeastPairs = 6;
  if (sums_.pairs < kLeastPairs || !invert(damped, inverse_of)) return false;
  T_a_b_ = moved(T_a_b_, pivot_a_, product(inverse_of, sums_.right));
  return true;
}

}  // namespace tessera
