// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/asked_places.hpp"

#include <catch2/catch.hpp>
#include <limits>

namespace tessera {
namespace {

constexpr std::int64_t kAskedSecond = 1'000'000;

MapQuery query_of(QueryKind kind, const Point3f& first, const Point3f& second = Point3f::Zero()) {
  MapQuery query;
  query.kind = static_cast<std::int32_t>(kind);
  query.map = static_cast<std::int32_t>(QueryMap::kGlobal);
  query.points[0] = first;
  query.points[1] = second;
  query.length_m = 30.0;
  return query;
}

TEST_CASE("AskedPlaces: each kind of question is about a place") {
  AskedPlaces asked;
  asked.note(query_of(QueryKind::kPoints, {100, 0, 0}), 0);
  asked.note(query_of(QueryKind::kRegion, {0, 200, 0}, {40, 240, 10}), 0);
  asked.note(query_of(QueryKind::kNearest, {0, 0, 300}), 0);
  asked.note(query_of(QueryKind::kRay, {-100, 0, 0}, {-2, 0, 0}), 0);
  REQUIRE(asked.count == 5);
  CHECK(asked.points()[0] == Point3d(100, 0, 0));
  CHECK(asked.points()[1] == Point3d(20, 220, 5));
  CHECK(asked.points()[2] == Point3d(0, 0, 300));
  CHECK(asked.points()[3] == Point3d(-100, 0, 0));
  CHECK(asked.points()[4] == Point3d(-130, 0, 0));
}

TEST_CASE("AskedPlaces: places near each other are one, and what was asked long ago is forgotten") {
  AskedPlaces asked;
  asked.note(query_of(QueryKind::kPoints, {0, 0, 0}), 0);
  asked.note(query_of(QueryKind::kPoints, {3, 0, 0}), 30 * kAskedSecond);
  asked.note(query_of(QueryKind::kPoints, {50, 0, 0}), 40 * kAskedSecond);
  CHECK(asked.count == 2);
  CHECK_FALSE(asked.forget_old(90 * kAskedSecond));
  CHECK(asked.forget_old(91 * kAskedSecond));
  REQUIRE(asked.count == 1);
  CHECK(asked.points()[0] == Point3d(50, 0, 0));
}

TEST_CASE("AskedPlaces: of more than there is room for the latest are kept") {
  AskedPlaces asked;
  for (int i = 0; i < 40; ++i)
    asked.note(query_of(QueryKind::kPoints, {100.0F * static_cast<float>(i), 0, 0}), i);
  REQUIRE(asked.count == Sharer::kMostRoute);
  for (std::uint32_t i = 0; i < asked.count; ++i)
    CHECK(asked.points()[i].x() >= 100.0 * (40.0 - static_cast<double>(Sharer::kMostRoute)));
}

TEST_CASE("AskedPlaces: a place that is none is left out") {
  AskedPlaces asked;
  asked.note(query_of(QueryKind::kPoints, {std::numeric_limits<float>::quiet_NaN(), 0, 0}), 0);
  asked.note(query_of(QueryKind::kNearest, {std::numeric_limits<float>::infinity(), 0, 0}), 0);
  // A ray without a direction is about its begin.
  asked.note(query_of(QueryKind::kRay, {5, 0, 0}, {0, 0, 0}), 0);
  CHECK(asked.count == 1);
}

}  // namespace
}  // namespace tessera
