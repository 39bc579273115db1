// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Every way to make an integrator wrongly is refused, with the status that says why.
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <limits>

#include "support/mapper.hpp"

namespace tessera::oracle {

TEST_CASE("integrator: every value outside its range is refused") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  using Change = std::function<void(InferenceConfig&)>;
  std::vector<Change> changes;
  const auto refuse = [&](float InferenceConfig::*field, std::vector<float> values) {
    values.push_back(nan);
    for (const float value : values)
      changes.emplace_back([=](InferenceConfig& c) { c.*field = value; });
  };
  const auto refuse_entropy = [&](auto EntropyConfig::*field, auto values) {
    for (const auto value : values)
      changes.emplace_back([=](InferenceConfig& c) { c.entropy.*field = value; });
  };
  refuse(&InferenceConfig::kernel_length_m, {0.0F, -1.0F, 1e4F, INFINITY});
  refuse(&InferenceConfig::kernel_scale, {0.0F, -1.0F, 1e7F});
  refuse(&InferenceConfig::min_weight, {-0.1F, 1.1F});
  refuse(&InferenceConfig::min_range_m, {-0.1F, 1e7F, 40.0F, 50.0F});
  refuse(&InferenceConfig::max_range_m, {-0.1F, 1e7F, 0.5F, 0.2F, INFINITY});
  for (const double v : {-0.1, 1e-4, 1e4, std::numeric_limits<double>::quiet_NaN()})
    changes.emplace_back([=](InferenceConfig& c) { c.thinning_m = v; });
  refuse_entropy(&EntropyConfig::base_length, std::vector<float>{-0.1F, 17.0F, nan});
  refuse_entropy(&EntropyConfig::entropy_length, std::vector<float>{-0.1F, 17.0F, nan});
  refuse_entropy(&EntropyConfig::fill_length, std::vector<float>{-0.1F, 17.0F, nan});
  refuse_entropy(&EntropyConfig::smooth_above, std::vector<float>{-0.1F, 2.1F, nan});
  refuse_entropy(&EntropyConfig::fill_neighbours, std::vector<int>{-1, 0, 8});
  refuse_entropy(&EntropyConfig::block_edge, std::vector<int>{-2, 0, 3, 5, 8});
  for (const float v : {-0.1F, 0.051F, nan}) {
    changes.emplace_back([=](InferenceConfig& c) { c.free_space.neighbour_angle_rad = v; });
  }
  for (const float v : {-0.1F, 65.0F, nan}) {
    changes.emplace_back([=](InferenceConfig& c) { c.free_space.margin_voxels = v; });
  }
  changes.emplace_back([](InferenceConfig& c) { c.mode = static_cast<InferenceMode>(4); });
  // A reach of zero is each class's own.
  for (const float v : {-1.0F, 1e-4F, 1e4F, nan})
    changes.emplace_back([=](InferenceConfig& c) { c.lattice.reach_m = v; });
  for (const float v : {0.0F, -1.0F, 1e4F, nan})
    changes.emplace_back([=](InferenceConfig& c) { c.lattice.height_m = v; });
  for (const int edge : {1, 4}) {
    changes.emplace_back([=](InferenceConfig& c) {
      c.mode = InferenceMode::kLattice;
      c.entropy.block_edge = edge;
    });
  }
  changes.emplace_back(
      [](InferenceConfig& c) { c.thinning_weight = static_cast<ThinningWeight>(2); });
  const ScanCapacity capacity = test_capacity();
  AlignedMemory memory(Integrator::required_bytes(capacity, InferenceConfig{}));
  for (std::size_t i = 0; i < changes.size(); ++i) {
    CAPTURE(i);
    InferenceConfig config;
    changes[i](config);
    Arena arena(memory.span());
    CHECK(Integrator::make(arena, config, capacity).status() == Status::kInvalidArgument);
  }
}

TEST_CASE("integrator: a mapper's map keeps votes where the mode needs them and voxels are fine") {
  const auto keeps = [](InferenceMode mode, double resolution_m) {
    RobotConfig robot;
    robot.map = uncapped_map(resolution_m);
    robot.inference.mode = mode;
    robot.scan = test_capacity();
    AlignedMemory memory(tessera::Mapper::required_bytes(robot));
    Arena arena(memory.span());
    const Result<tessera::Mapper*> made =
        tessera::Mapper::make(arena, robot, numbered_classes(5), {});
    REQUIRE(made.ok());
    return (*made)->map().keeps_votes();
  };
  CHECK(keeps(InferenceMode::kLattice, 0.1));
  CHECK(keeps(InferenceMode::kLattice, 0.24));
  CHECK_FALSE(keeps(InferenceMode::kLattice, 0.25));
  CHECK_FALSE(keeps(InferenceMode::kMultiEntropy, 0.1));
}

TEST_CASE("integrator: in the lattice mode a map without votes is as by multi-entropy") {
  InferenceConfig entropy;
  entropy.mode = InferenceMode::kMultiEntropy;
  InferenceConfig lattice;
  lattice.mode = InferenceMode::kLattice;
  Mapper expected(uncapped_map(0.1), entropy, 5);
  Mapper without(uncapped_map(0.1), entropy, 5);
  Mapper with_votes(uncapped_map(0.1), lattice, 5);
  Random random(announce_seed(7));
  for (int scan = 0; scan < 3; ++scan) {
    const Cloud cloud = random_cloud(random, {.points = 300});
    REQUIRE(expected.integrate(cloud).pose == Status::kOk);
    REQUIRE(with_votes.integrator().integrate(without.map(), cloud.view()).pose == Status::kOk);
    REQUIRE(with_votes.integrate(cloud).pose == Status::kOk);
  }
  CHECK(same_content(without.map(), expected.map()));
  CHECK_FALSE(same_content(with_votes.map(), expected.map()));
}

TEST_CASE("integrator: no capacity may be zero, and the arena must be large enough and aligned") {
  const ScanCapacity capacity = test_capacity();
  const std::size_t needed = Integrator::required_bytes(capacity, InferenceConfig{});
  AlignedMemory memory(needed + kArenaAlignment);
  const auto status_of = [&](std::span<std::byte> bytes, const ScanCapacity& with) {
    Arena arena(bytes);
    return Integrator::make(arena, InferenceConfig{}, with).status();
  };
  for (int which = 0; which < 3; ++which) {
    ScanCapacity none = capacity;
    (which == 0 ? none.points : (which == 1 ? none.tiles : none.ray_blocks)) = 0;
    CHECK(status_of(memory.span(), none) == Status::kInvalidArgument);
  }
  CHECK(status_of(memory.span().first(needed), capacity) == Status::kOk);
  CHECK(status_of(memory.span().first(needed - 1), capacity) == Status::kResourceExhausted);
  CHECK(status_of({}, capacity) == Status::kResourceExhausted);
  CHECK(status_of(memory.span().subspan(1), capacity) == Status::kResourceExhausted);
}

}  // namespace tessera::oracle
