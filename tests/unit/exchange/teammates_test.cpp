// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The table of robots that said lately where they are.
#include "tessera/exchange/teammates.hpp"

#include <catch2/catch.hpp>

#include "support/aligned_memory.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {
namespace {

struct Table {
  explicit Table(std::uint32_t most) : memory(Teammates::required_bytes(most)) {
    Arena arena = memory.arena();
    teammates = *Teammates::make(arena, most);
  }
  AlignedMemory memory;
  Teammates teammates;
};

Presence at_x(double x_m, std::int64_t stamp_ms, std::uint8_t speed) {
  Presence presence;
  presence.T_global_body(0, 3) = x_m;
  presence.box = {{-1, -0.5F, 0}, {1, 0.5F, 1.5F}};
  presence.stamp_ms = stamp_ms;
  presence.speed_m_per_s = speed;
  return presence;
}
Instant ms(std::int64_t at) { return Instant::at_us(1000 * at); }
double x_of(const Table& table, std::int64_t now_ms) {
  const Result<TeammatePlace> place = table.teammates.at(0, 0.2, ms(now_ms));
  REQUIRE(place.ok());
  return place->T_map_body(0, 3);
}

}  // namespace

TEST_CASE("Teammates: one that is not heard for a second is none, three seconds where it stands") {
  Table table(4);
  REQUIRE(table.teammates.hear(5, 1, at_x(3, 10, 2), ms(100)));
  REQUIRE(table.teammates.hear(2, 1, at_x(4, 10, 0), ms(100)));
  CHECK(table.teammates.count(ms(100)) == 2);
  CHECK(table.teammates.at(0, 0.2, ms(100))->robot == 2);
  CHECK(table.teammates.at(1, 0.2, ms(100))->robot == 5);
  CHECK(table.teammates.at(2, 0.2, ms(100)).status() == Status::kOutOfRange);
  CHECK(table.teammates.at(1, 0.2, ms(100))->until == ms(1100));
  CHECK(table.teammates.count(ms(1100)) == 2);
  CHECK(table.teammates.count(ms(1101)) == 1);
  CHECK(table.teammates.at(1, 0.2, ms(1101)).status() == Status::kOutOfRange);
  CHECK(table.teammates.count(ms(3100)) == 1);
  CHECK(table.teammates.count(ms(3101)) == 0);
  // And is one again once it is heard.
  REQUIRE(table.teammates.hear(5, 1, at_x(3, 9000, 2), ms(9000)));
  CHECK(table.teammates.count(ms(9000)) == 1);
  table.teammates.forget(5);
  CHECK(table.teammates.count(ms(9000)) == 0);
}

TEST_CASE("Teammates: stamps that run back are refused, but of another process") {
  Table table(2);
  REQUIRE(table.teammates.hear(1, 7, at_x(1, 500, 1), ms(0)));
  CHECK_FALSE(table.teammates.hear(1, 7, at_x(9, 499, 1), ms(10)));
  CHECK(x_of(table, 10) == 1.0);
  CHECK(table.teammates.all()[0].heard == ms(0));
  CHECK(table.teammates.hear(1, 7, at_x(2, 500, 1), ms(20)));
  CHECK_FALSE(table.teammates.hear(1, 7, at_x(9, 0, 1), ms(60'000)));
  CHECK(table.teammates.hear(1, 8, at_x(3, 0, 1), ms(60'000)));
  CHECK(x_of(table, 60'000) == 3.0);
}

TEST_CASE("Teammates: boxes that are none, or too large, change nothing") {
  Table table(2);
  REQUIRE(table.teammates.hear(1, 7, at_x(1, 500, 1), ms(0)));
  for (const BodyBox& box : {BodyBox{{-8, -1, 0}, {8.1F, 1, 1}},
                             {{-1, -1, 0}, {1, 1, 0}},
                             {{1, -1, 0}, {-1, 1, 1}},
                             {{0, 0, 0}, {0, 0, 0}}}) {
    Presence absurd = at_x(9, 600, 1);
    absurd.box = box;
    CHECK_FALSE(table.teammates.hear(1, 7, absurd, ms(10)));
    CHECK_FALSE(table.teammates.hear(2, 7, absurd, ms(10)));
  }
  CHECK(table.teammates.count(ms(10)) == 1);
  CHECK(x_of(table, 10) == 1.0);
}

TEST_CASE("Teammates: a full table gives the place of one that is gone, and of no other") {
  Table table(2);
  REQUIRE(table.teammates.hear(4, 1, at_x(4, 0, 0), ms(0)));
  REQUIRE(table.teammates.hear(6, 1, at_x(6, 0, 1), ms(0)));
  CHECK_FALSE(table.teammates.hear(1, 1, at_x(1, 0, 1), ms(1000)));
  CHECK(table.teammates.count(ms(1000)) == 2);
  CHECK(table.teammates.hear(1, 1, at_x(1, 0, 1), ms(1001)));
  CHECK(table.teammates.count(ms(1001)) == 2);
  CHECK(table.teammates.at(0, 0.0, ms(1001))->robot == 1);
  CHECK(table.teammates.at(1, 0.0, ms(1001))->robot == 4);
  CHECK_FALSE(table.teammates.hear(6, 1, at_x(6, 0, 1), ms(1002)));
  Table none(0);
  CHECK_FALSE(none.teammates.hear(1, 1, at_x(1, 0, 1), ms(0)));
  CHECK(none.teammates.count(ms(0)) == 0);
}

TEST_CASE("Teammates: a place is carried on by what was said, and no faster than was said") {
  Table table(2);
  Presence first = at_x(10, 1000, 5);
  first.age_ms = 40;
  REQUIRE(table.teammates.hear(1, 1, first, ms(5000)));
  CHECK(x_of(table, 5100) == 10.0);  // Of one message no velocity is known.
  REQUIRE(table.teammates.hear(1, 1, at_x(10.4, 1100, 5), ms(5100)));
  CHECK(x_of(table, 5100) == Approx(10.4));
  CHECK(x_of(table, 5300) == Approx(11.2));
  CHECK(x_of(table, 5050) == Approx(10.2));
  CHECK(table.teammates.at(0, 0.2, ms(5300))->margin_m == Approx(0.2 + 0.5 * 5 * 0.2));
  CHECK(table.teammates.at(0, 0.2, ms(6100))->margin_m == Approx(1.5));
  CHECK(table.teammates.at(0, 2.0, ms(6100))->margin_m == Approx(2.0));
  // A frame that was corrected moves it by metres at once.
  REQUIRE(table.teammates.hear(1, 1, at_x(30, 1200, 5), ms(5200)));
  CHECK(x_of(table, 5300) == Approx(30.5));
  // After a long silence nothing is known of it, and nothing while it stands.
  REQUIRE(table.teammates.hear(1, 1, at_x(40, 2701, 5), ms(6701)));
  CHECK(x_of(table, 6801) == Approx(40.0));
  REQUIRE(table.teammates.hear(1, 1, at_x(40.05, 2801, 0), ms(6801)));
  CHECK(x_of(table, 7801) == Approx(40.05));
  CHECK(table.teammates.at(0, 0.2, ms(7801))->margin_m == Approx(0.2));
}

TEST_CASE("TeammatePlace: the box is in the body's frame, with the margin on all sides") {
  TeammatePlace place;
  place.T_map_body << 0, -1, 0, 5, 1, 0, 0, 6, 0, 0, 1, 7;
  place.box = {{-1, -2, -3}, {4, 5, 6}};
  place.margin_m = 0.5;
  const PlacedBox placed = place.placed_box();
  CHECK(placed.box == BodyBox{{-1.5F, -2.5F, -3.5F}, {4.5F, 5.5F, 6.5F}});
  CHECK(norm(apply(placed.T_box_map, {5, 6, 7})) < 1e-12);
  CHECK(norm(apply(placed.T_box_map, {5, 9, 7}) - Point3d(3, 0, 0)) < 1e-12);
}

}  // namespace tessera
