// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Labels of cameras for a scan's points, and motion taken out of a sweep.
#include <algorithm>

#include "meter.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/registration/deskew.hpp"
#include "tessera/registration/label_projection.hpp"

namespace tessera::bench {

namespace {

constexpr int kEdge = 64;
constexpr int kPoints = kEdge * kEdge;

std::vector<OwnedMap::Line> lines_for(std::size_t bytes) {
  return std::vector<OwnedMap::Line>(bytes / sizeof(OwnedMap::Line) + 1);
}

Arena arena_of(std::vector<OwnedMap::Line>& lines) {
  return Arena(std::as_writable_bytes(std::span(lines)));
}

/// A point in every cell of a fisheye's range image, nearer to the right by so much that what
/// occludes is found at the end of the neighbourhood on one side, and on the other nothing is.
void measure_projection(Meter& meter) {
  LabelProjectionConfig config;
  config.reach_cells = LabelProjector::kMostReach;
  config.tolerance_m = 0.8F;
  config.tolerance_share = 0.0F;
  const int side_px = kEdge * config.cell_px;
  const LabelProjectionCapacity capacity{kPoints, side_px, side_px};
  std::vector<OwnedMap::Line> lines = lines_for(LabelProjector::required_bytes(capacity, config));
  Arena arena = arena_of(lines);
  LabelProjector projector = *LabelProjector::make(arena, config, capacity);
  const double middle = 0.5 * (side_px - 1);
  LabelCamera camera;
  camera.model = *CameraModel::make({CameraKind::kFisheye,
                                     side_px,
                                     side_px,
                                     80.0,
                                     80.0,
                                     middle,
                                     middle,
                                     {-0.02, 0.003, -0.0005, 0.0001, 0.0}});
  const std::vector<std::uint8_t> image(static_cast<std::size_t>(side_px * side_px), 1);
  camera.labels = image.data();
  camera.row_stride_bytes = static_cast<std::size_t>(side_px);
  const std::vector<LabelCamera> cameras(kMostCameras, camera);
  std::vector<float> points;
  for (int i = 0; i < kPoints; ++i) {
    const double column = i % kEdge * config.cell_px + 0.3;
    const double row = static_cast<double>(i / kEdge) * config.cell_px + 0.3;
    const Point3d ray = *camera.model.unproject({column, row});
    const double range_m = 20.0 - i % kEdge * (0.8 / (config.reach_cells - 0.5));
    for (int axis = 0; axis < 3; ++axis) points.push_back(static_cast<float>(range_m * ray[axis]));
  }
  std::vector<std::uint8_t> components(kPoints);
  meter.measure(
      {"project_labels", "LabelProjector::project",
       "six fisheyes see every point, and find what is nearer at the end of the neighbourhood",
       "points * cameras * (1 + 8 reach)"},
      1, [] {},
      [&] {
        const LabelReport report =
            projector.project({points.data(), 3, kPoints}, cameras, 1, components);
        const double bound =
            kPoints * static_cast<double>(kMostCameras) * (1.0 + 8.0 * LabelProjector::kMostReach);
        return Operations{static_cast<double>(report.cells_read), bound};
      });
}

void measure_deskew(Meter& meter) {
  constexpr std::size_t kPoses = 4096;
  std::vector<OwnedMap::Line> lines = lines_for(PoseTrack::required_bytes(kPoses));
  Arena arena = arena_of(lines);
  PoseTrack track = *PoseTrack::make(kPoses, arena);
  Matrix34d turn;
  turn << 0.8, -0.6, 0, 0.3, 0.6, 0.8, 0, 0.1, 0, 0, 1, 0.01;
  Matrix34d T = Matrix34d::Identity();
  for (std::size_t i = 0; i < kPoses; ++i) {
    static_cast<void>(track.add({static_cast<std::int64_t>(i) * 1000, T}));
    T = interpolate(Matrix34d::Identity(), product(turn, T), 1.0);
  }
  std::vector<float> points(3 * kPoints, 1.0F);
  std::vector<float> times_s(kPoints);
  // Out of order, so that no knot is the next one's neighbour.
  for (std::size_t i = 0; i < kPoints; ++i) times_s[i] = 0.001F * static_cast<float>(i * 37 % 101);
  DeskewConfig config;
  config.knots = DeskewConfig::kMostKnots;
  const Sweep sweep{
      .points = {points.data(), 3, kPoints}, .times_s = times_s.data(), .stamp_us = 2'000'500};
  meter.measure(
      {"deskew", "deskew", "every point at another time of the sweep, 64 knots, 4096 poses",
       "points + knots"},
      1, [&] { std::fill(points.begin(), points.end(), 1.0F); },
      [&] {
        const DeskewReport report = deskew(track, sweep, config, points);
        return Operations{static_cast<double>(report.moved) + report.knots,
                          kPoints + static_cast<double>(DeskewConfig::kMostKnots)};
      });
}

}  // namespace

void measure_registration(Meter& meter) {
  measure_projection(meter);
  measure_deskew(meter);
}

}  // namespace tessera::bench
