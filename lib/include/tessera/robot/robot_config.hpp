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
#include "tessera/robot/frames_config.hpp"
#include "tessera/submap/submap_cutter.hpp"

namespace tessera {

/// All but the frame: enough to compute its memory at compile time.
struct RobotSettings {
  MapConfig map{};  ///< It keeps votes where the inference needs them.
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
  FramesConfig frames{};
  std::uint64_t work_per_tick = 300'000;  ///< Of GlobalMap::step.
  /// What others have published is held where it is this near to the robot or to its route
  /// (Sharer::set_route), and of the rest what there is room for: Exchange::set_reach. 0: of all,
  /// what there is room for. With it exchange.far_contributions is not to be 0.
  double reach_m = 0.0;
  /// How much larger than they say other robots are taken to be, 0 .. 2: as frames and places are
  /// not exact. Of those that move more is added for what they may do between two messages.
  double teammate_margin_m = 0.2;
  /// Objections that are followed (Objections), at most Objection::kPlaces: older ones stay, and
  /// are not taken back. 0: the robot makes none, and answers none.
  std::uint32_t objections = 256;
  std::int64_t deadline_us = 0;  ///< For a scan; 0: none.
  bool near_first = false;       ///< The global map is brought up to date around the robot first.
  /// Submaps that the robot may map into, at most: from 2, or 0 for one map. With submaps there are
  /// two local maps that take turns (LocalMaps), and no window.
  std::uint32_t most_submaps = 0;
  /// Number of the first one: 0, or of the submap in which an earlier start is continued.
  std::uint32_t first_submap = 0;
  /// Submaps in front of it that earlier starts of the same map ended: they count among
  /// most_submaps. At most first_submap.
  std::uint32_t submaps_before = 0;
  /// What ends a submap, beside a request. A jump ends it at once; the others once the submap
  /// before it is published and kept, and while an eighth of most_submaps is left for jumps. A
  /// submap whose map is three quarters full ends after a quarter of that way or time. Each time
  /// that half of the submaps that are left have begun, way and time double, up to 1024 times.
  SubmapCuts submap_cuts{};
  /// Ticks that a submap which has ended has to be published whole; from 1.
  std::uint32_t submap_ticks = 100;
  /// Higher with every start; of a map that was loaded its own.
  std::uint32_t epoch = 1;
  /// The lowest epoch of this robot that counts, at most epoch: that of a map of an earlier start
  /// that is to count where the new one has nothing yet, or epoch itself. 0: all do.
  std::uint32_t floor = 0;
  /// Map sessions of this robot's earlier epochs count until MapSessions::end_earlier(), as this
  /// start loads them again; else they end with it.
  bool keep_sessions = false;
};

struct RobotConfig : RobotSettings {
  /// Of the first submap; where frames are found, of no meaning and the identity.
  Matrix34d T_global_map = Matrix34d::Identity();
};

/// Of the contribution that a robot's local map is published as.
struct SubmapReport {
  std::uint32_t epoch = 0;
  std::uint32_t submap = 0;
  bool ending = false;       ///< It has ended, and is not published whole yet.
  std::uint32_t opened = 0;  ///< Beside the first.
  /// At most so many changed in a submap that ended, and are not published any more: a block that
  /// changed after the last whole round began counts, though it may have been published since.
  std::uint64_t lost_blocks = 0;
  std::uint32_t cut_short = 0;    ///< Submaps that ended before all of them had been looked at.
  std::uint32_t reopened = 0;     ///< Times that the epoch was left, as another process was in it.
  Status last = Status::kOk;      ///< How the last one was opened: Exchange::open.
  std::uint32_t revision = 0;     ///< Of the last correction that was applied; 0: none was.
  std::uint32_t corrections = 0;  ///< That were applied.
  std::uint32_t refused_corrections = 0;  ///< CorrectionReport::status.
  std::uint32_t refused_frames = 0;       ///< Corrected frames that lie out of the grid.
  double corrected_most_m = 0.0;          ///< CorrectionReport::most_m of the last one.
};

/// How it tags and signs what it sends, and checks what it hears.
struct RobotKeys {
  Authenticator authenticator = crc_authenticator();
  Signatures signatures{};
};

}  // namespace tessera
