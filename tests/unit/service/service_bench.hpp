// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A service of a map, and the queries to ask it.
#pragma once

#include <limits>

#include "node/query_service.hpp"

namespace tessera {

inline constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

inline MapQuery query_of(QueryKind kind, QueryMap map = QueryMap::kLocal) {
  MapQuery query;
  query.kind = static_cast<std::int32_t>(kind);
  query.map = static_cast<std::int32_t>(map);
  query.request = 5;
  query.client = 77;
  return query;
}

/// A service of a map, and time that passes fast enough for its limit.
struct ServiceBench {
  explicit ServiceBench(const ServedMaps& maps, const QueryLimits& limits = {})
      : service(maps, limits) {}
  MapReply ask(const MapQuery& query) { return service.answer(query, now_us += 1'000'000); }
  QueryError error(const MapQuery& query) { return ask(query).error; }
  QueryService service;
  std::int64_t now_us = 0;
};

inline MapQuery box(float low, float high, std::int32_t cell_voxels) {
  MapQuery query = query_of(QueryKind::kRegion);
  query.points[0] = Point3f::Constant(low);
  query.points[1] = Point3f::Constant(high);
  query.cell_voxels = cell_voxels;
  return query;
}

}  // namespace tessera
