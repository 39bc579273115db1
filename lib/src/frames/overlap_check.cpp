// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/frames/internal/overlap_check.hpp"

#include <bit>

#include "tessera/base/rigid.hpp"
#include "tessera/frames/internal/surface_fit.hpp"

namespace tessera {

namespace {

constexpr int kPartsEdge = MapSketch::kPartsEdge;

/// Looks up parts of a sketch; those of one cell one after the other cost one look-up.
class PartReader {
 public:
  explicit PartReader(const MapSketch& sketch) noexcept : sketch_(sketch) {}

  enum class State : std::uint8_t { kUnknown, kFree, kOccupied };
  /// Of the cell that was looked up last; null: it has none.
  [[nodiscard]] const MapSketch::Surface* surface() const noexcept { return parts_.surface; }
  [[nodiscard]] State state(VoxelCoord part) noexcept {
    const VoxelCoord cell{part.x >> 2, part.y >> 2, part.z >> 2};
    if (!(cell == cell_) || !any_) {
      cell_ = cell;
      any_ = true;
      parts_ = sketch_.parts(cell);
    }
    const std::uint64_t bit =
        std::uint64_t{1} << static_cast<unsigned>(
            (part.x & 3) + kPartsEdge * ((part.y & 3) + kPartsEdge * (part.z & 3)));
    if ((parts_.occupied & bit) != 0) return State::kOccupied;
    return (parts_.free & bit) != 0 ? State::kFree : State::kUnknown;
  }

 private:
  const MapSketch& sketch_;
  VoxelCoord cell_{};
  MapSketch::Parts parts_{};
  bool any_ = false;
};

/// Whether a part that is known, or one beside it, is occupied.
PartReader::State state_about(PartReader& reader, VoxelCoord part) noexcept {
  const PartReader::State here = reader.state(part);
  if (here == PartReader::State::kOccupied) return here;
  for (const BlockCoord& step : kFaceSteps) {
    const VoxelCoord beside{part.x + step.x, part.y + step.y, part.z + step.z};
    if (reader.state(beside) == PartReader::State::kOccupied) return PartReader::State::kOccupied;
  }
  return here;
}

/// A turn and shift, and the turn alone.
struct Motion {
  explicit Motion(const Matrix34d& of) noexcept : transform(of), rotation(rotation_rows(of)) {}
  Matrix34d transform;
  Matrix3 rotation;
};

void count_surface(const MapSketch& from, const MapSketch::Surface& surface, const Motion& motion,
                   const MapSketch& to, PartReader& reader, Agreement& sums) noexcept {
  const Matrix34d& T = motion.transform;
  const VoxelCoord cell = MapSketch::cell_of(surface.key);
  const double part_m = from.part_m();
  constexpr int kOneIn = 4;
  int place = static_cast<int>(surface.key & 3U);
  for (std::uint64_t rest = surface.occupied; rest != 0; rest &= rest - 1) {
    if (place++ % kOneIn != 0) continue;
    const int bit = std::countr_zero(rest);
    const int y = bit / kPartsEdge % kPartsEdge;
    const int z = bit / (kPartsEdge * kPartsEdge);
    const Point3d center{(cell.x * kPartsEdge + bit % kPartsEdge + 0.5) * part_m,
                         (cell.y * kPartsEdge + y + 0.5) * part_m,
                         (cell.z * kPartsEdge + z + 0.5) * part_m};
    const Point3d p = apply(T, center);
    const double to_m = to.part_m();
    const PartReader::State state = state_about(
        reader,
        {floor_to_int(p.x() / to_m), floor_to_int(p.y() / to_m), floor_to_int(p.z() / to_m)});
    const bool is_flat = surface.kind == MapSketch::Kind::kFlat;
    const bool is_occupied = state == PartReader::State::kOccupied;
    const bool is_other_side =
        is_occupied && !is_flat && are_opposite(surface, motion.rotation, *reader.surface());
    if (is_occupied && !is_other_side) {
      ++(is_flat ? sums.flat_agreed : sums.agreed);
    } else if (state == PartReader::State::kFree) {
      ++(is_flat ? sums.flat_contradicted : sums.contradicted);
    } else if (!is_flat) {
      ++sums.unseen;
    }
  }
  if (surface.label == 0) return;
  const Point3d p = apply(T, from.center_of(surface));
  const MapSketch::Surface* const other =
      to.find_surface({floor_to_int(p.x() / to.cell_m()), floor_to_int(p.y() / to.cell_m()),
                       floor_to_int(p.z() / to.cell_m())});
  if (other == nullptr || other->label == 0) return;
  ++sums.labelled;
  sums.same_label += other->label == surface.label ? 1U : 0U;
}

}  // namespace

void OverlapCheck::begin(const MapSketch& a, const MapSketch& b, const Matrix34d& T_a_b,
                         std::uint32_t most_surfaces) noexcept {
  a_ = &a;
  b_ = &b;
  T_a_b_ = T_a_b;
  T_b_a_ = inverse(T_a_b);
  sums_ = {};
  most_surfaces_ = most_surfaces;
  next_ = 0;
  is_second_ = false;
}

bool OverlapCheck::count(std::uint32_t surfaces) noexcept {
  for (std::uint32_t n = 0; n < surfaces;) {
    const MapSketch& from = is_second_ ? *a_ : *b_;
    const MapSketch& to = is_second_ ? *b_ : *a_;
    if (next_ >= from.surface_count()) {
      if (is_second_) return true;
      is_second_ = true;
      next_ = 0;
      continue;
    }
    PartReader reader(to);
    const Motion motion(is_second_ ? T_b_a_ : T_a_b_);
    const std::uint32_t stride = (from.surface_count() + most_surfaces_ - 1) / most_surfaces_;
    for (; n < surfaces && next_ < from.surface_count(); ++n, next_ += stride)
      count_surface(from, from.surface(next_), motion, to, reader, sums_);
  }
  return false;
}

Agreement check_overlap(const MapSketch& a, const MapSketch& b, const Matrix34d& T_a_b,
                        std::uint32_t most_surfaces) noexcept {
  OverlapCheck check;
  check.begin(a, b, T_a_b, most_surfaces);
  while (!check.count(most_surfaces)) continue;
  return check.agreement();
}

}  // namespace tessera
