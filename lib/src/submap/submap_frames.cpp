// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/submap/submap_frames.hpp"

#include <algorithm>
#include <cmath>

#include "tessera/base/assert.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/submap/frame_fit.hpp"

namespace tessera {

namespace {

constexpr std::size_t kNumbers = 12;

Matrix34d transform_at(std::span<const double> numbers, std::size_t index) {
  Matrix34d T;
  for (std::size_t i = 0; i < kNumbers; ++i)
    T(static_cast<int>(i / 4), static_cast<int>(i % 4)) = numbers[kNumbers * index + i];
  return T;
}

/// T_world_sensor at that time; nothing where the trajectory does not reach. Two poses are taken as
/// rigid: they were checked.
std::optional<Matrix34d> at(const CorrectedTrajectory& trajectory, std::int64_t stamp_us) {
  const std::span<const std::int64_t> stamps = trajectory.stamps_us;
  if (stamp_us < stamps.front() || stamp_us > stamps.back()) return std::nullopt;
  const auto after = static_cast<std::size_t>(
      std::lower_bound(stamps.begin(), stamps.end(), stamp_us) - stamps.begin());
  const Matrix34d to = transform_at(trajectory.T_world_sensor, after);
  if (stamps[after] == stamp_us) return to;
  const double share = static_cast<double>(stamp_us - stamps[after - 1]) /
                       static_cast<double>(stamps[after] - stamps[after - 1]);
  return interpolate(transform_at(trajectory.T_world_sensor, after - 1), to, share);
}

bool are_transforms(std::span<const double> numbers, std::size_t count) {
  if (numbers.size() != kNumbers * count) return false;
  for (std::size_t i = 0; i < count; ++i) {
    if (!encode_rigid(transform_at(numbers, i)).ok()) return false;
  }
  return true;
}

}  // namespace

Result<SubmapFrames> SubmapFrames::make(Arena& arena, std::uint32_t submaps,
                                        std::uint32_t first) noexcept {
  SubmapFrames frames;
  frames.rows_ = arena.take<Row>(submaps);
  if (frames.rows_.empty()) return Status::kResourceExhausted;
  frames.first_ = first;
  frames.count_ = 1;
  return frames;
}

/// Where there is no room, every second pose gives way: those that stay are spread evenly.
void SubmapFrames::note(std::uint32_t submap, std::int64_t stamp_us,
                        const Matrix34d& T_map_sensor) noexcept {
  if (!has(submap)) return;
  Row& row = rows_[submap - first_];
  const bool follows = row.count == 0 || stamp_us > row.poses[row.count - 1].stamp_us;
  const Result<RigidCode> code = encode_rigid(T_map_sensor);
  if (!follows || !code.ok() || row.noted++ % row.stride != 0) return;
  if (row.count == kPoses) {
    for (std::size_t i = 0; i < kPoses / 2; ++i) row.poses[i] = row.poses[2 * i];
    row.count = kPoses / 2;
    row.stride *= 2;
  }
  row.poses[row.count++] = {.stamp_us = stamp_us, .T_map_sensor = *code};
}

bool SubmapFrames::follow(const LocalMaps& maps, const std::optional<Matrix34d>& asked) noexcept {
  if (last() == maps.number()) return false;
  const bool continues = maps.before() != nullptr;
  Matrix34d T_world_map = Matrix34d::Identity();
  if (asked) {
    T_world_map = *asked;
  } else if (continues) {
    T_world_map = frame(last());
  }
  const Status begun = begin(T_world_map, asked || continues);
  TESSERA_ASSERT(begun == Status::kOk);
  return begun == Status::kOk;
}

Status SubmapFrames::begin(const Matrix34d& T_world_map, bool continues) noexcept {
  if (count_ == rows_.size() || last() == UINT32_MAX) return Status::kResourceExhausted;
  rows_[count_] = {};
  rows_[count_].continues = continues;
  rows_[count_++].T_world_map = T_world_map;
  return Status::kOk;
}

SubmapFrame SubmapFrames::saved(std::uint32_t submap) const noexcept {
  SubmapFrame saved = row(submap);
  const Result<RigidCode> code = encode_rigid(row(submap).T_world_map);
  TESSERA_ASSERT(code.ok());  // all that set it have checked this
  if (code.ok()) saved.frame = *code;
  return saved;
}

namespace {

bool is_whole(const SubmapFrame& frame) {
  if (frame.revision == 0 || frame.stride == 0 || frame.count > SubmapFrame::kPoses ||
      !decode_rigid(frame.frame).ok())
    return false;
  for (std::size_t i = 0; i < frame.count; ++i) {
    if (!decode_rigid(frame.poses[i].T_map_sensor).ok()) return false;
    if (i != 0 && frame.poses[i].stamp_us <= frame.poses[i - 1].stamp_us) return false;
  }
  return true;
}

}  // namespace

Status SubmapFrames::restore(std::span<const SubmapFrame> frames, std::uint32_t first,
                             std::uint32_t revision) noexcept {
  if (frames.empty() || frames.size() - 1 > UINT32_MAX - first ||
      !std::all_of(frames.begin(), frames.end(), is_whole))
    return Status::kInvalidArgument;
  if (frames.size() > rows_.size()) return Status::kResourceExhausted;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    rows_[i] = {};
    static_cast<SubmapFrame&>(rows_[i]) = frames[i];
    rows_[i].T_world_map = *decode_rigid(frames[i].frame);
  }
  first_ = first;
  count_ = static_cast<std::uint32_t>(frames.size());
  revision_ = revision;
  return Status::kOk;
}

Status SubmapFrames::set(std::uint32_t submap, const Matrix34d& T_world_map) noexcept {
  if (!has(submap) || !encode_rigid(T_world_map).ok()) return Status::kInvalidArgument;
  CorrectionReport report;
  move(rows_[submap - first_], T_world_map, report);
  return Status::kOk;
}

void SubmapFrames::move(Row& row, const Matrix34d& T_world_map, CorrectionReport& report) noexcept {
  if (T_world_map == row.T_world_map) return;
  Point3d middle = Point3d::Zero();
  if (row.count != 0) middle = decode_rigid(row.poses[row.count / 2].T_map_sensor)->col(3);
  const double moved_m = norm(apply(T_world_map, middle) - apply(row.T_world_map, middle));
  report.most_m = std::max(report.most_m, moved_m);
  ++report.moved;
  ++row.revision;
  row.moved = true;
  row.T_world_map = T_world_map;
}

Status SubmapFrames::check(const CorrectedTrajectory& trajectory) noexcept {
  const std::span<const std::int64_t> stamps = trajectory.stamps_us;
  const auto falls = [](std::int64_t a, std::int64_t b) { return a >= b; };
  const bool ascends = std::adjacent_find(stamps.begin(), stamps.end(), falls) == stamps.end();
  return ascends && are_transforms(trajectory.T_world_sensor, stamps.size())
             ? Status::kOk
             : Status::kInvalidArgument;
}

Status SubmapFrames::check(const CorrectedFrames& frames) noexcept {
  if (!are_transforms(frames.T_world_map, frames.submaps.size())) return Status::kInvalidArgument;
  for (Row& row : rows_.first(count_)) row.named = false;
  for (const std::uint32_t submap : frames.submaps) {
    if (!has(submap) || rows_[submap - first_].named) return Status::kInvalidArgument;
    rows_[submap - first_].named = true;
  }
  return Status::kOk;
}

void SubmapFrames::fit(Row& row, const CorrectedTrajectory& trajectory,
                       std::optional<Matrix34d>& last, Residual& residual,
                       CorrectionReport& report) noexcept {
  if (!row.continues) last.reset();
  FrameFit fit;
  const std::span<const Pose> poses(row.poses.data(), row.count);
  for (const Pose& pose : poses) {
    const std::optional<Matrix34d> corrected = at(trajectory, pose.stamp_us);
    if (!corrected) continue;
    const Matrix34d T_map_sensor = *decode_rigid(pose.T_map_sensor);
    fit.add(T_map_sensor, *corrected);
    last = product(*corrected, inverse(T_map_sensor));
  }
  const Result<Matrix34d> fitted = fit.fit();
  if (!fitted.ok() && !last) return;
  const Result<Matrix34d> rounded = round_rigid(fitted.ok() ? *fitted : *last);
  if (!rounded.ok()) return;
  for (const Pose& pose : poses) {
    const std::optional<Matrix34d> corrected = at(trajectory, pose.stamp_us);
    if (!corrected) continue;
    const Point3d p_map = decode_rigid(pose.T_map_sensor)->col(3);
    residual.squares += squared_norm(apply(*rounded, p_map) - Point3d(corrected->col(3)));
    ++residual.poses;
  }
  move(row, *rounded, report);
}

void SubmapFrames::begin_correction(std::uint32_t revision, CorrectionReport& report) noexcept {
  report.revision = revision_ = revision;
  for (Row& row : rows_.first(count_)) row.moved = false;
}

CorrectionReport SubmapFrames::correct(const CorrectedTrajectory& trajectory,
                                       std::uint32_t revision) noexcept {
  CorrectionReport report{.status = Status::kInvalidArgument, .revision = revision_};
  if (revision <= revision_ || trajectory.stamps_us.empty()) return report;
  report.status = check(trajectory);
  if (report.status != Status::kOk) return report;
  begin_correction(revision, report);
  std::optional<Matrix34d> last;
  Residual residual;
  for (Row& row : rows_.first(count_)) fit(row, trajectory, last, residual, report);
  if (residual.poses != 0)
    report.residual_m = std::sqrt(residual.squares / static_cast<double>(residual.poses));
  return report;
}

CorrectionReport SubmapFrames::correct(const CorrectedFrames& frames,
                                       std::uint32_t revision) noexcept {
  CorrectionReport report{.status = Status::kInvalidArgument, .revision = revision_};
  if (revision <= revision_ || frames.submaps.empty()) return report;
  report.status = check(frames);
  if (report.status != Status::kOk) return report;
  begin_correction(revision, report);
  for (std::size_t i = 0; i < frames.submaps.size(); ++i)
    move(rows_[frames.submaps[i] - first_], *round_rigid(transform_at(frames.T_world_map, i)),
         report);
  return report;
}

}  // namespace tessera
