// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The steps of a search for the frame between two maps, with sketches that are full.
#include "meter.hpp"
#include "tessera/frames/internal/place_fit.hpp"
#include "tessera/frames/internal/yaw_search.hpp"
#include "tessera/frames/team_frames.hpp"

namespace tessera::bench {

namespace {

constexpr double kResolution_m = 0.2;
/// Eight cells each.
constexpr int kBlocks = MapSketch::kMostSurfaces / 8;
constexpr int kBlocksRow = 32;

BlockCoord block_of_number(int n, int row) { return {n % row, n / row % row, n / (row * row)}; }

/// A map whose blocks are full of labels, or of free space.
OwnedMap full_map(bool is_free, int blocks, int row = kBlocksRow) {
  MapConfig config = config_of(TuplePolicy::kCompact, 400);
  config.resolution_m = kResolution_m;
  OwnedMap owned(config, 2);
  for (int n = 0; n < blocks; ++n) {
    const SlabHandle handle = *owned.map.open_block(block_of_number(n, row));
    VoxelMask all{};
    for (std::uint64_t& slice : all) slice = ~std::uint64_t{0};
    if (is_free) static_cast<void>(owned.map.add_free_pass(handle, all));
    const OctetEvidence each = everything(owned.map, 1.0F);
    for (int octet = 0; !is_free && octet < kBlockOctets; ++octet)
      static_cast<void>(owned.map.add_labels(handle, octet, each));
  }
  return owned;
}

void take_all(const LocalMap& map, MapSketch& sketch, std::span<KeyedIndex> scratch) {
  sketch.begin(kResolution_m);
  SweepCursor cursor;
  map.visit_blocks(cursor, map.index().slots(), [&](BlockKey, SlabHandle handle) {
    sketch.add(map, handle);
    return true;
  });
  sketch.finish(scratch);
}

/// Of the first robots a link from each to each; the last one lies.
std::vector<FrameLink> links_of(std::uint32_t robots) {
  std::vector<FrameLink> links;
  for (std::uint32_t from = 0; from < robots; ++from) {
    for (std::uint32_t to = 0; to < robots; ++to) {
      if (from == to) continue;
      FrameLink link;
      link.from = from;
      link.to = to;
      link.revision = 1;
      link.T_from_to(0, 3) = 10.0 * (static_cast<double>(to) - from);
      link.T_from_to(1, 3) = from + 1 == robots ? 1.0 + to : 0.0;
      link.covariance = FrameCovariance::isotropic(Point3d::Zero(), 0.02, 0.001);
      links.push_back(link);
    }
  }
  return links;
}

void measure_team(Meter& meter) {
  constexpr std::uint32_t kRobots = 16;
  const std::vector<FrameLink> links = links_of(kRobots);
  const auto count = static_cast<std::uint32_t>(links.size());
  std::vector<OwnedMap::Line> lines(
      TeamFrames::required_bytes(kRobots, count) / sizeof(OwnedMap::Line) + 1);
  Arena arena(std::as_writable_bytes(std::span(lines)));
  TeamFrames team = *TeamFrames::make(arena, kRobots, count);
  std::vector<FrameMember> members;
  for (std::uint32_t robot = 0; robot < kRobots; ++robot) members.push_back({robot, 0});
  meter.measure(
      {"solve_team", "TeamFrames::solve",
       "16 robots, a link from each to each, and one of them lies", "links"},
      1, [] {},
      [&] {
        const Result<TeamSolution> solution = team.solve(links, {}, members);
        return fixed(solution.ok(), count);
      });
}

}  // namespace

void measure_frames(Meter& meter) {
  measure_team(meter);
  constexpr std::size_t kBytes = 2 * MapSketch::required_bytes() + Columns::required_bytes() +
                                 YawSearch::required_bytes() +
                                 arena_bytes<KeyedIndex>(MapSketch::kScratch);
  std::vector<OwnedMap::Line> lines(kBytes / sizeof(OwnedMap::Line));
  Arena arena(std::as_writable_bytes(std::span(lines)));
  MapSketch full = *MapSketch::make(arena);
  MapSketch free = *MapSketch::make(arena);
  Columns columns = *Columns::make(arena);
  YawSearch search = *YawSearch::make(arena);
  const std::span<KeyedIndex> scratch = arena.take<KeyedIndex>(MapSketch::kScratch);
  const OwnedMap labelled = full_map(false, kBlocks);
  const OwnedMap seen = full_map(true, kBlocks);
  const SlabHandle first = labelled.map.find_handle({0, 0, 0});

  meter.measure(
      {"sketch_block", "MapSketch::add", "a block whose voxels all have labels", "512 voxels"}, 1,
      [&] { full.begin(kResolution_m); },
      [&] {
        full.add(labelled.map, first);
        return fixed(full.surface_count() == 8, kBlockVoxels);
      });
  take_all(labelled.map, full, scratch);
  meter.measure(
      {"sketch_finish", "MapSketch::finish", "as many surfaces as there is room for", "surfaces"},
      1,
      [&] {  // one block anew, so that it is not finished
        constexpr MapSketch::BlockCells kSurfaces = 0x5555;
        full.forget(*pack({0, 0, 0}), kSurfaces);
        full.drop_forgotten();
        full.add(labelled.map, first);
      },
      [&] {
        full.finish(scratch);
        return fixed(full.surface_count() == MapSketch::kMostSurfaces, MapSketch::kMostSurfaces);
      });
  take_all(seen.map, free, scratch);
  const Level level = level_of(full);
  meter.measure(
      {"draw_columns", "Columns::draw", "a sketch that is full", "columns + surfaces"}, 1, [] {},
      [&] {
        columns.draw(full, level);
        constexpr double kColumns = double{Columns::kEdge} * Columns::kEdge;
        return fixed(true, kColumns + MapSketch::kMostSurfaces);
      });
  // A square of low things: a feature a column.
  const OwnedMap square = full_map(false, 16 * 16, 16);
  take_all(square.map, free, scratch);
  columns.draw(free, level_of(free));
  search.take_moved(columns);
  search.take_fixed(columns, 1'000.0);
  take_all(seen.map, free, scratch);
  meter.measure(
      {"try_heading", "YawSearch::try_heading",
       "as many columns that stand, and shifts, as there may be", "features shifts"},
      1, [] {},
      [&] {
        search.try_heading({1.0, 0.0, 0.0, 0.0, 0, 0});
        const auto features = static_cast<double>(search.feature_count());
        return Operations{
            features * YawSearch::kMostShifts * YawSearch::kMostShifts,
            double{YawSearch::kMostFeatures} * YawSearch::kMostShifts * YawSearch::kMostShifts};
      });
  PlaceFit fit;
  constexpr SurfaceFit::Round kRound{1.5, 0.05};
  meter.measure(
      {"fit_step", "PlaceFit::step", "surfaces all around each surface", "27 surfaces"}, 1,
      [&] {
        fit.begin(full, full, Matrix34d(Matrix34d::Identity()), Point3d::Zero(),
                  {std::span(&kRound, 1), MapSketch::kMostSurfaces, 1});
      },
      [&] { return fixed(!fit.step(), 27.0 * PlaceFit::kStepFitted); });
  meter.measure(
      {"check_step", "PlaceFit::step",
       "surfaces with all parts occupied, in the free space of the other map", "112 surfaces"},
      1,
      [&] {
        fit.begin(free, full, Matrix34d(Matrix34d::Identity()), Point3d::Zero(),
                  {{}, 1, MapSketch::kMostSurfaces});
      },
      [&] { return fixed(!fit.step(), 112.0 * PlaceFit::kStepChecked); });
}

}  // namespace tessera::bench
