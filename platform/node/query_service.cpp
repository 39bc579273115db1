// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/query_service.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "node/region_cells.hpp"
#include "tessera/map/nearest_occupied.hpp"
#include "tessera/map/reader_ray.hpp"

namespace tessera {
namespace {

QueryLimits within_ranges(QueryLimits limits) {
  limits.requests_per_s = std::clamp(limits.requests_per_s, 1, 100'000);
  limits.max_ray_voxels = std::clamp(limits.max_ray_voxels, 1, 1 << 20);
  limits.max_nearest_work = std::clamp(limits.max_nearest_work, 1, 1 << 24);
  limits.max_region_work = std::clamp(limits.max_region_work, 8'192, 1 << 24);
  return limits;
}

void write_estimate(const Estimate& estimate, std::size_t at, MapReply& reply) {
  reply.cells[at] = cell_of(estimate.state, estimate.label);
  reply.probability[at] = static_cast<float>(estimate.probability);
  reply.variance[at] = static_cast<float>(estimate.variance);
}

bool is_finite(const Point3f& p) noexcept {
  return std::isfinite(p.x()) && std::isfinite(p.y()) && std::isfinite(p.z());
}

/// The largest multiple of edge, a power of two, that is not above voxel.
constexpr std::int32_t aligned(std::int32_t voxel, std::int32_t edge) noexcept {
  return voxel & ~(edge - 1);
}

/// A reply without content, for a query with an error.
MapReply reply_to(const MapQuery& query) noexcept {
  MapReply reply;
  reply.request = query.request;
  reply.client = query.client;
  reply.kind = query.kind;
  reply.map = query.map;
  return reply;
}

std::uint64_t generation_of(const MapReader&) noexcept { return 0; }
std::uint64_t generation_of(const GlobalReader& reader) noexcept { return reader.generation(); }

}  // namespace

QueryService::QueryService(const ServedMaps& maps, const QueryLimits& limits)
    : limits_(within_ranges(limits)),
      global_(maps.global == nullptr ? nullptr : &maps.global->map()),
      local_reader_(maps.local) {
  std::size_t bytes = 0;
  if (local_reader_) bytes = local_reader_->snapshot_bytes();
  if (global_ != nullptr)
    bytes = std::max(bytes, global_reader_.emplace(*maps.global).snapshot_bytes());
  workspace_ = ArenaMemory(bytes);
}

bool QueryService::is_too_often(std::int64_t now_us) noexcept {
  const std::int64_t period_us = 1'000'000 / limits_.requests_per_s;
  const std::int64_t most_us = std::max<std::int64_t>(200'000, period_us);
  const bool is_first = last_us_ == INT64_MIN;
  const std::int64_t passed_us = is_first ? most_us : std::max<std::int64_t>(now_us - last_us_, 0);
  last_us_ = now_us;
  credit_us_ = std::min(most_us, credit_us_ + std::min(passed_us, most_us));
  if (credit_us_ < period_us) return true;
  credit_us_ -= period_us;
  return false;
}

MapReply QueryService::answer(const MapQuery& query, std::int64_t now_us) noexcept {
  MapReply reply = reply_to(query);
  const QueryError error = is_too_often(now_us) ? QueryError::kTooOften : answer_to(query, reply);
  ++report_.errors[static_cast<std::size_t>(error)];
  const auto work = static_cast<std::uint64_t>(reply.work);
  report_.work += work;
  report_.most_work = std::max(report_.most_work, work);
  if (error != QueryError::kNone) {
    reply = reply_to(query);
    reply.error = error;
    return reply;
  }
  if (reply.incomplete) ++report_.incomplete;
  if (query.map == static_cast<std::int32_t>(QueryMap::kGlobal)) asked_.note(query, now_us);
  return reply;
}

QueryError QueryService::answer_to(const MapQuery& query, MapReply& reply) noexcept {
  if (query.version != kQueryVersion) return QueryError::kBadVersion;
  if (query.kind < 0 || query.kind > static_cast<std::int32_t>(QueryKind::kNearest))
    return QueryError::kBadKind;
  if (query.map == static_cast<std::int32_t>(QueryMap::kLocal) && local_reader_)
    return answer_from(Served<MapReader>{*local_reader_, local_reader_->map()}, query, reply);
  if (query.map == static_cast<std::int32_t>(QueryMap::kGlobal) && global_reader_)
    return answer_from(Served<GlobalReader>{*global_reader_, *global_}, query, reply);
  return QueryError::kNoMap;
}

template <class Reader>
QueryError QueryService::answer_from(const Served<Reader>& from, const MapQuery& query,
                                     MapReply& reply) noexcept {
  reply.resolution_m = from.map.lattice().resolution_m();
  QueryError error = QueryError::kBadKind;
  switch (static_cast<QueryKind>(query.kind)) {
    case QueryKind::kPoints:
      error = points(from, query, reply);
      break;
    case QueryKind::kRegion:
      error = region(from, query, reply);
      break;
    case QueryKind::kRay:
      error = ray(from, query, reply);
      break;
    case QueryKind::kNearest:
      error = nearest(from, query, reply);
      break;
  }
  reply.generation = generation_of(from.reader);
  return error;
}

template <class Reader>
QueryError QueryService::points(const Served<Reader>& from, const MapQuery& query,
                                MapReply& reply) noexcept {
  if (query.count < 1 || query.count > static_cast<std::int32_t>(MapQuery::kMostPoints))
    return QueryError::kBadArgument;
  const auto count = static_cast<std::size_t>(query.count);
  std::array<VoxelCoord, MapQuery::kMostPoints> voxels{};
  for (std::size_t i = 0; i < count; ++i) {
    if (!is_finite(query.points[i])) return QueryError::kBadArgument;
    const Result<VoxelCoord> voxel = from.map.lattice().voxel_of(query.points[i]);
    if (!voxel.ok()) return QueryError::kOutOfGrid;
    voxels[i] = *voxel;
  }
  reply.work = query.count;
  std::array<Estimate, MapQuery::kMostPoints> estimates{};
  if constexpr (std::is_same_v<Reader, GlobalReader>) {
    const Status status = from.reader.query(std::span(voxels).first(count), estimates);
    if (status != Status::kOk) return QueryError::kBusy;
  } else {
    for (std::size_t i = 0; i < count; ++i) {
      const Result<Estimate> estimate = from.reader.query(voxels[i]);
      if (!estimate.ok()) return QueryError::kBusy;
      estimates[i] = *estimate;
    }
  }
  for (std::size_t i = 0; i < count; ++i) write_estimate(estimates[i], i, reply);
  reply.count = query.count;
  return QueryError::kNone;
}

template <class Reader>
QueryError QueryService::region(const Served<Reader>& from, const MapQuery& query,
                                MapReply& reply) noexcept {
  const std::int32_t edge = query.cell_voxels;
  if (edge < 1 || edge > 64 || !std::has_single_bit(static_cast<unsigned>(edge)) ||
      query.cursor < 0 || !is_finite(query.points[0]) || !is_finite(query.points[1]))
    return QueryError::kBadArgument;
  const Result<VoxelCoord> a = from.map.lattice().voxel_of(query.points[0]);
  const Result<VoxelCoord> b = from.map.lattice().voxel_of(query.points[1]);
  if (!a.ok() || !b.ok()) return QueryError::kOutOfGrid;
  const auto cells = [edge](std::int32_t p, std::int32_t q) {
    return (aligned(std::max(p, q), edge) - aligned(std::min(p, q), edge)) / edge + 1;
  };
  reply.voxel = {aligned(std::min(a->x, b->x), edge), aligned(std::min(a->y, b->y), edge),
                 aligned(std::min(a->z, b->z), edge)};
  const std::int64_t size_x = cells(a->x, b->x);
  const std::int64_t size_y = cells(a->y, b->y);
  const std::int64_t size_z = cells(a->z, b->z);
  // Two factors are below 2^25 each, so their product is checked before the third.
  const bool too_many = size_x * size_y > INT32_MAX || size_x * size_y * size_z > INT32_MAX;
  if (too_many || query.cursor >= size_x * size_y * size_z) return QueryError::kBadArgument;
  const std::int64_t total = size_x * size_y * size_z;
  reply.size_cells = {static_cast<std::int32_t>(size_x), static_cast<std::int32_t>(size_y),
                      static_cast<std::int32_t>(size_z)};
  RegionCells<Reader> reader(from.reader, from.map.config().prior, edge, workspace_.span());
  std::int64_t next = query.cursor;
  for (; next < total && reply.count < static_cast<std::int32_t>(MapReply::kMostCells); ++next) {
    if (reader.work() + reader.most_work() > limits_.max_region_work) {
      reply.incomplete = true;
      break;
    }
    const auto along = [edge](std::int64_t index) {
      return static_cast<std::int32_t>(index) * edge;
    };
    const VoxelCoord low{reply.voxel.x + along(next % size_x),
                         reply.voxel.y + along(next / size_x % size_y),
                         reply.voxel.z + along(next / size_x / size_y)};
    const bool is_read = reader.read(low, reply.cells[static_cast<std::size_t>(reply.count)]);
    reply.work = reader.work();
    if (!is_read) return QueryError::kBusy;
    ++reply.count;
  }
  reply.next_cursor = next < total ? static_cast<std::int32_t>(next) : -1;
  return QueryError::kNone;
}

template <class Reader>
QueryError QueryService::ray(const Served<Reader>& from, const MapQuery& query,
                             MapReply& reply) noexcept {
  const Point3d direction = query.points[1].cast<double>();
  const bool is_ray = is_finite(query.points[0]) && is_finite(query.points[1]) &&
                      norm(direction) > 0.0 && norm(direction) < 1e30 && query.length_m > 0.0 &&
                      std::isfinite(query.length_m);
  if (!is_ray) return QueryError::kBadArgument;
  const ReaderRay ray = cast_ray(from.reader, from.map.lattice(), query.points[0], query.points[1],
                                 query.length_m, query.stop_at_unknown, limits_.max_ray_voxels);
  reply.work = ray.voxels;
  if (ray.hit.end == RayHit::End::kInvalid) return QueryError::kOutOfGrid;
  if (ray.busy) return QueryError::kBusy;
  reply.incomplete = ray.broken_off;
  reply.found = ray.hit.end == RayHit::End::kOccupied;
  reply.at_unknown = ray.hit.end == RayHit::End::kUnknown;
  reply.distance_m = reply.searched_m = static_cast<float>(ray.hit.distance_m);
  reply.voxel = ray.hit.voxel;
  write_estimate(ray.hit.estimate, 0, reply);
  return QueryError::kNone;
}

template <class Reader>
QueryError QueryService::nearest(const Served<Reader>& from, const MapQuery& query,
                                 MapReply& reply) noexcept {
  if (!is_finite(query.points[0])) return QueryError::kBadArgument;
  const NearestQuery asked{.p_map = query.points[0],
                           .radius_m = query.length_m,
                           .classes = query.class_mask,
                           .max_work = limits_.max_nearest_work};
  const Result<NearestOccupied> found = nearest_occupied(
      from.reader, from.map.lattice(), from.map.reading(), asked, workspace_.span());
  if (!found.ok()) {
    return found.status() == Status::kOutOfRange ? QueryError::kOutOfGrid
                                                 : QueryError::kBadArgument;
  }
  reply.work = found->work;
  if (found->busy) return QueryError::kBusy;
  reply.incomplete = !found->complete;
  reply.found = found->found;
  reply.voxel = found->voxel;
  reply.distance_m = static_cast<float>(found->distance_m);
  reply.searched_m = static_cast<float>(found->searched_m);
  write_estimate(found->estimate, 0, reply);
  return QueryError::kNone;
}

}  // namespace tessera
