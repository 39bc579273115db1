// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// All that an embedded program does, in C, with static memory, without the C++ library: two robots
// map and exchange until they have the same global map; queries; submaps; files.
#include <math.h>
#include <string.h>

#include "support.h"

static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
static const double shifted[12] = {1, 0, 0, 2.0, 0, 1, 0, 0, 0, 0, 1, 0};
static uint64_t workspace[1u << 17];

static void finish(tessera_robot* robot) {
  uint64_t done = 0;
  do {
    CHECK_STATUS(TESSERA_OK, tessera_fuse(robot, 1000000, &done));
  } while (done != 0);
}

static void test_queries(const tessera_robot* robot, uint32_t map) {
  const float road[3] = {3.1F, 0.1F, 0.1F};
  const float points[9] = {3.1F, 0.1F, 0.1F, 10.7F, 0.1F, 1.1F, 0.1F, 0.1F, 900.0F};
  tessera_estimate estimate;
  tessera_estimate many[3];
  CHECK_STATUS(TESSERA_OK, tessera_query(robot, map, road, &estimate));
  CHECK(estimate.state == TESSERA_OCCUPIED && estimate.label == 1);
  CHECK(estimate.probability > 0.5 && estimate.probability <= 1.0);
  CHECK_STATUS(TESSERA_OK, tessera_query_many(robot, map, points, 3, many));
  CHECK(memcmp(&many[0], &estimate, sizeof(estimate)) == 0);
  CHECK(many[1].label == 2 && many[2].state == TESSERA_UNKNOWN);

  const float origin[3] = {0.1F, 0.1F, 1.1F};
  const float ahead[3] = {1.0F, 0.0F, 0.0F};
  tessera_ray_hit hit;
  CHECK_STATUS(TESSERA_OK, tessera_cast_ray(robot, map, origin, ahead, 30.0, 0, &hit));
  CHECK(hit.end == TESSERA_RAY_OCCUPIED && hit.estimate.label == 2);
  CHECK(hit.distance_m > 9.0 && hit.distance_m < 12.0);
  CHECK_STATUS(TESSERA_OK, tessera_cast_ray(robot, map, origin, ahead, 5.0, 0, &hit));
  CHECK(hit.end == TESSERA_RAY_MAX_RANGE);

  const float off_wall[3] = {9.5F, 0.1F, 1.1F};
  tessera_nearest nearest;
  CHECK_STATUS(TESSERA_OK, tessera_nearest_occupied(robot, map, off_wall, 5.0, 10000, &nearest));
  CHECK(nearest.found == 1 && nearest.distance_m > 0.2 && nearest.distance_m < 2.0);
  CHECK(nearest.complete == 1 && nearest.searched_m == nearest.distance_m);
  // Too far from all: however much work is spent, it is said how far that reached.
  const float far_off[3] = {0.1F, 0.1F, 400.0F};
  double searched_m = -1.0;
  for (uint32_t max_work = 1; max_work <= 100000; max_work *= 10) {
    CHECK_STATUS(TESSERA_OK,
                 tessera_nearest_occupied(robot, map, far_off, 300.0, max_work, &nearest));
    CHECK(nearest.found == 0 && nearest.complete == 0);
    CHECK(nearest.searched_m >= searched_m && nearest.searched_m < 300.0);
    searched_m = nearest.searched_m;
  }
  CHECK(searched_m > 30.0);
  CHECK_STATUS(TESSERA_OK, tessera_nearest_occupied(robot, map, far_off, 3.0, 1000, &nearest));
  CHECK(nearest.found == 0 && nearest.complete == 1 && nearest.searched_m > 2.999);
}

/// The probabilities of free, road, building and occupied without a class; one is the label's.
static void test_probabilities(tessera_reader* reader, uint32_t map) {
  enum { COMPONENTS = 4 };
  // On the road, on the building, out of the grid.
  const float points[9] = {3.1F, 0.1F, 0.1F, 10.7F, 0.1F, 1.1F, 0.1F, 0.1F, 1e9F};
  tessera_reader unmade = {{0}};
  double all[COMPONENTS + 1] = {0.0, 0.0, 0.0, 0.0, -1.0};
  for (int i = 0; i < 3; ++i) {
    tessera_estimate estimate;
    CHECK_STATUS(TESSERA_OK, tessera_reader_query(reader, map, points + 3 * i, &estimate));
    CHECK_STATUS(TESSERA_OK,
                 tessera_reader_probabilities(reader, map, points + 3 * i, all, COMPONENTS + 1));
    double sum = 0.0;
    for (int l = 0; l < COMPONENTS; ++l) sum += all[l];
    CHECK(fabs(sum - 1.0) < 1e-12 && all[COMPONENTS] == -1.0);
    CHECK(estimate.label == (i < 2 ? i + 1 : 0));
    if (i < 2) CHECK(all[estimate.label] == estimate.probability);
    if (i == 2) CHECK(all[0] == 0.25 && all[3] == 0.25);
  }
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT,
               tessera_reader_probabilities(reader, map, points, all, COMPONENTS - 1));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT,
               tessera_reader_probabilities(NULL, map, points, all, COMPONENTS));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT,
               tessera_reader_probabilities(&unmade, map, points, all, COMPONENTS));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT,
               tessera_reader_probabilities(reader, map, NULL, all, COMPONENTS));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT,
               tessera_reader_probabilities(reader, map, points, NULL, COMPONENTS));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT,
               tessera_reader_probabilities(reader, 2, points, all, COMPONENTS));
}

/// The voxels of a box, however many are asked for at once, are those that have evidence.
static void test_box(const tessera_robot* robot, uint32_t map) {
  static tessera_voxel voxels[1024];
  const float boxes[2][6] = {{2.0F, -2.0F, -1.0F, 4.0F, 2.0F, 1.0F},
                             {-1e9F, -1e9F, -1e9F, 1e9F, 1e9F, 1e9F}};
  const uint32_t capacities[3] = {1024, 100, 1};
  for (int box = 0; box < 2; ++box) {
    uint64_t totals[3] = {0, 0, 0};
    uint64_t sums[3] = {0, 0, 0};
    for (int i = 0; i < 3; ++i) {
      tessera_box_cursor cursor;
      CHECK_STATUS(TESSERA_OK, tessera_box_begin(robot, map, boxes[box], boxes[box] + 3, &cursor));
      while (cursor.done == 0) {
        uint32_t count = 0;
        CHECK_STATUS(TESSERA_OK, tessera_box_next(robot, &cursor, voxels, capacities[i], &count));
        CHECK(count <= capacities[i]);
        for (uint32_t n = 0; n < count; ++n) {
          const float centre[3] = {(float)((voxels[n].x + 0.5) * 0.2),
                                   (float)((voxels[n].y + 0.5) * 0.2),
                                   (float)((voxels[n].z + 0.5) * 0.2)};
          tessera_estimate estimate;
          CHECK_STATUS(TESSERA_OK, tessera_query(robot, map, centre, &estimate));
          CHECK(memcmp(&estimate, &voxels[n].estimate, sizeof(estimate)) == 0);
          CHECK(estimate.state != TESSERA_UNKNOWN);
          sums[i] += (uint64_t)voxels[n].x * 73856093u ^ (uint64_t)voxels[n].y * 19349663u ^
                     (uint64_t)voxels[n].z * 83492791u;
        }
        totals[i] += count;
      }
    }
    CHECK(totals[0] > 100 && totals[1] == totals[0] && totals[2] == totals[0]);
    CHECK(sums[1] == sums[0] && sums[2] == sums[0]);
  }
}

static void test_files(tessera_robot* robot, const tessera_config* config) {
  uint64_t bytes = 0;
  CHECK_STATUS(TESSERA_OK, tessera_workspace_bytes(robot, TESSERA_LOCAL_MAP, &bytes));
  CHECK(bytes > 0 && bytes <= sizeof(workspace));
  file.room = sizeof(file.bytes);
  CHECK_STATUS(TESSERA_OK, tessera_save_map(robot, TESSERA_LOCAL_MAP, workspace, sizeof(workspace),
                                            write_to_file, &file));
  CHECK(file.written > 1000);

  tessera_robot* again = small_robot(5, config, NULL);
  file.read = 0;
  CHECK_STATUS(TESSERA_OK, tessera_load_map(again, read_from_file, &file));
  CHECK(map_digest_of(again, TESSERA_LOCAL_MAP) == map_digest_of(robot, TESSERA_LOCAL_MAP));
  file.read = 0;
  CHECK_STATUS(TESSERA_MISMATCH, tessera_load_map(again, read_from_file, &file));

  again = small_robot(5, config, NULL);
  file.bytes[file.written / 2] ^= 1;
  file.read = 0;
  CHECK_STATUS(TESSERA_CORRUPT, tessera_load_map(again, read_from_file, &file));
  file.bytes[file.written / 2] ^= 1;
  const size_t whole = file.written;
  file.written = whole / 2;
  file.read = 0;
  CHECK_STATUS(TESSERA_TRUNCATED, tessera_load_map(again, read_from_file, &file));
  file.written = 0;
  file.room = 100;
  CHECK_STATUS(TESSERA_IO, tessera_save_map(robot, TESSERA_LOCAL_MAP, workspace, sizeof(workspace),
                                            write_to_file, &file));
  CHECK_STATUS(TESSERA_RESOURCE_EXHAUSTED,
               tessera_save_map(robot, TESSERA_LOCAL_MAP, workspace, 8, write_to_file, &file));
}

static void test_submaps(tessera_robot* a, tessera_robot* b, int64_t* now_us) {
  tessera_submap_report submap = {.struct_bytes = sizeof(submap)};
  tessera_map_usage usage = {.struct_bytes = sizeof(usage)};
  integrate_street(a, 0.4, 0.0);
  CHECK_STATUS(TESSERA_OK, tessera_map_usage_of(a, TESSERA_LOCAL_MAP, &usage));
  const uint64_t blocks = usage.blocks;
  CHECK_STATUS(TESSERA_OK, tessera_new_submap(a, shifted));
  CHECK_STATUS(TESSERA_BUSY, tessera_new_submap(a, shifted));
  CHECK_STATUS(TESSERA_OK, tessera_submap(a, &submap));
  CHECK(submap.mapping == 0 && submap.submap == 0);
  integrate_street(a, 0.0, 4.0);
  CHECK_STATUS(TESSERA_OK, tessera_map_usage_of(a, TESSERA_LOCAL_MAP, &usage));
  CHECK(usage.blocks != 0 && usage.blocks <= blocks);
  CHECK_STATUS(TESSERA_OK, tessera_submap(a, &submap));
  CHECK(submap.mapping == 1 && submap.submap == 0);
  CHECK(exchange_until_equal(a, b, now_us, 400, 0) <= 400);
  CHECK_STATUS(TESSERA_OK, tessera_submap(a, &submap));
  CHECK(submap.ending == 0 && submap.submap == 1 && submap.opened == 1);
  CHECK(submap.lost_blocks == 0 && submap.cut_short == 0 && submap.last == TESSERA_OK);

  CHECK(exchange_until_equal(a, b, now_us, 400, 7) <= 400);
  tessera_contribution contribution = {.struct_bytes = sizeof(contribution)};
  uint32_t of_a = 0;
  uint32_t index = 0;
  while (tessera_contribution_at(b, index, &contribution) == TESSERA_OK) {
    if (contribution.robot == 1) ++of_a;
    CHECK(contribution.complete == 1);
    ++index;
  }
  CHECK(index == 3 && of_a == 2);

  // The older submap goes where a pose graph wants it, the newer stays.
  const uint64_t before = map_digest_of(b, TESSERA_GLOBAL_MAP);
  CHECK_STATUS(TESSERA_OK, tessera_set_frame(a, 0, shifted));
  CHECK(exchange_until_equal(a, b, now_us, 400, 0) <= 400);
  finish(a);
  finish(b);
  CHECK(map_digest_of(b, TESSERA_GLOBAL_MAP) != before);
  CHECK(map_digest_of(a, TESSERA_GLOBAL_MAP) == map_digest_of(b, TESSERA_GLOBAL_MAP));
  CHECK_STATUS(TESSERA_OK, tessera_set_frame(a, 0, identity));
  CHECK(exchange_until_equal(a, b, now_us, 400, 0) <= 400);
  finish(b);
  CHECK(map_digest_of(b, TESSERA_GLOBAL_MAP) == before);

  const int64_t no_stamp = 0;
  const uint32_t unknown = 3;
  double mirrored[12] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  const tessera_status refused[] = {tessera_correct(a, 1, 0, &no_stamp, identity),
                                    tessera_correct(a, 1, 1, NULL, identity),
                                    tessera_correct(a, 1, 1, &no_stamp, NULL),
                                    tessera_correct(a, 1, 1, &no_stamp, mirrored),
                                    tessera_correct(a, 0, 1, &no_stamp, identity),
                                    tessera_correct_frames(a, 1, 0, &unknown, identity),
                                    tessera_correct_frames(a, 1, 1, NULL, identity),
                                    tessera_correct_frames(a, 1, 1, &unknown, NULL),
                                    tessera_correct_frames(a, 1, 1, &unknown, identity)};
  for (size_t i = 0; i < sizeof(refused) / sizeof(refused[0]); ++i)
    CHECK_STATUS(TESSERA_INVALID_ARGUMENT, refused[i]);

  // The same by corrections: of frames, then of poses at the times of the scans.
  const uint32_t first = 0;
  const int64_t stamps_us[2] = {-1, INT64_C(1) << 59};
  double poses[24];
  for (int i = 0; i < 24; ++i) poses[i] = shifted[i % 12];
  CHECK_STATUS(TESSERA_OK, tessera_correct_frames(a, 1, 1, &first, shifted));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_correct_frames(a, 1, 1, &first, shifted));
  CHECK_STATUS(TESSERA_OK, tessera_correct_frames(a, 2, 1, &first, identity));
  CHECK(exchange_until_equal(a, b, now_us, 400, 0) <= 400);
  finish(b);
  CHECK(map_digest_of(b, TESSERA_GLOBAL_MAP) == before);
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_correct(a, 2, 2, stamps_us, poses));
  CHECK_STATUS(TESSERA_OK, tessera_correct(a, 3, 2, stamps_us, poses));
  CHECK(exchange_until_equal(a, b, now_us, 400, 0) <= 400);
  finish(a);
  finish(b);
  CHECK(map_digest_of(b, TESSERA_GLOBAL_MAP) != before);
  CHECK(map_digest_of(a, TESSERA_GLOBAL_MAP) == map_digest_of(b, TESSERA_GLOBAL_MAP));
  CHECK_STATUS(TESSERA_OK, tessera_submap(a, &submap));
  CHECK(submap.revision == 3 && submap.corrections == 3 && submap.refused_corrections == 5);
}

int main(void) {
  tessera_config config_a = small_config(1);
  config_a.most_submaps = 3;
  const tessera_config config_b = small_config(2);
  tessera_robot* a = small_robot(0, &config_a, NULL);
  tessera_robot* b = small_robot(1, &config_b, NULL);
  int64_t now_us = 0;

  integrate_street(a, 0.0, 0.0);
  integrate_street(b, 0.0, 2.0);
  CHECK(digest_of(a) != digest_of(b));
  const int ticks = exchange_until_equal(a, b, &now_us, 400, 5);
  CHECK(ticks <= 400);
  CHECK(map_digest_of(a, TESSERA_GLOBAL_MAP) == map_digest_of(b, TESSERA_GLOBAL_MAP));
  CHECK(map_digest_of(a, TESSERA_GLOBAL_MAP) != map_digest_of(a, TESSERA_LOCAL_MAP));
  if (failures == 0)
    printf("PASS one global map after %d ticks, one datagram of five lost\n", ticks);

  test_queries(a, TESSERA_LOCAL_MAP);
  test_queries(b, TESSERA_GLOBAL_MAP);
  if (failures == 0) printf("PASS queries\n");
  test_box(a, TESSERA_LOCAL_MAP);
  test_box(b, TESSERA_GLOBAL_MAP);
  if (failures == 0) printf("PASS boxes\n");

  tessera_reader reader;
  tessera_estimate of_reader;
  tessera_estimate of_robot;
  const float road[3] = {3.1F, 0.1F, 0.1F};
  CHECK_STATUS(TESSERA_OK, tessera_reader_make(a, &reader));
  for (uint32_t map = TESSERA_LOCAL_MAP; map <= TESSERA_GLOBAL_MAP; ++map) {
    CHECK_STATUS(TESSERA_OK, tessera_reader_query(&reader, map, road, &of_reader));
    CHECK_STATUS(TESSERA_OK, tessera_query(a, map, road, &of_robot));
    CHECK(memcmp(&of_reader, &of_robot, sizeof(of_robot)) == 0);
    test_probabilities(&reader, map);
  }
  if (failures == 0) printf("PASS a reader's estimates\n");

  test_files(a, &config_a);
  if (failures == 0) printf("PASS files\n");
  test_submaps(a, b, &now_us);
  if (failures == 0) printf("PASS submaps\n");

  tessera_exchange_report exchange = {.struct_bytes = sizeof(exchange)};
  CHECK_STATUS(TESSERA_OK, tessera_exclude(b, 1));
  finish(b);
  CHECK_STATUS(TESSERA_OK, tessera_exchange(b, &exchange));
  CHECK(exchange.contributions == 1);
  CHECK_STATUS(TESSERA_OK, tessera_leave(a));
  if (failures == 0) printf("PASS a robot excluded\n");
  if (failures == 0) printf("PASS all\n");
  return failures == 0 ? 0 : 1;
}
