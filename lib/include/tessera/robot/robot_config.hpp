// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a robot is made with: its local map, what it publishes of it, what it exchanges, and the map
// of all.
#pragma once

#include <optional>

#include "tessera/exchange/exchange.hpp"
#include "tessera/exchange/publisher.hpp"
#include "tessera/fusion/global_map.hpp"
#include "tessera/inference/integrator.hpp"
#include "tessera/map/moving_window.hpp"

namespace tessera {

/// All but the frame: enough to compute its memory at compile time.
struct RobotSettings {
  MapConfig map{};
  InferenceConfig inference{};
  ScanCapacity scan{};
  /// The part of the map around the robot that is kept in memory; nothing: all of it is.
  std::optional<WindowConfig> window{};
  /// Blocks that a Robot with a window may have in its archive, and that it keeps count of.
  std::uint32_t archived_blocks = 131072;
  PublisherConfig publisher{};
  PublisherBudget budget{};  ///< Of a tick.
  ExchangeConfig exchange{};
  GlobalMapConfig global{};
  std::uint64_t work_per_tick = 300'000;  ///< Of GlobalMap::step.
  std::int64_t deadline_us = 0;           ///< For a scan; 0: none.
  bool near_first = false;  ///< The global map is brought up to date around the robot first.
  /// Ticks that a submap which ends has to be published whole; from 1.
  std::uint32_t submap_ticks = 100;
  /// Way of the robot, summed from scan to scan, after which a new submap with the same frame is
  /// requested (that which the old one has when it ends); 0: none is. At least 0.
  double submap_length_m = 0.0;
  /// Higher with every start that begins with an empty map; of a map that was loaded its own.
  std::uint32_t epoch = 1;
  /// The lowest epoch of this robot that counts, at most epoch: that of a map of an earlier start
  /// that is to count where the new one has nothing yet, or epoch itself. 0: all do.
  std::uint32_t floor = 0;
};

struct RobotConfig : RobotSettings {
  Matrix34d T_global_map = Matrix34d::Identity();  ///< Of the first submap.
};

/// Of the contribution that a robot's local map is published as.
struct SubmapReport {
  std::uint32_t epoch = 0;
  std::uint32_t submap = 0;
  bool ending = false;       ///< Another one was requested.
  std::uint32_t opened = 0;  ///< Beside the first.
  /// At most so many changed in a submap that ended, and are not published any more: a block that
  /// changed after the last whole round began counts, though it may have been published since.
  std::uint64_t lost_blocks = 0;
  std::uint32_t cut_short = 0;  ///< Submaps that ended before all of them had been looked at.
  std::uint32_t reopened = 0;   ///< Times that the epoch was left, as another process was in it.
  Status last = Status::kOk;    ///< How the last request ended: Exchange::open.
};

/// How it tags and signs what it sends, and checks what it hears.
struct RobotKeys {
  Authenticator authenticator = crc_authenticator();
  Signatures signatures{};
};

}  // namespace tessera
