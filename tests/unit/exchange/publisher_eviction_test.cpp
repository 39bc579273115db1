// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Blocks that leave the map: erased by evidence or handed to an archive, and back again.
#include <catch2/catch.hpp>

#include "sample_robot.hpp"

namespace tessera {

namespace {

BlockCoord at(int i) { return block_of(voxel_of_block(i)); }

void fill(LocalMap& map, int i, int voxels) {
  for (int v = 0; v < voxels; ++v)
    REQUIRE(hit(map, {8 * i + v % 8, v / 8, 0}, 1, 2.0F) == Status::kOk);
}

}  // namespace

TEST_CASE("Publisher: a block whose evidence is gone is published as emptied") {
  SampleRobot robot;
  fill(robot.map(), 0, 5);
  fill(robot.map(), 1, 5);
  CHECK(robot.tick().published == 2);
  ReadContent nothing(5);
  REQUIRE(robot.map().replace(robot.map().find_handle(at(0)), nothing.content) == Status::kOk);
  const PublisherReport report = robot.tick();
  CHECK(report.emptied == 1);
  CHECK(robot.kept.blocks.size() == 1);
  CHECK(robot.publisher.blocks() == 1);
}

TEST_CASE("Publisher: a block that is removed is published as emptied within the bound") {
  SampleRobot robot;
  for (int i = 0; i < 50; ++i) fill(robot.map(), i, 5);
  robot.tick();
  for (int i = 0; i < 50; i += 2) robot.map().remove_block(robot.map().find_handle(at(i)));
  for (int i = 0; i < 19; ++i) robot.tick();
  CHECK(robot.publisher.totals().emptied == 25);
  CHECK(robot.kept.blocks.size() == 25);
  CHECK(robot.disagreement() == 0);
}

TEST_CASE("Publisher: what was published of a forgotten block stays, and is not sent again") {
  SampleRobot robot;
  fill(robot.map(), 0, 5);
  fill(robot.map(), 1, 5);
  robot.tick();
  robot.publisher.forget(BlockKey{key_of_block(0)});
  robot.map().remove_block(robot.map().find_handle(at(0)));
  for (int i = 0; i < 100; ++i) CHECK(robot.tick().published == 0);
  CHECK(robot.kept.blocks.size() == 2);
  CHECK(robot.publisher.blocks() == 1);

  fill(robot.map(), 0, 5);  // back as it was
  const PublisherReport report = robot.tick();
  CHECK(report.compared == 1);
  CHECK(report.unchanged == 1);
  CHECK(report.published == 0);
  CHECK(robot.publisher.blocks() == 2);

  robot.map().remove_block(robot.map().find_handle(at(0)));  // now it is watched again
  for (int i = 0; i < 20; ++i) robot.tick();
  CHECK(robot.publisher.totals().emptied == 1);
}

TEST_CASE("Publisher: a block of which a part is archived waits until it is whole") {
  SampleRobot robot;
  fill(robot.map(), 0, 5);
  robot.tick();
  robot.publisher.forget(BlockKey{key_of_block(0)});
  robot.map().remove_block(robot.map().find_handle(at(0)));
  robot.kept.archived.insert(key_of_block(0));

  REQUIRE(hit(robot.map(), {7, 7, 7}, 1, 1.0F) == Status::kOk);  // seen before it is reloaded
  const PublisherReport report = robot.tick();
  CHECK(report.partial == 1);
  CHECK(report.published == 0);
  fill(robot.map(), 0, 5);  // reloaded
  robot.kept.archived.clear();
  CHECK(robot.tick().published == 1);
  CHECK(robot.disagreement() == 0);
}

TEST_CASE(
    "Publisher: a block that is gone but archived is not withdrawn, without being forgotten") {
  SampleRobot robot;
  fill(robot.map(), 0, 5);
  robot.tick();
  robot.kept.archived.insert(key_of_block(0));
  robot.map().remove_block(robot.map().find_handle(at(0)));
  for (int i = 0; i < 40; ++i) CHECK(robot.tick().published == 0);
  CHECK(robot.kept.blocks.size() == 1);
  CHECK(robot.publisher.blocks() == 0);
}

TEST_CASE("Publisher: a block that is forgotten while it waits is counted") {
  SampleRobot robot;
  robot.budget.compared = 0;
  fill(robot.map(), 0, 5);
  robot.tick();
  CHECK(robot.publisher.waiting() == 1);
  robot.publisher.forget(BlockKey{key_of_block(0)});
  robot.publisher.forget(BlockKey{key_of_block(0)});
  CHECK(robot.publisher.waiting() == 0);
  CHECK(robot.publisher.blocks() == 0);
  CHECK(robot.publisher.totals().forgotten_waiting == 1);
}

TEST_CASE(
    "Publisher: a block that is removed and opened anew before it is withdrawn stays watched") {
  SampleRobot robot;
  fill(robot.map(), 0, 5);
  robot.tick();
  robot.map().remove_block(robot.map().find_handle(at(0)));
  robot.budget.compared = 0;
  for (int i = 0; i < 20; ++i) robot.tick();
  CHECK(robot.publisher.waiting() == 1);
  fill(robot.map(), 0, 6);
  robot.budget = kPlenty;
  REQUIRE(robot.settles(40));
  CHECK(robot.disagreement() == 0);
  CHECK(robot.publisher.totals().emptied == 0);
}

TEST_CASE(
    "Publisher: a block that is to leave is published before its time, and stays with others") {
  SampleRobot robot;
  robot.budget.label_bytes = 1 << 20;
  for (int i = 0; i < 600; ++i) fill(robot.map(), i, 1);  // more than are sent at once
  std::vector<LeavingBlock> leaving{{.key = BlockKey{key_of_block(599)}},
                                    {.key = BlockKey{key_of_block(700)}}};
  const PublisherReport report =
      robot.publisher.tick(robot.map(), 0, robot.budget, robot.kept.interface(), leaving);
  CHECK(report.settled == 2);
  const Block* const block = robot.map().find(at(599));
  CHECK(leaving[0].stamp == block->stamp);
  CHECK(leaving[1].stamp == 1);  // there is no such block
  CHECK(robot.kept.blocks.count(key_of_block(599)) == 1);

  robot.kept.archived.insert(key_of_block(599));
  robot.map().remove_block(robot.map().find_handle(at(599)));
  REQUIRE(robot.settles(200));
  CHECK(robot.publisher.totals().emptied == 0);
  CHECK(robot.kept.blocks.size() == 600);

  robot.kept.archived.clear();  // with the archive it would have to be withdrawn
  robot.map().remove_block(robot.map().find_handle(at(598)));
  REQUIRE(robot.settles(200));
  CHECK(robot.publisher.totals().emptied == 1);
  CHECK(robot.kept.blocks.size() == 599);
}

TEST_CASE("Publisher: a block that is to leave waits for bytes, and is asked about again") {
  SampleRobot robot;
  fill(robot.map(), 0, 5);
  robot.budget.label_bytes = 0;
  std::vector<LeavingBlock> leaving{{.key = BlockKey{key_of_block(0)}}};
  robot.publisher.tick(robot.map(), 0, robot.budget, robot.kept.interface(), leaving);
  CHECK(leaving[0].stamp == 0);
  robot.publisher.tick(robot.map(), 50'000, kPlenty, robot.kept.interface(), leaving);
  CHECK(leaving[0].stamp == robot.map().find(at(0))->stamp);
}

}  // namespace tessera
