// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a robot is made with, for C: settings, classes, and the functions that the program gives.
#pragma once

#include <stddef.h>
#include <stdint.h>

/// What the memory of a robot must be aligned to, in bytes.
#define TESSERA_ALIGNMENT 64
/// The most bytes that a datagram has.
#define TESSERA_MOST_DATAGRAM_BYTES 1392
#define TESSERA_MOST_CLASSES 62
#define TESSERA_MOST_BODY_BOXES 8
#define TESSERA_TAG_BYTES 16
#define TESSERA_SIGNATURE_BYTES 64
#define TESSERA_HASH_BYTES 16
/// Times that are handed in are at most so far from zero: 36,000 years.
#define TESSERA_MOST_TIME_US (INT64_C(1) << 60)

/// How a call ended.
typedef enum tessera_status {
  TESSERA_OK = 0,
  TESSERA_INVALID_ARGUMENT = 1,    ///< outside its documented range, or NULL; nothing was changed
  TESSERA_RESOURCE_EXHAUSTED = 2,  ///< a fixed capacity is used up; nothing was changed
  TESSERA_OUT_OF_RANGE = 3,        ///< a coordinate lies outside the grid
  TESSERA_MISMATCH = 4,            ///< two things that must agree do not
  TESSERA_CORRUPT = 5,             ///< stored bytes fail a check
  TESSERA_TRUNCATED = 6,           ///< stored bytes end too early
  TESSERA_UNSUPPORTED = 7,         ///< of a newer version than this library
  TESSERA_IO = 8,                  ///< the program's function for reading or writing failed
  TESSERA_BUSY = 9                 ///< not now: try again
} tessera_status;

/// A robot, at the beginning of the memory that it was made in.
typedef struct tessera_robot tessera_robot;

/// Settings of enumerated kinds; fields are uint32_t, so that their size is the same everywhere.
enum {  // mode; TESSERA_LATTICE, the default, needs a block_edge of 2, and from voxels of 0.25 m on
        // it is TESSERA_MULTI_ENTROPY
  TESSERA_COUNTING = 0,
  TESSERA_KERNEL = 1,
  TESSERA_MULTI_ENTROPY = 2,
  TESSERA_LATTICE = 3
};
enum { TESSERA_DENSE = 0, TESSERA_COMPACT = 1 };                                ///< tuple
enum { TESSERA_CARVING_RAYS = 0, TESSERA_CARVING_IMAGE = 1 };                   ///< carving
enum { TESSERA_THINNING_MEAN = 0, TESSERA_THINNING_SUM = 1 };                   ///< weight
enum { TESSERA_CONTRACTIVE = 0, TESSERA_PAPER = 1, TESSERA_NO_DIFFUSION = 2 };  ///< diffusion
enum {
  TESSERA_EDGE_DISTANCE = 0,
  TESSERA_EDGE_LABEL = 1,
  TESSERA_EDGE_SIMILARITY = 2,
  TESSERA_EDGE_CONFIDENCE = 3
};  ///< edge

/// Settings. tessera_config_init fills in the defaults; fields and their ranges are those of the
/// C++ structs of the names in brackets, whose headers have more to say about each.
typedef struct tessera_config {
  uint32_t struct_bytes;  ///< sizeof(tessera_config), as the program was compiled
  uint32_t robot;         ///< this robot's number, alone in its fleet
  uint32_t epoch;         ///< higher with every start that begins with an empty map
  uint32_t session;       ///< higher with every start

  /// The local map, and what of it the global one shares [MapConfig].
  double resolution_m;
  double prior;
  uint64_t local_bytes;   ///< storage of the local map
  uint64_t global_bytes;  ///< storage of the global map
  float max_evidence;     ///< of the local map; the global one has no cap
  float free_weight;
  uint32_t local_tuple;
  uint32_t global_tuple;

  /// Scratch for a scan [ScanCapacity].
  uint32_t scan_points;
  uint32_t scan_tiles;
  uint32_t scan_ray_blocks;
  /// Inference [InferenceConfig].
  uint32_t mode;
  double thinning_m;
  float min_range_m;
  float max_range_m;
  uint32_t thinning_weight;
  uint32_t free_space;  ///< 0: rays give no free evidence
  float neighbour_angle_rad;
  float margin_voxels;
  float kernel_length_m;
  float kernel_scale;
  float min_weight;
  float base_length;  ///< from here on [EntropyConfig]
  float entropy_length;
  float smooth_above;
  float fill_length;
  uint32_t fill_neighbours;
  uint32_t fill_one_label;
  uint32_t block_edge;
  uint64_t work_budget;  ///< of a scan; 0: no limit
  int64_t deadline_us;   ///< for a scan, from its now_us on; 0: none. Needs a clock

  /// What of its map a robot publishes, and when [PublisherConfig, PublisherBudget].
  uint32_t publisher_blocks;
  uint32_t publisher_candidates;
  int64_t staleness_us;
  int64_t free_staleness_us;
  int64_t retry_us;
  double submap_length_m;  ///< of the robot's way, after which a submap ends; 0: no limit
  float evidence_factor;
  uint32_t few_voxels;
  uint32_t many_voxels;
  int32_t near_blocks;
  uint32_t tick_entries;
  uint32_t tick_compared;
  uint32_t tick_label_bytes;
  uint32_t tick_free_bytes;
  uint32_t submap_ticks;  ///< that a submap which has ended has to be published whole

  /// The exchange with other robots [ExchangeConfig].
  uint32_t contributions;
  uint32_t own_contributions;  ///< of these, kept for this robot's submaps
  uint32_t peers;
  uint32_t answers;
  uint32_t fresh;
  uint32_t bytes_per_s;
  uint32_t burst_bytes;
  int64_t announce_us;
  int64_t announce_soon_us;
  int64_t request_us;
  int64_t request_most_us;
  int64_t request_idle_us;
  int64_t answer_us;

  /// The global map [GlobalMapConfig, ReplicasConfig].
  uint64_t staged_bytes;
  uint32_t global_blocks;
  uint32_t sum_segments;
  uint32_t replica_segments;
  uint32_t replica_blocks;
  uint32_t robot_segments;
  uint32_t robot_blocks;
  uint64_t work_per_tick;
  uint32_t near_first;  ///< 1: brought up to date around the robot first
  /// How contributions become one map [DiffusionConfig].
  uint32_t diffusion;
  uint32_t edge;
  int32_t iterations;
  float length_m;
  float alpha;
  float omega;
  float diffusion_prior;
  uint32_t whole_map;
  uint32_t reserved;  ///< 0

  /// More of the exchange [ExchangeConfig].
  uint32_t mission;         ///< of the mission's name; 0 without a fleet key
  uint32_t session_random;  ///< random bits, new with every start
  uint32_t contributions_per_robot;
  uint32_t picks;
  int64_t listen_us;
  int64_t frame_us;

  /// Of the indices of the maps. To be set at random where others are heard, who could choose
  /// blocks that shut out another one; maps do not depend on it [MapConfig].
  uint64_t hash_seed;

  /// What follows where a robot signed two contents of one version: 0 alarm, 1 exclude
  /// [ExchangeConfig].
  uint32_t conflicts;
  uint32_t reserved_2;  ///< 0

  /// The part of the local map around the robot that is kept in memory [WindowConfig]; radius 0:
  /// all of it is. Needs the callbacks of the archive, which may hold so many blocks.
  double window_radius_m;
  double window_hysteresis_m;
  uint32_t archived_blocks;
  uint32_t reserved_3;  ///< 0

  /// Submaps that the robot may map into, from 2; 0: one map, and no other field of submaps counts.
  /// With submaps there are two local maps of local_bytes that take turns, and no window. What ends
  /// one, beside submap_length_m and tessera_new_submap: so long a time, or so far a jump of the
  /// sensor between two scans; 0: neither [RobotSettings, SubmapCuts].
  uint32_t most_submaps;
  uint32_t first_submap;  ///< number of the first one
  int64_t submap_time_us;
  double submap_jump_m;

  /// What others have published is held where it is this near to the robot or to its route
  /// (tessera_set_route), and of the rest what there is room for; of so many contributions a
  /// description alone. 0: of all, what there is room for [RobotSettings, ExchangeConfig].
  double reach_m;
  uint32_t far_contributions;

  /// How free space is found [FreeSpaceConfig]: TESSERA_CARVING_RAYS or TESSERA_CARVING_IMAGE. With
  /// the image, neighbour_pixels is what neighbour_angle_rad is with rays.
  uint32_t carving;
  uint32_t neighbour_pixels;  ///< 0 .. 8
  /// Of the boxes of the robot's own body that follow, those that count. A scan of a sensor in one
  /// of them is refused, as with a bad pose [RobotBody].
  uint32_t body_boxes;                     ///< 0 .. TESSERA_MOST_BODY_BOXES
  float body[TESSERA_MOST_BODY_BOXES][6];  ///< low x y z, high x y z, metres, body's frame
  /// How far directions from which nothing came back free space; 0: they free nothing
  /// [InferenceConfig].
  float no_return_range_m;
  /// Objections to what others have and this robot has seen through that are followed, at most
  /// 16384; 0: it makes none, and answers none [RobotSettings, Objections].
  uint32_t objections;
  /// How much larger than they say other robots are taken to be, 0 .. 2 [RobotSettings].
  double teammate_margin_m;
  /// 1: a robot's labels count by how reliable they are; and under which reliability, from 0 to 1,
  /// a robot and its classes are named [DiffusionConfig].
  uint32_t weigh_robots;
  float reliability_alarm;
  /// Of TESSERA_LATTICE: of all classes; 0: each has its own [LatticeConfig].
  float lattice_reach_m;
  float lattice_height_m;
  /// Of the class at each place of the table; 0: by its name, and then both are. With
  /// lattice_reach_m they are of no account [ClassKernel].
  float class_reach_m[TESSERA_MOST_CLASSES];
  float class_height_m[TESSERA_MOST_CLASSES];
  /// How the frames of a team are known: TESSERA_FRAMES_GIVEN, TESSERA_FRAMES_REFINED or
  /// TESSERA_FRAMES_FOUND, which takes 17 MB more, with over 16 robots up to 19 MB, and 32 bytes
  /// for each of replica_blocks; robots that are placed, 1 .. 64; and, of refined ones, standard
  /// deviations of T_global_map along each axis, 0 .. 100 m, and about each, 0 .. 1 rad: both 0 for
  /// an exact one [FramesConfig].
  uint32_t frames;
  uint32_t frame_robots;
  double frame_sigma_m;
  double frame_sigma_rad;
} tessera_config;

/// The least struct_bytes that is taken, up to and with the inference's settings: fields beyond
/// have their defaults.
#define TESSERA_CONFIG_LEAST_BYTES offsetof(tessera_config, publisher_blocks)

/// A class 1 .. C, by its place in the table.
typedef struct tessera_class {
  char name[32];  ///< UTF-8, at most 31 bytes, then zeros
  uint8_t red;
  uint8_t green;
  uint8_t blue;
  uint8_t moves;  ///< such things may move: 1 yes, 2 no, 0 by the name (vehicles, people, animals)
} tessera_class;

/// Functions of the program. All are called with context, only from calls of the program's, on
/// their thread; what they name must outlive the robot. A group whose functions are all NULL is
/// left out. None of them may call back into this library, and what they take of the stack comes on
/// top.
typedef struct tessera_callbacks {
  uint32_t struct_bytes;  ///< sizeof(tessera_callbacks)
  uint32_t reserved;      ///< 0

  /// Microseconds since any zero, never fewer than the last time; for deadlines. Beyond
  /// TESSERA_MOST_TIME_US they count as that.
  void* clock_context;
  int64_t (*now_us)(void* context);

  /// How datagrams are tagged and checked; default: a checksum, which finds damage and stops
  /// nobody. check_tag: 1 iff tag is what tag_message fills in for the message.
  void* tag_context;
  void (*tag_message)(void* context, const uint8_t* message, size_t bytes,
                      uint8_t tag[TESSERA_TAG_BYTES]);
  int32_t (*check_tag)(void* context, const uint8_t* message, size_t bytes,
                       const uint8_t tag[TESSERA_TAG_BYTES]);

  /// With these no robot can speak for another; default: none, and then the whole fleet has none.
  /// check_signature: 1 iff that robot signed the message.
  void* signature_context;
  void (*sign)(void* context, const uint8_t* message, size_t bytes,
               uint8_t signature[TESSERA_SIGNATURE_BYTES]);
  int32_t (*check_signature)(void* context, uint32_t robot, const uint8_t* message, size_t bytes,
                             const uint8_t signature[TESSERA_SIGNATURE_BYTES]);
  void (*hash)(void* context, const uint8_t* message, size_t bytes,
               uint8_t hash[TESSERA_HASH_BYTES]);

  /// Keeps the bytes of blocks that leave the window, by their keys; called while scans are
  /// integrated, and while the map is saved. put_block: instead of what it keeps of the block; 1:
  /// they are kept. get_block: how many bytes it gave, all that were put; 0: they cannot be had.
  /// drop_block, clear_blocks: they are not needed any more, nor any others.
  void* archive_context;
  int32_t (*put_block)(void* context, uint64_t key, const uint8_t* bytes, size_t count);
  size_t (*get_block)(void* context, uint64_t key, uint8_t* into, size_t capacity);
  void (*drop_block)(void* context, uint64_t key);
  void (*clear_blocks)(void* context);
} tessera_callbacks;

/// The least struct_bytes that is taken: what programs of version 1 have.
#define TESSERA_CALLBACKS_LEAST_BYTES (offsetof(tessera_callbacks, hash) + sizeof(void*))
