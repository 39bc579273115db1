// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a search for the transform between two maps gives, for C.
#pragma once

#include <stdint.h>

/// How far a search is.
enum {
  TESSERA_FRAME_READING = 0,    ///< the maps are being read: robots must not be worked on
  TESSERA_FRAME_SEARCHING = 1,  ///< the maps are needed no more
  TESSERA_FRAME_DONE = 2
};
/// tessera_frame_answer.verdict
enum {
  TESSERA_FRAME_FOUND = 0,
  TESSERA_FRAME_TOO_LITTLE = 1,  ///< a map has too few surfaces that stand
  TESSERA_FRAME_NONE_FITS = 2,   ///< nowhere do enough surfaces lie on each other
  TESSERA_FRAME_CONTRADICTED =
      3,                        ///< at the best fit, surfaces of one are in free space of the other
  TESSERA_FRAME_AMBIGUOUS = 4,  ///< another place fits nearly as well
  TESSERA_FRAME_LOOSE = 5,      ///< the overlap does not hold it in some direction
  TESSERA_FRAME_OUT_OF_REACH = 6  ///< the best fit is beyond the reach of the search
};

/// tessera_config.frames [FrameMode]
enum {
  TESSERA_FRAMES_GIVEN = 0,    ///< T_global_map of each robot, exactly
  TESSERA_FRAMES_REFINED = 1,  ///< it is roughly known, and links correct it
  TESSERA_FRAMES_FOUND = 2     ///< not known: it is to be the identity, and links alone find it
};
/// tessera_placed_robot.state [FrameState]
enum {
  TESSERA_PLACED_GIVEN = 0,         ///< by an exact frame
  TESSERA_PLACED_ROUGHLY = 1,       ///< by a rough frame alone
  TESSERA_PLACED_BY_LINKS = 2,      ///< by what more than one robot has found
  TESSERA_PLACED_BY_ONE = 3,        ///< without one robot's word it would not be joined
  TESSERA_PLACED_ALONE = 4,         ///< nothing joins it
  TESSERA_PLACED_WITHDRAWN = 5,     ///< the same, and links of it were withdrawn
  TESSERA_PLACED_CONTRADICTED = 6,  ///< the same, as what was found contradicts itself
};

/// A robot of a team whose frames are found [PlacedRobot].
typedef struct tessera_placed_robot {
  uint32_t struct_bytes;
  uint32_t robot;
  uint32_t group;         ///< lowest robot of those that are joined
  uint32_t anchor;        ///< robot that holds the frame of the group
  uint32_t state;         ///< TESSERA_PLACED_GIVEN, ...
  uint32_t in_use;        ///< 1: its map is part of the global map, at T_team_map
  uint32_t arrived;       ///< 1: T_team_map is where the links have it, and does not follow them
  uint32_t suspected;     ///< 1: its links contradict what others confirm
  double T_team_map[12];  ///< [R | t], rows first, metres, of the world that it publishes in
  double sigma_m;         ///< to the anchor: root of the sum of the variances
  double sigma_rad;
} tessera_placed_robot;

/// How two maps agree at a transform, in samples of surfaces [Agreement].
typedef struct tessera_agreement {
  uint32_t agreed;        ///< of what stands: a surface of the other map is there
  uint32_t contradicted;  ///< of what stands: the other map has free space there
  uint32_t unseen;        ///< of what stands: the other map does not know
  uint32_t flat_agreed;
  uint32_t flat_contradicted;
  uint32_t labelled;    ///< surfaces with a label in both maps
  uint32_t same_label;  ///< of these, those with the same
  uint32_t reserved;    ///< 0
} tessera_agreement;

/// The transform between two maps [FrameAnswer]. Use it only if verdict is TESSERA_FRAME_FOUND.
typedef struct tessera_frame_answer {
  uint32_t struct_bytes;
  uint32_t verdict;       ///< TESSERA_FRAME_FOUND, ...
  double T_a_b[12];       ///< [R | t], rows first, metres: p_a = T_a_b p_b; the best one found
  double covariance[36];  ///< of a small motion about middle_a, along a's axes: x y z in m, then a
                          ///< rotation vector in rad; all 0: it could not be computed
  double middle_a[3];     ///< of the overlap, metres
  double sigma_m;         ///< standard deviation of the translation in the direction least held
  double sigma_rad;       ///< the same of the rotation
  double support;         ///< samples that agree, less eight times those that do not
  double support_second;  ///< the same of the other place that makes it most doubtful
  tessera_agreement agreement;         ///< at T_a_b
  tessera_agreement agreement_guess;   ///< at the guess, or where the search began
  uint32_t pairs;                      ///< of surfaces that lie on each other
  uint32_t steps;                      ///< of the search
  tessera_agreement agreement_second;  ///< at that other place; all 0: there is none
} tessera_frame_answer;
