// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "teammates.hpp"

#include <pybind11/stl.h>

#include <algorithm>
#include <array>

#include "arrays.hpp"
#include "base/monotonic_clock.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera::python {

namespace {

using Corner = std::array<double, 3>;

py::array_t<double> rows_of(const Matrix34d& T) {
  py::array_t<double> array({3, 4});
  std::copy_n(T.data(), 12, array.mutable_data());
  return array;
}

Corner corner_of(const std::array<float, 3>& corner) {
  return {static_cast<double>(corner[0]), static_cast<double>(corner[1]),
          static_cast<double>(corner[2])};
}

py::list teammates(const HeldSharer& held, std::optional<std::int64_t> now_us) {
  const std::int64_t at_us = now_us.value_or(MonotonicClock::now_us());
  Matrix34d T_map_global;
  std::vector<TeammatePlace> places;
  held.change([&](Sharer& sharer) {
    T_map_global = sharer.map_from_global(sharer.frames().last());
    for (std::size_t i = 0;; ++i) {
      const Result<TeammatePlace> place = sharer.teammate_at(i, at_us);
      if (!place.ok()) return;
      places.push_back(*place);
    }
  });
  py::list list;
  for (const TeammatePlace& place : places) {
    py::dict one;
    one["robot"] = place.robot;
    one["T_global_body"] = rows_of(place.T_map_body);
    one["T_map_body"] = rows_of(product(T_map_global, place.T_map_body));
    one["low"] = corner_of(place.box.low);
    one["high"] = corner_of(place.box.high);
    one["velocity"] = Corner{place.velocity.x(), place.velocity.y(), place.velocity.z()};
    one["margin_m"] = place.margin_m;
    one["speed_m_per_s"] = static_cast<int>(place.speed_m_per_s);
    one["until_us"] = place.until.us();
    list.append(one);
  }
  return list;
}

}  // namespace

std::vector<PlacedBox> boxes_of(const std::optional<py::list>& teammates) {
  std::vector<PlacedBox> boxes;
  if (!teammates) return boxes;
  for (const py::handle item : *teammates) {
    const auto one = item.cast<py::dict>();
    TeammatePlace place;
    place.T_map_body = pose_of(one["T_map_body"].cast<PoseArray>(), "T_map_body of a teammate");
    const auto low = one["low"].cast<std::array<float, 3>>();
    const auto high = one["high"].cast<std::array<float, 3>>();
    place.box = {low, high};
    place.margin_m = one["margin_m"].cast<double>();
    RobotBody body;
    body.boxes[body.count++] = place.box;
    if (!body.is_valid() || !(place.margin_m >= 0.0 && place.margin_m <= 10.0))
      throw InputError(
          "a teammate's box is none: low must be below high, both within 100 m of its origin, and "
          "margin_m in 0 .. 10");
    boxes.push_back(place.placed_box());
  }
  return boxes;
}

void add_sharer_teammates(py::class_<HeldSharer, std::shared_ptr<HeldSharer>>& sharer) {
  sharer.def(
      "teammates", &teammates, py::arg("now_us") = py::none(),
      R"(Robots that said lately where they are, by number: a list of dicts, for planners, and for
LocalMap.integrate(teammates=...).

robot: its number. T_global_body, T_map_body: (3, 4), where it is now, in the global frame and in that of
the map's current submap. low, high: corners of its box in its body's frame, metres. velocity: metres a
second, global frame. margin_m: by how much it may be elsewhere. speed_m_per_s: that it said, rounded up;
0: it stands. until_us: when it is none any more, if nothing else is heard. This robot says where it is
itself if its map was made with body.)");
}

}  // namespace tessera::python
