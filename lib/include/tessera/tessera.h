// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The library for C programs (C99): a robot from scan to global map, in memory that the program
// gives. docs/tasks/embedding.md shows how.
//
// Every function returns how it ended; it refuses NULL, memory that is no robot, a struct_bytes
// under the least that the struct may have or in no whole eights (fours where pointers have four
// bytes), and times beyond TESSERA_MOST_TIME_US of zero with TESSERA_INVALID_ARGUMENT, and then
// nothing was changed. Only what is named beside that is said with each. Nothing allocates, waits,
// or reads a clock but the one that was given.
//
// A robot is for one thread at a time; other threads have a tessera_reader each.
//
// Structs begin with their size. Newer versions of this library append fields to those, and add
// functions; a program that was compiled with an older header goes on working, as long as
// tessera_abi_version() is its TESSERA_ABI_VERSION. A report is filled as far as the caller's
// struct_bytes goes, which says afterwards how much was filled. The least struct_bytes is 8 of a
// report, and TESSERA_CONFIG_LEAST_BYTES, TESSERA_SCAN_LEAST_BYTES, TESSERA_CALLBACKS_LEAST_BYTES
// of these. One that is more than this library knows is taken of reports, and is
// TESSERA_UNSUPPORTED of what the program hands over.
#pragma once

#include "tessera/c/config.h"
#include "tessera/c/frames.h"
#include "tessera/c/queries.h"
#include "tessera/c/report.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Higher with every function or field that was added.
#define TESSERA_API_VERSION 1u
/// Another one with every change that programs which are compiled already do not bear.
#define TESSERA_ABI_VERSION 1u

/// Those of the library that the program was linked with.
uint32_t tessera_api_version(void);
uint32_t tessera_abi_version(void);
/// As "0.1.0". Static.
const char* tessera_version(void);
/// A short phrase, for messages; for any number. Static.
const char* tessera_status_text(uint32_t status);

// --- Making ---------------------------------------------------------------------------------

/// Fills in the defaults. struct_bytes: sizeof(tessera_config). TESSERA_UNSUPPORTED iff it is more
/// than this library knows.
tessera_status tessera_config_init(tessera_config* config, uint32_t struct_bytes);
/// The memory that a robot takes. Fails with TESSERA_INVALID_ARGUMENT iff a setting is out of its
/// range or num_classes is not 1 .. TESSERA_MOST_CLASSES; TESSERA_UNSUPPORTED as above.
tessera_status tessera_required_bytes(const tessera_config* config, uint32_t num_classes,
                                      uint64_t* bytes);
/// Makes a robot in memory, which must be aligned to TESSERA_ALIGNMENT, stay where it is and be
/// nothing else's; callbacks: may be NULL. What is given is copied, but for what the callbacks'
/// contexts name. No function is there to end a robot: its memory may be used anew at any time.
/// Fails as tessera_required_bytes, and with TESSERA_INVALID_ARGUMENT iff memory is not aligned, a
/// class's moves is over 2, a class's kernel has a reach or a height alone or one that is out of
/// its range, a group of callbacks has some functions and lacks others, there is a deadline and no
/// clock, or a window and no archive; TESSERA_RESOURCE_EXHAUSTED iff bytes are too few. The memory
/// may hold anything then.
tessera_status tessera_robot_make(const tessera_config* config, const tessera_class* classes,
                                  uint32_t num_classes, const tessera_callbacks* callbacks,
                                  void* memory, uint64_t bytes, tessera_robot** robot);
/// Of its memory, what holds something and what is scratch. O(blocks of the global map).
tessera_status tessera_used_bytes(const tessera_robot* robot, uint64_t* bytes);

// --- Mapping --------------------------------------------------------------------------------

/// Integrates a scan into the local map. What is refused or left out is in the report, which may be
/// NULL. TESSERA_INVALID_ARGUMENT iff stride_floats is under 3, there are points and none are
/// given, or due_us is given and no clock was; what is wrong with a pose is in the report. Cost:
/// bounded by the work budget, or by due_us; docs/measured/timing.md.
tessera_status tessera_integrate(tessera_robot* robot, const tessera_scan* scan,
                                 tessera_scan_report* report);
/// The probabilities of a point's labels as weights for tessera_scan.label_weights, which sum to
/// their rounded sum. TESSERA_INVALID_ARGUMENT iff one is negative or not finite, they sum to over
/// 1.002 (the weights are 0 then), there are more than three, or an array is NULL.
tessera_status tessera_label_weights(const float* probabilities, uint32_t labels, uint8_t* weights);
/// Another work budget for scans from now on; 0: no limit.
tessera_status tessera_set_work_budget(tessera_robot* robot, uint64_t work);

// --- Sharing --------------------------------------------------------------------------------

/// Takes a datagram that arrived: any bytes, from anybody. What is refused is counted in the
/// exchange's report. now_us: monotonic, as everywhere below.
tessera_status tessera_receive(tessera_robot* robot, const void* datagram, size_t bytes,
                               int64_t now_us);
/// Publishes what has changed, and goes on with the global map (work_per_tick). To be called at an
/// even pace, every few tens of milliseconds. report: may be NULL.
tessera_status tessera_tick(tessera_robot* robot, int64_t now_us, tessera_tick_report* report);
/// The next datagram to send to all, in into; its size in bytes: 0 iff nothing is due now. To be
/// called until it is 0. TESSERA_INVALID_ARGUMENT iff capacity is under
/// TESSERA_MOST_DATAGRAM_BYTES.
tessera_status tessera_send(tessera_robot* robot, int64_t now_us, void* into, size_t capacity,
                            size_t* bytes);
/// Goes on with the global map until it is up to date or so much work is done; done may be NULL.
tessera_status tessera_fuse(tessera_robot* robot, uint64_t work, uint64_t* done);
/// 1 iff nothing waits to be published or fused, and there were ticks since the last scan.
tessera_status tessera_is_idle(const tessera_robot* robot, uint32_t* idle);
/// Places to which the robot is going, 3 numbers each in metres of the global frame: what others
/// have published within reach_m of the first 15 of them is held as what is near the robot is. They
/// replace those of before; count 0: none. TESSERA_INVALID_ARGUMENT iff a number is not finite.
tessera_status tessera_set_route(tessera_robot* robot, uint32_t count, const double* p_global);
/// Says with the next datagram that this robot says no more.
tessera_status tessera_leave(tessera_robot* robot);
/// Takes all of another robot out of the global map, and hears it no more. TESSERA_INVALID_ARGUMENT
/// iff it is this one; TESSERA_RESOURCE_EXHAUSTED iff sixteen are excluded.
tessera_status tessera_exclude(tessera_robot* robot, uint32_t excluded);

/// The next scan is the first of another submap, with its own frame (12 numbers, [R | t], rows
/// first); the local map is empty then, and the old one is published whole by the next ticks, at
/// the latest after submap_ticks. A scan that comes while the submap before the old one is still
/// published is of the old one. Fails with TESSERA_INVALID_ARGUMENT iff most_submaps is 0, or it is
/// no rigid transform; TESSERA_BUSY iff one that was asked for has not begun.
tessera_status tessera_new_submap(tessera_robot* robot, const double* T_global_map);
/// Moves a submap of this start, with nothing sent anew but its frame. TESSERA_INVALID_ARGUMENT iff
/// there is no such submap, or it is no rigid transform.
tessera_status tessera_set_frame(tessera_robot* robot, uint32_t submap, const double* T_global_map);
/// Moves the submaps of this start to where a corrected trajectory has them; others receive
/// the frames alone. stamps_us: ascending, in the clock of tessera_scan's now_us. T_world_sensor:
/// 12 numbers for each, in the world that T_global_map of the configuration places. revision: above
/// that of the last correction. What came of it, tessera_submap says. TESSERA_INVALID_ARGUMENT, and
/// nothing was changed, iff count is 0, stamps do not ascend, a pose is not rigid or over 524 km
/// away, or the revision is not above. O(submaps log(count) + count).
tessera_status tessera_correct(tessera_robot* robot, uint32_t revision, uint32_t count,
                               const int64_t* stamps_us, const double* T_world_sensor);
/// The same by frames of submaps: each of a submap of this start, and none twice.
tessera_status tessera_correct_frames(tessera_robot* robot, uint32_t revision, uint32_t count,
                                      const uint32_t* submaps, const double* T_world_map);

// --- Maps of earlier days -------------------------------------------------------------------
//
// A map file, of this or another robot, is shared beside the robot's own map. Its evidence is
// multiplied by a weight and counts once, however many robots load the same file; of all together
// no more than a quarter of max_evidence counts in a voxel (docs/design/theory.md). Those of an
// earlier epoch of this robot end when it starts.

/// Memory that tessera_open_session needs for the file. read: as tessera_load_map. Fails with
/// TESSERA_TRUNCATED, TESSERA_CORRUPT, TESSERA_UNSUPPORTED.
tessera_status tessera_session_bytes(tessera_robot* robot,
                                     size_t (*read)(void* context, uint8_t* into, size_t capacity),
                                     void* context, uint64_t* bytes);
/// Reads the file, from its begin, into memory, which must be aligned to TESSERA_ALIGNMENT and stay
/// until all is published. weight: above 0, at most 1; date_s: of the map; T_global_map: 12
/// numbers, rows first, or NULL: the identity. Fails as tessera_session_bytes, and with
/// TESSERA_BUSY iff another one is being published; TESSERA_MISMATCH iff resolution, classes or the
/// weight of a free pass are not the robot's; TESSERA_UNSUPPORTED iff the file is in submaps, or
/// the robot does not know its own frame (frames is TESSERA_FRAMES_FOUND, or TESSERA_FRAMES_REFINED
/// and not exact), before the file is read;
/// TESSERA_INVALID_ARGUMENT iff one with its content is shared, or it is no frame;
/// TESSERA_RESOURCE_EXHAUSTED iff bytes are too few, 8 are shared, 16 were opened, or there is no
/// place for a contribution. O(file).
tessera_status tessera_open_session(tessera_robot* robot,
                                    size_t (*read)(void* context, uint8_t* into, size_t capacity),
                                    void* context, void* memory, uint64_t bytes, double weight,
                                    int64_t date_s, const double* T_global_map, uint32_t* number);
/// Publishes the next blocks of the session that was opened last; left: how many are left. Once it
/// is 0 the memory is free. Fails with TESSERA_INVALID_ARGUMENT iff none is left to be published.
tessera_status tessera_publish_session(tessera_robot* robot, uint32_t blocks, uint32_t* left);
/// It counts no more; ticks free what it takes, here and with the others. TESSERA_INVALID_ARGUMENT
/// iff there is none of that number.
tessera_status tessera_remove_session(tessera_robot* robot, uint32_t number);
/// The session of that place, from 0. TESSERA_OUT_OF_RANGE iff there are not so many.
tessera_status tessera_session_at(const tessera_robot* robot, uint32_t index,
                                  tessera_session* session);

// --- The transform between two maps ----------------------------------------------------------

/// Searches, in memory of its own. For one thread at a time.
typedef struct tessera_frame_finder tessera_frame_finder;

/// A short phrase, for messages; for any number. Static.
const char* tessera_frame_verdict_text(uint32_t verdict);
tessera_status tessera_frame_finder_bytes(uint64_t* bytes);
/// Makes a finder in memory, which must be aligned to TESSERA_ALIGNMENT and stay where it is. It
/// may be used anew at any time. TESSERA_RESOURCE_EXHAUSTED iff bytes are too few.
tessera_status tessera_frame_finder_make(void* memory, uint64_t bytes,
                                         tessera_frame_finder** finder);
/// Starts a search for T_a_b between a map of a and a map of b, which may be one robot. Neither may
/// be worked on until a step says TESSERA_FRAME_SEARCHING or TESSERA_FRAME_DONE; with a window or
/// in submaps, what is in memory counts. T_a_b_guess: 12 numbers, rows first: within 10 m in x and
/// y, 3 m in z and 20 degrees; or NULL: any heading, within 72 m in x and y and 12 m in z of where
/// the frames put the maps, if those are known of both, else of the identity. Fails, and an earlier
/// search goes on, with TESSERA_BUSY iff a global map is not settled; TESSERA_INVALID_ARGUMENT iff
/// the guess is not rigid.
tessera_status tessera_frame_finder_begin(tessera_frame_finder* finder, const tessera_robot* a,
                                          uint32_t map_a, const tessera_robot* b, uint32_t map_b,
                                          const double* T_a_b_guess);
/// The next piece of work, which is bounded [FrameFinder::step]. state: TESSERA_FRAME_READING, ...
/// TESSERA_INVALID_ARGUMENT iff no search was begun.
tessera_status tessera_frame_finder_step(tessera_frame_finder* finder, uint32_t* state);
/// TESSERA_BUSY iff the search is not done; TESSERA_INVALID_ARGUMENT iff none was begun.
tessera_status tessera_frame_finder_answer(const tessera_frame_finder* finder,
                                           tessera_frame_answer* answer);

// --- Reports --------------------------------------------------------------------------------

tessera_status tessera_submap(const tessera_robot* robot, tessera_submap_report* report);
/// Zeros without a window.
tessera_status tessera_window(const tessera_robot* robot, tessera_window_report* report);
tessera_status tessera_global(const tessera_robot* robot, tessera_global_report* report);
tessera_status tessera_objections(const tessera_robot* robot, tessera_objections_report* report);
/// What the others say of the labels of a robot, of all of them or, with a label 1 .. C, of one
/// class; complete once the global map is not busy. TESSERA_OUT_OF_RANGE iff nothing of that robot
/// is there, or there is no such class.
tessera_status tessera_reliability(const tessera_robot* robot, uint32_t of_robot, uint32_t label,
                                   tessera_reliability_report* report);
tessera_status tessera_exchange(const tessera_robot* robot, tessera_exchange_report* report);
/// The robot of that place, from 0, among those that said lately where they are. Scans leave out
/// what they met of it. TESSERA_OUT_OF_RANGE iff there are not so many.
tessera_status tessera_teammate_at(const tessera_robot* robot, uint32_t index, int64_t now_us,
                                   tessera_teammate* teammate);
/// The robot of that place, from 0, of a team whose frames are found, by ascending number; this
/// robot is among them. TESSERA_OUT_OF_RANGE iff there are not so many, or frames are given.
tessera_status tessera_placed_robot_at(const tessera_robot* robot, uint32_t index,
                                       tessera_placed_robot* placed);
/// The contribution of that place, from 0. TESSERA_OUT_OF_RANGE iff there are not so many.
tessera_status tessera_contribution_at(const tessera_robot* robot, uint32_t index,
                                       tessera_contribution* contribution);

// --- Files ----------------------------------------------------------------------------------

/// Memory that the next two need for as much as the map holds now. With a window the local map's
/// file and digest are those of all of it, archived blocks included, which are read 2 and 64 times.
tessera_status tessera_workspace_bytes(const tessera_robot* robot, uint32_t map, uint64_t* bytes);
/// The map's content in 64 bits: the same for the same voxels, however they came there. workspace:
/// aligned to eight. TESSERA_RESOURCE_EXHAUSTED iff it is too small; TESSERA_BUSY as above.
tessera_status tessera_map_digest(const tessera_robot* robot, uint32_t map, void* workspace,
                                  uint64_t workspace_bytes, uint64_t* digest);
/// Writes the map as a map file (.tsm), in pieces; write: 1 iff it took them all, in order. Fails
/// as tessera_map_digest, and with TESSERA_IO iff write did not.
tessera_status tessera_save_map(tessera_robot* robot, uint32_t map, void* workspace,
                                uint64_t workspace_bytes,
                                int32_t (*write)(void* context, const uint8_t* bytes, size_t count),
                                void* context);
/// Reads a map file into the local map, which must be empty, with nothing archived; read: how many
/// bytes it gave, fewer than asked for at the end only. Fails with TESSERA_MISMATCH iff it is of
/// another configuration or the map is not empty, TESSERA_TRUNCATED, TESSERA_CORRUPT,
/// TESSERA_UNSUPPORTED; and TESSERA_RESOURCE_EXHAUSTED iff it does not fit: the map is empty then.
tessera_status tessera_load_map(tessera_robot* robot,
                                size_t (*read)(void* context, uint8_t* into, size_t capacity),
                                void* context);

/// A program may define void tessera_assert_failed(const char* expression, const char* file, int
/// line), which must not return: it is called where the library was built with TESSERA_ASSERTS and
/// finds a bug, its own or the program's. Without it the library traps.

#ifdef __cplusplus
}
#endif
