// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Answers what other processes ask the maps, from a thread of its own: it reads while others write,
// and nobody waits for it. Each answer costs a bounded amount of work and says how much.
// docs/queries.md has the protocol.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "lcm/query_messages.hpp"
#include "tessera/fusion/global_reader.hpp"
#include "tessera/map/map_reader.hpp"

namespace tessera {

struct QueryLimits {
  int requests_per_s = 200;       ///< 1 .. 100,000; a fifth of them may come at once.
  int max_ray_voxels = 8'192;     ///< 1 .. 2^20; more are not read for one ray.
  int max_nearest_work = 16'384;  ///< 1 .. 2^24; as NearestQuery::max_work.
  int max_region_work =
      16'384;  ///< 8,192 .. 2^24, so that one cell always fits; in the same units.
};

/// How requests ended. Each is in one of error[], as QueryError numbers them; [0]: answered.
struct QueryReport {
  std::array<std::uint64_t, 8> errors{};
  std::uint64_t incomplete = 0;  ///< Of those answered: the work of one request was used up.
  std::uint64_t work = 0;        ///< Of all.
  std::uint64_t most_work = 0;   ///< Of one.
};

/// The maps that there are; each may be missing, and must stay where it is.
struct ServedMaps {
  const LocalMap* local = nullptr;
  const GlobalMap* global = nullptr;
};

/// Not for several threads at once.
class QueryService {
 public:
  /// Limits outside their ranges are moved to the nearest end of them. Uses the heap: room for one
  /// block.
  QueryService(const ServedMaps& maps, const QueryLimits& limits);

  /// Answers a query from anybody. now_us: monotonic, for the limit of requests. No heap; the work
  /// of the limits at most.
  [[nodiscard]] MapReply answer(const MapQuery& query, std::int64_t now_us) noexcept;

  [[nodiscard]] const QueryReport& report() const noexcept { return report_; }

 private:
  template <class Reader>
  struct Served {
    Reader& reader;
    const LocalMap& map;  ///< For what never changes: lattice and prior.
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
  const LocalMap* local_;
  const LocalMap* global_;
  std::optional<MapReader> local_reader_;
  std::optional<GlobalReader> global_reader_;
  struct alignas(8) Word {
    std::byte bytes[8];
  };
  std::size_t workspace_words_ = 0;
  std::unique_ptr<Word[]> workspace_;
  std::int64_t last_us_ = INT64_MIN;
  std::int64_t credit_us_ = 0;  ///< Requests that may come now, times their period.
  QueryReport report_;
};

}  // namespace tessera
