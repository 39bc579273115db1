// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A table of contributions with replicas of its own.
#pragma once

#include <catch2/catch.hpp>

#include "support/aligned_memory.hpp"
#include "tessera/exchange/internal/contribution_table.hpp"
#include "tessera/exchange/internal/epoch_floors.hpp"

namespace tessera {

using Claim = ContributionTable::Claim;

inline constexpr ReplicasConfig kOwnReplicas{
    .segments = 64, .blocks = 64, .contributions = 30, .robot_segments = 64};

struct OwnTable {
  static ExchangeConfig config(std::uint32_t of_one_robot = 2, std::uint32_t places = 5) {
    ExchangeConfig config;
    config.robot = 1;
    config.contributions = places;
    config.contributions_per_robot = of_one_robot;
    config.own_contributions = 1;
    config.peers = 2;
    return config;
  }
  explicit OwnTable(bool signs = false, std::uint32_t of_one_robot = 2, std::uint32_t places = 5)
      : memory(Replicas::required_bytes(kOwnReplicas) +
               ContributionTable::required_bytes(config(of_one_robot, places)) +
               EpochFloors::required_bytes(config())) {
    Arena arena = memory.arena();
    replicas = *Replicas::make(arena, kOwnReplicas);
    table = *ContributionTable::make(arena, config(of_one_robot, places), store_of(replicas));
    floors = *EpochFloors::make(arena, config(), signs);
  }
  HeldContribution* add(const ContributionId& id, Claim claim, std::int64_t now_us = 1'000'000) {
    HeldContribution* const place = table.add(id, claim, Instant::at_us(now_us), counted);
    if (place != nullptr && claim != Claim::kName)
      REQUIRE(table.set_frame(*place, Matrix34d::Identity(), 1) == Status::kOk);
    return place;
  }

  AlignedMemory memory;
  Replicas replicas;
  ContributionTable table;
  EpochFloors floors;
  ExchangeReport counted;
};

}  // namespace tessera
