// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What the log says of frames: here of a robot whose frame is given among those that find theirs.
#include "node/frames_watch.hpp"

#include <fcntl.h>

#include "base/file_descriptor.hpp"
#include "unit/robot/frames_team.hpp"

namespace tessera {
namespace {

TEST_CASE("FramesWatch: a robot with a given frame among those that find theirs says so once") {
  FramesTeam team(6);
  team.add(FramesTeam::config_of(0, FrameMode::kGiven));
  for (std::uint32_t i = 1; i < 3; ++i) team.add(FramesTeam::config_of(i, FrameMode::kFound));
  LogQueue log("test");
  const FileDescriptor nothing(::open("/dev/null", O_WRONLY | O_CLOEXEC));
  LogWriter writer(nothing.get(), false);
  FramesWatch watch(FrameMode::kGiven);
  CHECK(to_json(FramesWatch(FrameMode::kFound).view())["mode"] == "found");
  const auto lines_of_look = [&] {
    const std::uint64_t before = writer.lines();
    watch.look(team.robot(0).sharer(), 0, team.now_us, log);
    LogQueue* const queues[] = {&log};
    writer.write(queues);
    return writer.lines() - before;
  };
  CHECK(lines_of_look() == 0);
  CHECK(watch.view().left_out_by == 0);
  team.run(2 * kOneSecond_us);
  CHECK(lines_of_look() == 1);
  CHECK(watch.view().left_out_by == 2);
  CHECK(to_json(watch.view()) == Json({{"mode", "given"}, {"left_out_by", 2}}));
  team.run(kOneSecond_us);
  CHECK(lines_of_look() == 0);
  CHECK(watch.view().left_out_by == 2);
}

TEST_CASE("FramesWatch: the last comparison of a pair is in the report with what agreed") {
  FramesTeam team(7);
  for (std::uint32_t i = 0; i < 2; ++i) team.add(FramesTeam::config_of(i, FrameMode::kFound));
  SolidWorld hall = large_hall();
  for (Solid& solid : hall.solids) solid.label = solid.label == 1 ? 1 : 2;
  for (std::size_t i = 0; i < 2; ++i)
    add_world(hall, {{-0.5, -0.5, -0.5}, {26.0, 18.5, 3.5}, Matrix34d::Identity(), 0.2, false},
              team.robot(i).mapper().maps().map());
  team.run(10 * kOneSecond_us);
  FramesState state;
  state.take(team.frames(0));
  const Json pairs = to_json(state)["pairs"];
  REQUIRE(pairs.size() == 1);
  CHECK(pairs[0]["result"] == "found");
  CHECK(pairs[0]["agreement"]["share"] == 1.0);
  CHECK(pairs[0]["agreement"]["agreed"] == state.pairs[0].agreement.agreed);
  CHECK(pairs[0]["agreement_second"]["agreed"] == state.pairs[0].agreement_second.agreed);
  CHECK(state.pairs[0].agreement_second.support() == state.pairs[0].support_second);
}

}  // namespace
}  // namespace tessera
