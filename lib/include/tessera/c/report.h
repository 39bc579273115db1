// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a robot is handed and gives back, for C: scans, estimates, reports.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "tessera/exchange/exchange_counters.h"
#include "tessera/exchange/publisher_counters.h"
#include "tessera/fusion/global_counters.h"
#include "tessera/inference/scan_counters.h"
#include "tessera/map/window_counters.h"
#include "tessera/replica/replica_counters.h"
#include "tessera/robot/objection_counters.h"

/// The lists of counters have their members and what each means.
#define TESSERA_C_MEMBER(kind, type, name, sentence) type name;

/// Which map is asked.
enum { TESSERA_LOCAL_MAP = 0, TESSERA_GLOBAL_MAP = 1 };
/// tessera_estimate.state
enum { TESSERA_UNKNOWN = 0, TESSERA_FREE = 1, TESSERA_OCCUPIED = 2 };
/// tessera_ray_hit.end
enum {
  TESSERA_RAY_MAX_RANGE = 0,
  TESSERA_RAY_OCCUPIED = 1,
  TESSERA_RAY_UNKNOWN = 2,  ///< only where it was to stop there
  TESSERA_RAY_INVALID = 3   ///< not in the grid, or direction or range not finite and positive
};

/// Range data with labels. Arrays stay the caller's, and must be there for the call.
typedef struct tessera_scan {
  uint32_t struct_bytes;      ///< sizeof(tessera_scan)
  uint32_t stride_floats;     ///< from point to point: 3 for packed x y z, 4 with an intensity
  const float* points;        ///< x y z, metres, sensor frame
  const uint8_t* components;  ///< 1 .. C, C + 1: unlabelled; NULL: all unlabelled
  const float* weights;       ///< 0 .. 1e6; NULL: all 1
  uint64_t count;             ///< of points
  double T_map_sensor[12];    ///< [R | t], rows first, metres: sensor to map coordinates
  int64_t now_us;             ///< of the clock
  int64_t due_us;             ///< of the clock: to be done by then; 0: as configured

  double T_body_sensor[12];  ///< sensor to body, for tessera_config.body; all 0: the same
  const uint8_t* no_return;  ///< not 0: nothing came back from the point's direction; NULL: all did

  /// 255ths of a point's weight for each label; what they leave of 255 is unlabelled, and so is a
  /// point of more. NULL: a point has one label, with all of its weight
  const uint8_t* label_weights;
  uint32_t labels_per_point;  ///< 1 .. 3, of which components has one after the other; 0: 1
  uint32_t reserved;          ///< 0
} tessera_scan;

/// The least struct_bytes that is taken: what programs of version 1 have.
#define TESSERA_SCAN_LEAST_BYTES (offsetof(tessera_scan, due_us) + sizeof(int64_t))

/// What an integrated scan did, and what it left out [ScanReport].
typedef struct tessera_scan_report {
  uint32_t struct_bytes;
  uint32_t pose;  ///< tessera_status; not TESSERA_OK: nothing was done
  TESSERA_SCAN_COUNTERS(TESSERA_C_MEMBER)
} tessera_scan_report;

/// State, label and certainty of a voxel [Estimate].
typedef struct tessera_estimate {
  double probability;  ///< of the label
  double variance;     ///< of the label
  double evidence;     ///< sum of the counts
  double occupancy;
  int32_t label;   ///< 1 .. C; 0: none
  uint32_t state;  ///< TESSERA_UNKNOWN, ...
} tessera_estimate;

/// An observed voxel of a box. It covers [x, x + 1) * resolution_m on each axis.
typedef struct tessera_voxel {
  int32_t x;
  int32_t y;
  int32_t z;
  uint32_t reserved;
  tessera_estimate estimate;
} tessera_voxel;

/// Where the walk through a box is; of use while nothing is written to the map.
typedef struct tessera_box_cursor {
  int32_t low[3];   ///< voxels, these included
  int32_t high[3];  ///< voxels, these included
  uint32_t map;
  uint32_t done;     ///< 1: all was given
  int32_t block[3];  ///< the library's, from here on
  uint32_t place;
  uint32_t next;
  uint32_t by_index;
} tessera_box_cursor;

/// What tessera_cast_ray met.
typedef struct tessera_ray_hit {
  double distance_m;  ///< from the origin to where the ray enters the voxel
  int32_t x;
  int32_t y;
  int32_t z;
  uint32_t end;  ///< TESSERA_RAY_MAX_RANGE, ...
  tessera_estimate estimate;
} tessera_ray_hit;

/// What tessera_nearest_occupied found.
typedef struct tessera_nearest {
  double distance_m;  ///< to the voxel's nearest point; 0: within it
  int32_t x;
  int32_t y;
  int32_t z;
  uint32_t found;  ///< 0: nothing occupied where it was looked
  tessera_estimate estimate;
  /// All that is nearer than this was looked at: what was found is the nearest if its distance_m is
  /// not above it, and if nothing was, there is nothing within it.
  double searched_m;
  uint32_t complete;  ///< 1: searched_m reaches what was found, or the radius; 0: max_work ended it
  uint32_t reserved;
} tessera_nearest;

/// Another robot that says where it is [TeammatePlace].
typedef struct tessera_teammate {
  uint32_t struct_bytes;
  uint32_t robot;
  double T_global_body[12];  ///< [R | t], rows first, metres: where it is now
  float low[3];              ///< corners of its box in its body's frame, metres
  float high[3];
  double velocity[3];    ///< metres a second, global frame
  double margin_m;       ///< by how much it may be elsewhere
  double speed_m_per_s;  ///< that it said, rounded up; 0: it stands
  int64_t until_us;  ///< of the clock: then it is no teammate any more, if nothing else is heard
} tessera_teammate;

/// What a tick did and left [PublisherReport].
typedef struct tessera_tick_report {
  uint32_t struct_bytes;
  TESSERA_PUBLISHER_COUNTERS(TESSERA_C_MEMBER)
} tessera_tick_report;

/// The submap that is published into [SubmapReport].
typedef struct tessera_submap_report {
  uint32_t struct_bytes;
  uint32_t epoch;
  uint32_t submap;
  uint32_t ending;  ///< 1: it has ended, and is not published whole yet
  uint32_t opened;
  uint32_t cut_short;
  uint64_t lost_blocks;  ///< at most so many
  uint32_t last;         ///< tessera_status with which the last one was opened
  uint32_t reserved;
  uint32_t mapping;   ///< the submap that is mapped into
  uint32_t revision;  ///< of the last correction that was applied; 0: none was
  uint32_t corrections;
  uint32_t refused_corrections;
  uint32_t refused_frames;  ///< corrected frames that lie out of the grid
  uint32_t reserved_2;
  double corrected_most_m;  ///< how far the last correction moved one, at its middle
} tessera_submap_report;

/// What the window of the local map did, and what is archived [WindowReport].
typedef struct tessera_window_report {
  uint32_t struct_bytes;
  uint32_t archived_blocks;
  TESSERA_WINDOW_COUNTERS(TESSERA_C_MEMBER)
} tessera_window_report;

/// How full a map is [MapUsage].
typedef struct tessera_map_usage {
  uint32_t struct_bytes;
  uint32_t reserved;
  uint64_t capacity_bytes;
  uint64_t used_bytes;
  uint64_t peak_bytes;
  uint64_t blocks;
  uint64_t label_voxels;
  uint64_t blocks_refused;
  uint64_t storage_refused;
} tessera_map_usage;

/// How the global map stands [GlobalMapReport, ReplicasUsage].
typedef struct tessera_global_report {
  uint32_t struct_bytes;
  uint32_t settled;  ///< 0: a finished move is being copied; boxes, rays and the nearest must wait
  uint32_t busy;     ///< 1: the map is behind what has arrived
  TESSERA_GLOBAL_STATE(TESSERA_C_MEMBER)
  TESSERA_GLOBAL_FIGURES(TESSERA_C_MEMBER)
  TESSERA_GLOBAL_COUNTERS(TESSERA_C_MEMBER)
  uint64_t generation;
  TESSERA_REPLICA_COUNTERS(TESSERA_C_MEMBER)
  TESSERA_GLOBAL_COUNTERS_LATER(TESSERA_C_MEMBER)
} tessera_global_report;

/// [RobotReliability, ClassReliability]
typedef struct tessera_reliability_report {
  uint32_t struct_bytes;
  float reliability;   ///< what a count of its labels counts, at most, where robots are weighed
  float agreement;     ///< share of its label evidence that is the majority's, where it is judged
  uint32_t reserved;   ///< 0
  uint64_t judged;     ///< voxels with a majority of three robots or more; of a class: that is it
  uint64_t shared;     ///< voxels in which one other robot alone has a label; of a class: 0
  uint64_t differing;  ///< of these, those with another label; of a class: 0
  uint64_t named;      ///< classes that are named, a bit each; of a class: its own bit, or 0
} tessera_reliability_report;

/// What the robot objects to of what others have [ObjectionsReport]. Counters never decrease.
typedef struct tessera_objections_report {
  uint32_t struct_bytes;
  TESSERA_OBJECTION_COUNTERS(TESSERA_C_MEMBER)
} tessera_objections_report;

/// What came, what went, and how it stands [ExchangeReport]. Counters never decrease.
typedef struct tessera_exchange_report {
  uint32_t struct_bytes;
  TESSERA_EXCHANGE_STATE(TESSERA_C_MEMBER)
  uint64_t digest;  ///< of all that is there: equal on robots that have the same
  TESSERA_EXCHANGE_COUNTERS(TESSERA_C_MEMBER)
} tessera_exchange_report;

/// What a robot has of a contribution [ContributionState].
typedef struct tessera_contribution {
  uint32_t struct_bytes;
  uint32_t robot;
  uint32_t epoch;
  uint32_t submap;
  uint32_t own;
  uint32_t complete;
  uint32_t latest;
  uint32_t covered;
  uint64_t digest;
} tessera_contribution;

/// tessera_session.state
enum {
  TESSERA_SESSION_PUBLISHING = 0,
  TESSERA_SESSION_SHARED = 1,
  TESSERA_SESSION_LEAVING = 2  ///< it was removed, and its memory is being freed
};

/// A map of an earlier day that this robot shares [MapSessions].
typedef struct tessera_session {
  uint32_t struct_bytes;
  uint32_t number;
  uint32_t state;
  uint32_t blocks;  ///< that are published
  uint64_t digest;  ///< of its file: its name
  int64_t date_s;   ///< of the map, UTC, seconds since 1970
  double weight;
  uint64_t refused_blocks;  ///< for lack of room
} tessera_session;

/// Reads both maps while another thread works on them: for one thread, in the caller's memory.
typedef struct tessera_reader {
  uint64_t opaque[24];
} tessera_reader;
