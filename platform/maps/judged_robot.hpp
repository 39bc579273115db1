// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a global map says of its robots' labels, for reports.
#pragma once

#include <string>
#include <vector>

#include "base/json.hpp"
#include "tessera/fusion/global_map.hpp"

namespace tessera {

struct JudgedRobot {
  RobotReliability whole;
  std::vector<ClassReliability> classes;  ///< Of class 1, 2 ...

  /// Whether it or a class of it is less reliable than the alarm.
  [[nodiscard]] bool is_named() const noexcept { return whole.named != 0; }
};

/// By ascending number; robots whose maps of earlier days alone are there are left out.
std::vector<JudgedRobot> judge_robots(const GlobalMap& global);
/// As the reports of fuse, nodes and Python have it.
Json to_json(const std::vector<JudgedRobot>& robots, const ClassTable& classes);
/// Of a bit for each class.
std::vector<std::string> names_of(std::uint64_t bits, const ClassTable& classes);
/// What is to be said of one that is named.
std::string doubt_of(const JudgedRobot& robot, const ClassTable& classes);

}  // namespace tessera
