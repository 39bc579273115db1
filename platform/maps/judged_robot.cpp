// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/judged_robot.hpp"

#include <fmt/format.h>

#include "base/number_text.hpp"

namespace tessera {

namespace {

Json to_json(const JudgedRobot& robot, const ClassTable& classes) {
  const RobotReliability& whole = robot.whole;
  Json by_class = Json::object();
  for (int label = 1; label <= classes.num_classes(); ++label) {
    const ClassReliability& one = robot.classes[static_cast<std::size_t>(label - 1)];
    const bool is_named = ((whole.named >> static_cast<unsigned>(label)) & 1U) != 0;
    if (one.judged == 0 && !is_named) continue;
    by_class[std::string(classes[label].name_view())] = {
        {"reliability", decimal_of(one.reliability)},
        {"agreement", decimal_of(one.agreement)},
        {"judged", one.judged}};
  }
  return {{"robot", whole.robot},
          {"reliability", decimal_of(whole.reliability)},
          {"agreement", decimal_of(whole.agreement)},
          {"judged", whole.judged},
          {"shared", whole.shared},
          {"differing", whole.differing},
          {"named", names_of(whole.named, classes)},
          {"classes", std::move(by_class)}};
}

}  // namespace

std::vector<JudgedRobot> judge_robots(const GlobalMap& global) {
  std::vector<JudgedRobot> robots;
  const Replicas& replicas = global.replicas();
  for (const GlobalMap::Slot slot : replicas.in_order()) {
    const std::uint32_t number = replicas.contribution(slot).id.robot;
    if (!robots.empty() && robots.back().whole.robot == number) continue;
    const Result<RobotReliability> whole = global.reliability(number);
    if (!whole.ok()) continue;
    JudgedRobot& robot = robots.emplace_back();
    robot.whole = *whole;
    for (int label = 1; label <= global.map().num_components() - 2; ++label)
      robot.classes.push_back(*global.reliability(number, label));
  }
  return robots;
}

Json to_json(const std::vector<JudgedRobot>& robots, const ClassTable& classes) {
  Json json = Json::array();
  for (const JudgedRobot& robot : robots) json.push_back(to_json(robot, classes));
  return json;
}

std::vector<std::string> names_of(std::uint64_t bits, const ClassTable& classes) {
  std::vector<std::string> names;
  for (int label = 1; label <= classes.num_classes(); ++label)
    if (((bits >> static_cast<unsigned>(label)) & 1U) != 0)
      names.emplace_back(classes[label].name_view());
  return names;
}

std::string doubt_of(const JudgedRobot& robot, const ClassTable& classes) {
  return fmt::format(
      "most other robots contradict robot {} where it or they see {}; its network "
      "or its class table may be wrong",
      robot.whole.robot, fmt::join(names_of(robot.whole.named, classes), ", "));
}

}  // namespace tessera
