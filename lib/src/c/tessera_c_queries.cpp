// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The C interface: asking the maps.
#include "tessera/fusion/global_reader.hpp"
#include "tessera/map/cast_ray.hpp"
#include "tessera/map/nearest_occupied.hpp"
#include "tessera_c.hpp"

using namespace tessera;
using namespace tessera::c_interface;

namespace {

/// In a tessera_reader.
struct Reader {
  static constexpr std::uint64_t kMagic = 0x74657373'72656164U;
  std::uint64_t magic = kMagic;
  MapReader local;
  GlobalReader global;
};
static_assert(sizeof(Reader) <= sizeof(tessera_reader));
static_assert(alignof(tessera_reader) % alignof(Reader) == 0);

/// The probability of each component at p. Fails as the reader.
template <class AnyReader>
Status read_probabilities(AnyReader& reader, const Point3f& p, std::span<double> into) noexcept {
  const Result<VoxelEvidence> evidence = reader.evidence(p);
  if (!evidence.ok()) return evidence.status();
  summary_of(*evidence).distribution(reader.map().reading(), into);
  return Status::kOk;
}

Estimate query_global(const GlobalMap& global, const Point3f& p) noexcept {
  const Result<VoxelCoord> voxel = global.map().lattice().voxel_of(p);
  return voxel.ok() ? global.query(*voxel) : global.map().query(p);
}

}  // namespace

extern "C" {

tessera_status tessera_query(const tessera_robot* robot, uint32_t map, const float* p,
                             tessera_estimate* estimate) {
  return tessera_query_many(robot, map, p, 1, estimate);
}

tessera_status tessera_query_many(const tessera_robot* robot, uint32_t map, const float* points,
                                  uint32_t count, tessera_estimate* estimates) {
  if (!is_robot(robot) || !is_map(map) ||
      (count != 0 && (points == nullptr || estimates == nullptr)))
    return TESSERA_INVALID_ARGUMENT;
  const Robot& core = *robot->robot;
  if (map == TESSERA_GLOBAL_MAP) {
    for (std::size_t i = 0; i < count; ++i)
      estimates[i] = estimate_of(query_global(core.global(), point_of(points + 3 * i)));
    return TESSERA_OK;
  }
  std::array<Point3f, LocalMap::kQueryGroup> group;
  std::array<Estimate, LocalMap::kQueryGroup> found{};
  for (std::size_t first = 0; first < count; first += group.size()) {
    const std::size_t n = count - first < group.size() ? count - first : group.size();
    for (std::size_t i = 0; i < n; ++i) group[i] = point_of(points + 3 * (first + i));
    static_cast<void>(
        core.map().query(std::span<const Point3f>(group).first(n), std::span(found).first(n)));
    for (std::size_t i = 0; i < n; ++i) estimates[first + i] = estimate_of(found[i]);
  }
  return TESSERA_OK;
}

tessera_status tessera_cast_ray(const tessera_robot* robot, uint32_t map, const float* origin,
                                const float* direction, double max_range_m, int32_t stop_at_unknown,
                                tessera_ray_hit* hit) {
  if (!is_robot(robot) || !is_map(map) || origin == nullptr || direction == nullptr ||
      hit == nullptr)
    return TESSERA_INVALID_ARGUMENT;
  if (!is_settled(*robot, map)) return TESSERA_BUSY;
  const RayHit found = cast_ray(map_of(*robot, map), point_of(origin), point_of(direction),
                                max_range_m, stop_at_unknown != 0);
  *hit = {.distance_m = found.distance_m,
          .x = found.voxel.x,
          .y = found.voxel.y,
          .z = found.voxel.z,
          .end = static_cast<std::uint32_t>(found.end),
          .estimate = estimate_of(found.estimate)};
  return TESSERA_OK;
}

tessera_status tessera_nearest_occupied(const tessera_robot* robot, uint32_t map, const float* p,
                                        double radius_m, uint32_t max_work,
                                        tessera_nearest* nearest) {
  if (!is_robot(robot) || !is_map(map) || p == nullptr || nearest == nullptr || max_work < 1 ||
      max_work > NearestQuery::kMostWork)
    return TESSERA_INVALID_ARGUMENT;
  if (!is_settled(*robot, map)) return TESSERA_BUSY;
  const LocalMap& of = map_of(*robot, map);
  MapReader reader(of);
  const NearestQuery query{
      .p_map = point_of(p), .radius_m = radius_m, .max_work = static_cast<int>(max_work)};
  const Result<NearestOccupied> found = nearest_occupied(reader, of.lattice(), of.reading(), query,
                                                         std::as_writable_bytes(robot->workspace));
  if (!found.ok()) return status_of(found.status());
  *nearest = {.distance_m = found->distance_m,
              .x = found->voxel.x,
              .y = found->voxel.y,
              .z = found->voxel.z,
              .found = found->found ? 1U : 0U,
              .estimate = estimate_of(found->estimate),
              .searched_m = found->searched_m,
              .complete = found->complete ? 1U : 0U,
              .reserved = 0};
  return TESSERA_OK;
}

tessera_status tessera_reader_make(const tessera_robot* robot, tessera_reader* reader) {
  if (!is_robot(robot) || reader == nullptr) return TESSERA_INVALID_ARGUMENT;
  const Robot& core = *robot->robot;
  ::new (static_cast<void*>(reader))
      Reader{.local = MapReader(core.maps()), .global = GlobalReader(core.global())};
  return TESSERA_OK;
}

tessera_status tessera_reader_query(tessera_reader* reader, uint32_t map, const float* p,
                                    tessera_estimate* estimate) {
  if (reader == nullptr || reader->opaque[0] != Reader::kMagic || !is_map(map) || p == nullptr ||
      estimate == nullptr)
    return TESSERA_INVALID_ARGUMENT;
  auto& of = *reinterpret_cast<Reader*>(reader);
  const Result<Estimate> found =
      map == TESSERA_LOCAL_MAP ? of.local.query(point_of(p)) : of.global.query(point_of(p));
  if (!found.ok()) return status_of(found.status());
  *estimate = estimate_of(*found);
  return TESSERA_OK;
}

tessera_status tessera_reader_probabilities(tessera_reader* reader, uint32_t map, const float* p,
                                            double* probabilities, uint32_t count) {
  if (reader == nullptr || reader->opaque[0] != Reader::kMagic || !is_map(map) || p == nullptr ||
      probabilities == nullptr)
    return TESSERA_INVALID_ARGUMENT;
  auto& of = *reinterpret_cast<Reader*>(reader);
  const int components = of.local.map().num_components();
  if (count < static_cast<std::uint32_t>(components)) return TESSERA_INVALID_ARGUMENT;
  const std::span into(probabilities, static_cast<std::size_t>(components));
  return status_of(map == TESSERA_LOCAL_MAP ? read_probabilities(of.local, point_of(p), into)
                                            : read_probabilities(of.global, point_of(p), into));
}

}  // extern "C"
