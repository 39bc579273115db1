// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a robot is made with: its local map, what it publishes of it, what it exchanges, and the map
// of all.
#pragma once

#include "tessera/exchange/exchange.hpp"
#include "tessera/exchange/publisher.hpp"
#include "tessera/fusion/global_map.hpp"
#include "tessera/inference/integrator.hpp"

namespace tessera {

struct RobotConfig {
  MapConfig map{};
  InferenceConfig inference{};
  ScanCapacity scan{};
  PublisherConfig publisher{};
  PublisherBudget budget{};  ///< Of a tick.
  ExchangeConfig exchange{};
  GlobalMapConfig global{};
  std::uint64_t work_per_tick = 300'000;  ///< Of GlobalMap::step.
  std::int64_t deadline_us = 0;           ///< For a scan; 0: none.
  bool near_first = false;  ///< The global map is brought up to date around the robot first.
  std::uint32_t epoch = 1;
  Matrix34d T_global_map = Matrix34d::Identity();
};

/// How it tags and signs what it sends, and checks what it hears.
struct RobotKeys {
  Authenticator authenticator = crc_authenticator();
  Signatures signatures{};
};

}  // namespace tessera
