// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How often the frames of a node's submaps are written.
#include "node/durable_map.hpp"

#include <catch2/catch.hpp>
#include <filesystem>

#include "support/temporary_folder.hpp"
#include "unit/robot/small_team.hpp"

namespace tessera {
namespace {

constexpr std::int64_t kStep_us = 100'000;

/// A node whose poses change in every step.
struct Keeping {
  explicit Keeping(std::uint32_t count)
      : name{.folder = folder.file(""), .robot = 1, .epoch = 1},
        one(small_robot_config(1)),
        durable(std::move(*DurableMap::begin(name, *one.robot, {.robot = 1, .epoch = 1}))),
        frames(std::make_unique<SubmapFramesState>()) {
    frames->count = count;
  }
  /// Whether the file is another one after a step with new poses. at_us: of the node's clock.
  bool writes(std::int64_t at_us) {
    frames->frames[0].poses[0].stamp_us = ++poses;
    REQUIRE(durable->keep({}, frames.get(), nullptr, at_us).ok());
    const Outcome<SubmapState> state = read_submap_state(name.frames());
    REQUIRE(state.ok());
    REQUIRE(state->frames.size() == frames->count);
    return state->frames[0].poses[0].stamp_us == poses;
  }
  [[nodiscard]] std::uint64_t bytes() const { return std::filesystem::file_size(name.frames()); }

  test::TemporaryFolder folder;
  MapName name;
  SmallRobotMemory one;
  std::unique_ptr<DurableMap> durable;
  std::unique_ptr<SubmapFramesState> frames;
  std::int64_t poses = 0;
};

TEST_CASE("DurableMap: poses of many submaps are written at no more than the rate, and soon") {
  const std::uint32_t count = GENERATE(1U, 20U, 300U);
  CAPTURE(count);
  Keeping node(count);
  REQUIRE(node.writes(0));
  const auto rate = static_cast<double>(DurableMap::kFrameBytes_per_s);
  const double pause_s = static_cast<double>(node.bytes()) / rate;
  const auto steps = static_cast<int>(20.0 * (pause_s + 0.1) / 0.1);
  int written = 0;
  std::int64_t now_us = 0;
  for (int i = 0; i < steps; ++i) written += node.writes(now_us += kStep_us) ? 1 : 0;
  const double passed_s = 1e-6 * static_cast<double>(now_us);
  // No more than the rate, and no less than with a step of waiting for each.
  CHECK(written <= passed_s / pause_s);
  CHECK(written <= passed_s / 0.1 + 1e-9);
  CHECK(written + 1 >= passed_s / (pause_s + 0.1));
}

TEST_CASE("DurableMap: frames that moved, new submaps and the end do not wait") {
  Keeping node(300);
  REQUIRE(node.writes(0));
  REQUIRE_FALSE(node.writes(kStep_us));
  node.frames->revision = 1;
  CHECK(node.writes(2 * kStep_us));
  CHECK_FALSE(node.writes(3 * kStep_us));
  node.frames->count = 301;
  CHECK(node.writes(4 * kStep_us));
  CHECK_FALSE(node.writes(5 * kStep_us));
  CHECK(node.writes(DurableMap::kAtEnd));
}

}  // namespace
}  // namespace tessera
