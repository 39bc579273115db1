// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What queries get that are wrong, too many, or mean harm.
#include <catch2/catch.hpp>
#include <limits>
#include <random>

#include "support/sample_map.hpp"
#include "unit/service/service_bench.hpp"

namespace tessera {
namespace {

TEST_CASE("QueryService: each error has its code, and leaves an empty reply") {
  const SmallMap sample = sample_map(1);
  ServiceBench bench({.local = MapReader(sample.map)});
  const auto error = [&](MapQuery query, auto change) {
    change(query);
    const MapReply reply = bench.ask(query);
    CHECK(reply.request == 5);
    CHECK(reply.count == 0);
    return reply.error;
  };
  const MapQuery points = query_of(QueryKind::kPoints);
  CHECK(error(points, [](MapQuery& q) { q.version = 2; }) == QueryError::kBadVersion);
  for (const std::int32_t kind : {-1, 4, INT32_MAX, INT32_MIN})
    CHECK(error(points, [&](MapQuery& q) { q.kind = kind; }) == QueryError::kBadKind);
  for (const std::int32_t map : {-1, 1, 2, INT32_MAX})
    CHECK(error(points, [&](MapQuery& q) { q.map = map; }) == QueryError::kNoMap);
  for (const std::int32_t count : {0, 33, -1, INT32_MIN})
    CHECK(error(points, [&](MapQuery& q) { q.count = count; }) == QueryError::kBadArgument);
  const auto with_point = [&](float x) {
    return error(points, [&](MapQuery& q) {
      q.count = 32;
      q.points[31].x() = x;
    });
  };
  CHECK(with_point(kNaN) == QueryError::kBadArgument);
  CHECK(with_point(1e9F) == QueryError::kOutOfGrid);
  for (const std::int32_t edge : {0, 3, 65, 128, -1, INT32_MIN})
    CHECK(error(box(0, 1, 1), [&](MapQuery& q) { q.cell_voxels = edge; }) ==
          QueryError::kBadArgument);
  for (const std::int32_t cursor : {-1, 1331, INT32_MAX})
    CHECK(error(box(0, 1, 1), [&](MapQuery& q) { q.cursor = cursor; }) == QueryError::kBadArgument);
  // More cells than a cursor can number.
  CHECK(error(box(-800'000.0F, 800'000.0F, 1), [](MapQuery&) {}) == QueryError::kBadArgument);
  MapQuery ray = query_of(QueryKind::kRay);
  ray.points[1] = {1, 0, 0};
  ray.length_m = 1.0;
  CHECK(error(ray, [](MapQuery& q) { q.points[1] = {0, 0, 0}; }) == QueryError::kBadArgument);
  CHECK(error(ray, [](MapQuery& q) { q.length_m = 0.0; }) == QueryError::kBadArgument);
  CHECK(error(ray, [](MapQuery& q) { q.length_m = 1e300; }) == QueryError::kOutOfGrid);
  MapQuery nearest = query_of(QueryKind::kNearest);
  CHECK(error(nearest, [](MapQuery& q) { q.length_m = -1.0; }) == QueryError::kBadArgument);
  CHECK(error(nearest, [](MapQuery& q) { q.points[0].y() = kNaN; }) == QueryError::kBadArgument);
}

TEST_CASE("QueryService: a fifth of a second's requests at once, then as many as the limit says") {
  const SmallMap sample = sample_map(1);
  QueryService service({.local = MapReader(sample.map)}, {.requests_per_s = 100});
  MapQuery query = query_of(QueryKind::kPoints);
  query.count = 1;
  const auto answered = [&](int asked, std::int64_t now_us) {
    int count = 0;
    for (int i = 0; i < asked; ++i)
      count += service.answer(query, now_us).error == QueryError::kNone ? 1 : 0;
    return count;
  };
  CHECK(answered(100, 5'000'000) == 20);
  CHECK(answered(100, 5'050'000) == 5);
  CHECK(answered(100, 9'000'000) == 20);
  CHECK(answered(100, 1'000'000) == 0);  // Time that runs back gives nothing.
  CHECK(service.report().errors[static_cast<std::size_t>(QueryError::kTooOften)] == 400 - 45);
}

TEST_CASE("QueryService: 5,000 queries of anything end, each with an answer or an error") {
  constexpr unsigned kSeed = 3;
  INFO("seed " << kSeed);
  std::mt19937 random(kSeed);
  const SmallMap sample = sample_map(1, 900, 12, 200);
  ServiceBench bench({.local = MapReader(sample.map)},
                     {.max_ray_voxels = 500, .max_nearest_work = 500});
  std::uint64_t answered = 0;
  for (int i = 0; i < 5'000; ++i) {
    const auto number = [&]() -> float {
      const float values[] = {0.0F, 0.3F, -1.7F, 1e7F, kNaN, -838'860.0F, 1e-30F, 12.0F};
      return values[random() % 8];
    };
    const auto integer = [&]() -> std::int32_t {
      const std::int32_t values[] = {0, 1, 2, 3, 8, 32, -1, INT32_MAX, INT32_MIN, 64};
      return values[random() % 10];
    };
    MapQuery query;
    query.kind = static_cast<std::int32_t>(random() % 4);
    query.count = integer();
    query.cell_voxels = integer();
    query.cursor = integer();
    query.class_mask = random();
    query.length_m = static_cast<double>(number());
    for (Point3f& point : query.points) {
      point.x() = number();
      point.y() = number();
      point.z() = number();
    }
    const MapReply reply = bench.ask(query);
    answered += reply.error == QueryError::kNone ? 1 : 0;
    REQUIRE(reply.work <= 16'384);
  }
  CHECK(answered > 50);
  CHECK(bench.service.report().errors[0] == answered);
}

}  // namespace
}  // namespace tessera
