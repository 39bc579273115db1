// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Answers queries of other processes from a separate thread: it reads while others write, and no
// thread waits for it. Each answer costs a bounded amount of work and reports it.
// docs/reference/queries.md has the protocol.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "base/arena_memory.hpp"
#include "link/query_messages.hpp"
#include "node/asked_places.hpp"
#include "tessera/base/counters.hpp"
#include "tessera/fusion/global_reader.hpp"
#include "tessera/map/map_reader.hpp"

namespace tessera {

struct QueryLimits {
  int requests_per_s = 200;       ///< 1 .. 100,000; a fifth of them may arrive at once.
  int max_ray_voxels = 8'192;     ///< 1 .. 2^20; the most that are read for one ray.
  int max_nearest_work = 16'384;  ///< 1 .. 2^24; as NearestQuery::max_work.
  int max_region_work =
      16'384;  ///< 8,192 .. 2^24, so that one cell always fits; in the same units.
};

#define TESSERA_QUERY_COUNTERS(ROW)                                                     \
  ROW(COUNTER, uint64_t, incomplete, "Answered requests that used up the work of one.") \
  ROW(COUNTER, uint64_t, work, "Work of all requests.")                                 \
  ROW(LEVEL, uint64_t, most_work, "Most work of one request.")

/// Results of requests. Each is counted in one of error[], by QueryError; [0]: answered.
struct QueryReport {
  TESSERA_QUERY_COUNTERS(TESSERA_COUNTER_MEMBER)
  std::array<std::uint64_t, 8> errors{};
};
TESSERA_COUNTER_TABLE(QueryReport, TESSERA_QUERY_COUNTERS(TESSERA_COUNTER_ROW))

/// The available maps; each may be missing, and must keep its address.
struct ServedMaps {
  std::optional<MapReader> local{};
  const GlobalMap* global = nullptr;
};

/// For one thread at a time.
class QueryService {
 public:
  /// Clamps limits to their ranges. Uses the heap: room for one block.
  QueryService(const ServedMaps& maps, const QueryLimits& limits);

  /// Answers any query, even an invalid one. now_us: monotonic, for the limit of requests. No heap;
  /// at most the work of the limits.
  [[nodiscard]] MapReply answer(const MapQuery& query, std::int64_t now_us) noexcept;

  [[nodiscard]] const QueryReport& report() const noexcept { return report_; }
  /// Of the global map, by questions that were answered.
  [[nodiscard]] const AskedPlaces& asked() const noexcept { return asked_; }

 private:
  template <class Reader>
  struct Served {
    Reader& reader;
    const LocalMap& map;  ///< For constants: lattice and prior.
  };

  [[nodiscard]] bool is_too_often(std::int64_t now_us) noexcept;
  [[nodiscard]] QueryError answer_to(const MapQuery& query, MapReply& reply) noexcept;
  template <class Reader>
  [[nodiscard]] QueryError answer_from(const Served<Reader>& from, const MapQuery& query,
                                       MapReply& reply) noexcept;
  template <class Reader>
  [[nodiscard]] QueryError points(const Served<Reader>& from, const MapQuery& query,
                                  MapReply& reply) noexcept;
  template <class Reader>
  [[nodiscard]] QueryError region(const Served<Reader>& from, const MapQuery& query,
                                  MapReply& reply) noexcept;
  template <class Reader>
  [[nodiscard]] QueryError ray(const Served<Reader>& from, const MapQuery& query,
                               MapReply& reply) noexcept;
  template <class Reader>
  [[nodiscard]] QueryError nearest(const Served<Reader>& from, const MapQuery& query,
                                   MapReply& reply) noexcept;

  const QueryLimits limits_;
  const LocalMap* global_;
  std::optional<MapReader> local_reader_;
  std::optional<GlobalReader> global_reader_;
  ArenaMemory workspace_;
  std::int64_t last_us_ = INT64_MIN;
  std::int64_t credit_us_ = 0;  ///< Requests that are allowed now, times their period.
  QueryReport report_;
  AskedPlaces asked_;
};

}  // namespace tessera
