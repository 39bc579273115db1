// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Every function that works with a robot refuses what it cannot work with, and says so.
#include <math.h>
#include <string.h>

#include "support.h"

#define REFUSED(call) CHECK((call) == TESSERA_INVALID_ARGUMENT)

static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
static const double mirrored[12] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
static uint64_t workspace[1u << 15];
static int32_t take_all(void* context, const uint8_t* bytes, size_t count) {
  (void)context;
  (void)bytes;
  (void)count;
  return 1;
}
static size_t give_none(void* context, uint8_t* into, size_t capacity) {
  (void)context;
  (void)into;
  (void)capacity;
  return 0;
}
static size_t give_too_much(void* context, uint8_t* into, size_t capacity) {
  (void)context;
  (void)into;
  return capacity + 1;
}

static void test_handles(tessera_robot* robot) {
  uint8_t none[64] __attribute__((aligned(TESSERA_ALIGNMENT))) = {0};
  tessera_robot* const not_robots[3] = {NULL, (tessera_robot*)(void*)none,
                                        (tessera_robot*)(void*)((uint8_t*)robot + 1)};
  const float p[3] = {1, 2, 3};
  const tessera_scan scan = {.struct_bytes = sizeof(scan), .stride_floats = 3};
  tessera_estimate estimate;
  tessera_ray_hit hit;
  tessera_nearest nearest;
  tessera_box_cursor cursor;
  tessera_voxel voxel;
  tessera_reader reader = {{0}};
  tessera_map_usage usage = {.struct_bytes = sizeof(usage)};
  tessera_submap_report submap = {.struct_bytes = sizeof(submap)};
  tessera_global_report global = {.struct_bytes = sizeof(global)};
  tessera_exchange_report exchange = {.struct_bytes = sizeof(exchange)};
  tessera_contribution contribution = {.struct_bytes = sizeof(contribution)};
  uint8_t datagram[TESSERA_MOST_DATAGRAM_BYTES] = {0};
  uint64_t number = 0;
  uint32_t count = 0;
  const int64_t stamp_us = 0;
  size_t size = 0;
  CHECK_STATUS(TESSERA_OK, tessera_box_begin(robot, 0, p, p, &cursor));
  for (int i = 0; i < 3; ++i) {
    tessera_robot* const no = not_robots[i];
    REFUSED(tessera_used_bytes(no, &number));
    REFUSED(tessera_integrate(no, &scan, NULL));
    REFUSED(tessera_set_work_budget(no, 1));
    REFUSED(tessera_query(no, 0, p, &estimate));
    REFUSED(tessera_query_many(no, 0, p, 1, &estimate));
    REFUSED(tessera_cast_ray(no, 0, p, p, 1.0, 0, &hit));
    REFUSED(tessera_nearest_occupied(no, 0, p, 1.0, 999, &nearest));
    REFUSED(tessera_box_begin(no, 0, p, p, &cursor));
    REFUSED(tessera_box_next(no, &cursor, &voxel, 1, &count));
    REFUSED(tessera_map_usage_of(no, 0, &usage));
    REFUSED(tessera_reader_make(no, &reader));
    REFUSED(tessera_receive(no, datagram, sizeof(datagram), 0));
    REFUSED(tessera_tick(no, 0, NULL));
    REFUSED(tessera_send(no, 0, datagram, sizeof(datagram), &size));
    REFUSED(tessera_fuse(no, 1, NULL));
    REFUSED(tessera_is_idle(no, &count));
    REFUSED(tessera_leave(no));
    REFUSED(tessera_exclude(no, 7));
    REFUSED(tessera_new_submap(no, identity));
    REFUSED(tessera_set_frame(no, 0, identity));
    REFUSED(tessera_correct(no, 1, 1, &stamp_us, identity));
    REFUSED(tessera_correct_frames(no, 1, 1, &count, identity));
    REFUSED(tessera_submap(no, &submap));
    REFUSED(tessera_global(no, &global));
    REFUSED(tessera_exchange(no, &exchange));
    REFUSED(tessera_contribution_at(no, 0, &contribution));
    REFUSED(tessera_workspace_bytes(no, 0, &number));
    REFUSED(tessera_map_digest(no, 0, workspace, sizeof(workspace), &number));
    REFUSED(tessera_save_map(no, 0, workspace, sizeof(workspace), take_all, NULL));
    REFUSED(tessera_load_map(no, give_none, NULL));
  }
}

static void test_scans(tessera_robot* robot) {
  const float points[6] = {5, 0, 0, NAN, 0, 0};
  tessera_scan scan = {.struct_bytes = sizeof(scan),
                       .stride_floats = 3,
                       .points = points,
                       .count = 2,
                       .T_map_sensor = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
  tessera_scan_report report = {.struct_bytes = sizeof(report)};
  CHECK_STATUS(TESSERA_OK, tessera_integrate(robot, &scan, &report));
  CHECK(report.points == 2 && report.non_finite == 1 && report.struct_bytes == sizeof(report));
  struct {
    uint32_t struct_bytes;
    uint32_t pose;
    uint64_t beyond;
  } shorter = {8, 77, 99};
  CHECK_STATUS(TESSERA_OK, tessera_integrate(robot, &scan, (tessera_scan_report*)(void*)&shorter));
  CHECK(shorter.struct_bytes == 8 && shorter.pose == TESSERA_OK && shorter.beyond == 99);
  report.struct_bytes = 12;
  REFUSED(tessera_integrate(robot, &scan, &report));
  report.struct_bytes = sizeof(report) + 64;  // of a newer program
  CHECK_STATUS(TESSERA_OK, tessera_integrate(robot, &scan, &report));
  CHECK(report.struct_bytes == sizeof(report));
  memcpy(scan.T_map_sensor, mirrored, sizeof(mirrored));
  CHECK_STATUS(TESSERA_OK, tessera_integrate(robot, &scan, &report));
  CHECK(report.pose == TESSERA_INVALID_ARGUMENT);
  REFUSED(tessera_integrate(robot, NULL, &report));
  tessera_scan bad = scan;
  bad.struct_bytes = TESSERA_SCAN_LEAST_BYTES - 8;
  REFUSED(tessera_integrate(robot, &bad, NULL));
  bad.struct_bytes = sizeof(bad) + 8;
  CHECK_STATUS(TESSERA_UNSUPPORTED, tessera_integrate(robot, &bad, NULL));
  bad = scan;
  bad.stride_floats = 2;
  REFUSED(tessera_integrate(robot, &bad, NULL));
  bad = scan;
  bad.points = NULL;
  REFUSED(tessera_integrate(robot, &bad, NULL));
  bad = scan;
  bad.count = UINT64_MAX;
  REFUSED(tessera_integrate(robot, &bad, NULL));
  bad = scan;
  bad.due_us = 5;
  REFUSED(tessera_integrate(robot, &bad, NULL));
  report.struct_bytes = sizeof(report);
  memcpy(scan.T_map_sensor, identity, sizeof(identity));
  CHECK_STATUS(TESSERA_OK, tessera_set_work_budget(robot, 1));
  CHECK_STATUS(TESSERA_OK, tessera_integrate(robot, &scan, &report));
  CHECK(report.work_limit == 1 && report.left_out == 1 && report.refused_work == 1);
  CHECK_STATUS(TESSERA_OK, tessera_set_work_budget(robot, 0));
  integrate_street(robot, 0.0, 0.0);
  uint64_t number = 0;
  CHECK_STATUS(TESSERA_RESOURCE_EXHAUSTED, tessera_map_digest(robot, 0, workspace, 8, &number));
}

static void test_asking(tessera_robot* robot) {
  const float p[3] = {1, 2, 3};
  const float low[3] = {0, 0, 0};
  const float beyond[3] = {NAN, 2, 3};
  tessera_estimate estimate;
  tessera_ray_hit hit;
  tessera_nearest nearest;
  tessera_box_cursor cursor;
  tessera_voxel voxel;
  tessera_reader reader = {{0}};
  tessera_map_usage usage = {.struct_bytes = sizeof(usage)};
  uint32_t count = 0;
  REFUSED(tessera_query(robot, 2, p, &estimate));
  REFUSED(tessera_query(robot, 0, NULL, &estimate));
  REFUSED(tessera_query(robot, 0, p, NULL));
  CHECK_STATUS(TESSERA_OK, tessera_query(robot, 0, beyond, &estimate));
  CHECK(estimate.state == TESSERA_UNKNOWN);
  CHECK_STATUS(TESSERA_OK, tessera_query(robot, 1, beyond, &estimate));
  CHECK(estimate.state == TESSERA_UNKNOWN);
  CHECK_STATUS(TESSERA_OK, tessera_query_many(robot, 0, NULL, 0, NULL));
  REFUSED(tessera_cast_ray(robot, 2, low, p, 1.0, 0, &hit));
  REFUSED(tessera_cast_ray(robot, 0, NULL, p, 1.0, 0, &hit));
  REFUSED(tessera_cast_ray(robot, 0, low, NULL, 1.0, 0, &hit));
  REFUSED(tessera_cast_ray(robot, 0, low, p, 1.0, 0, NULL));
  CHECK_STATUS(TESSERA_OK, tessera_cast_ray(robot, 0, beyond, p, 1.0, 0, &hit));
  CHECK(hit.end == TESSERA_RAY_INVALID);
  REFUSED(tessera_nearest_occupied(robot, 2, p, 1.0, 999, &nearest));
  REFUSED(tessera_nearest_occupied(robot, 0, NULL, 1.0, 999, &nearest));
  REFUSED(tessera_nearest_occupied(robot, 0, p, 1.0, 999, NULL));
  REFUSED(tessera_nearest_occupied(robot, 0, p, 0.0, 999, &nearest));
  REFUSED(tessera_nearest_occupied(robot, 0, p, 1e9, 999, &nearest));
  REFUSED(tessera_nearest_occupied(robot, 0, p, (double)NAN, 999, &nearest));
  CHECK_STATUS(TESSERA_OUT_OF_RANGE,
               tessera_nearest_occupied(robot, 0, beyond, 1.0, 999, &nearest));
  REFUSED(tessera_nearest_occupied(robot, 0, p, 1.0, 0, &nearest));
  REFUSED(tessera_nearest_occupied(robot, 0, p, 1.0, (1u << 30) + 1, &nearest));
  REFUSED(tessera_box_begin(robot, 2, low, p, &cursor));
  REFUSED(tessera_box_begin(robot, 0, NULL, p, &cursor));
  REFUSED(tessera_box_begin(robot, 0, low, NULL, &cursor));
  REFUSED(tessera_box_begin(robot, 0, low, p, NULL));
  REFUSED(tessera_box_begin(robot, 0, p, low, &cursor));
  REFUSED(tessera_box_begin(robot, 0, beyond, p, &cursor));
  CHECK_STATUS(TESSERA_OK, tessera_box_begin(robot, 0, low, p, &cursor));
  REFUSED(tessera_box_next(robot, NULL, &voxel, 1, &count));
  REFUSED(tessera_box_next(robot, &cursor, NULL, 1, &count));
  REFUSED(tessera_box_next(robot, &cursor, &voxel, 0, &count));
  REFUSED(tessera_box_next(robot, &cursor, &voxel, 1, NULL));
  tessera_box_cursor bad = cursor;
  bad.map = 2;
  REFUSED(tessera_box_next(robot, &bad, &voxel, 1, &count));
  bad = cursor;
  bad.next = 4096;
  REFUSED(tessera_box_next(robot, &bad, &voxel, 1, &count));
  bad = cursor;
  bad.low[0] = INT32_MIN;
  REFUSED(tessera_box_next(robot, &bad, &voxel, 1, &count));
  bad = cursor;
  bad.by_index = 0;
  bad.block[2] = INT32_MAX;
  REFUSED(tessera_box_next(robot, &bad, &voxel, 1, &count));
  REFUSED(tessera_map_usage_of(robot, 2, &usage));
  REFUSED(tessera_map_usage_of(robot, 0, NULL));
  usage.struct_bytes = 4;
  REFUSED(tessera_map_usage_of(robot, 0, &usage));
  REFUSED(tessera_reader_query(&reader, 0, p, &estimate));
  REFUSED(tessera_reader_query(NULL, 0, p, &estimate));
  REFUSED(tessera_reader_make(robot, NULL));
  CHECK_STATUS(TESSERA_OK, tessera_reader_make(robot, &reader));
  REFUSED(tessera_reader_query(&reader, 2, p, &estimate));
  REFUSED(tessera_reader_query(&reader, 0, NULL, &estimate));
  REFUSED(tessera_reader_query(&reader, 0, p, NULL));
}

static void test_sharing(tessera_robot* robot) {
  uint8_t datagram[TESSERA_MOST_DATAGRAM_BYTES] = {1, 2, 3};
  tessera_tick_report tick = {.struct_bytes = 4};
  tessera_submap_report submap = {.struct_bytes = 0};
  tessera_global_report global = {.struct_bytes = 1};
  tessera_exchange_report exchange = {.struct_bytes = sizeof(exchange)};
  tessera_contribution contribution = {.struct_bytes = sizeof(contribution)};
  uint64_t number = 0;
  size_t size = 0;
  REFUSED(tessera_receive(robot, NULL, 10, 0));
  CHECK_STATUS(TESSERA_OK, tessera_receive(robot, datagram, 3, 0));
  CHECK_STATUS(TESSERA_OK, tessera_receive(robot, datagram, sizeof(datagram), 0));
  CHECK_STATUS(TESSERA_OK, tessera_exchange(robot, &exchange));
  CHECK(exchange.received == 2 && exchange.refused_size == 1 && exchange.refused_format == 1);
  REFUSED(tessera_tick(robot, 0, &tick));
  REFUSED(tessera_send(robot, 0, NULL, sizeof(datagram), &size));
  REFUSED(tessera_send(robot, 0, datagram, sizeof(datagram) - 1, &size));
  REFUSED(tessera_send(robot, 0, datagram, sizeof(datagram), NULL));
  REFUSED(tessera_is_idle(robot, NULL));
  REFUSED(tessera_used_bytes(robot, NULL));
  REFUSED(tessera_exclude(robot, 1));
  REFUSED(tessera_new_submap(robot, NULL));
  REFUSED(tessera_new_submap(robot, mirrored));
  REFUSED(tessera_set_frame(robot, 0, NULL));
  REFUSED(tessera_set_frame(robot, 3, identity));
  REFUSED(tessera_submap(robot, &submap));
  REFUSED(tessera_submap(robot, NULL));
  REFUSED(tessera_global(robot, &global));
  REFUSED(tessera_global(robot, NULL));
  REFUSED(tessera_contribution_at(robot, 0, NULL));
  CHECK_STATUS(TESSERA_OK, tessera_contribution_at(robot, 0, &contribution));
  CHECK(contribution.own == 1 && contribution.robot == 1);
  CHECK_STATUS(TESSERA_OUT_OF_RANGE, tessera_contribution_at(robot, 1, &contribution));
  REFUSED(tessera_workspace_bytes(robot, 2, &number));
  REFUSED(tessera_workspace_bytes(robot, 0, NULL));
  REFUSED(tessera_map_digest(robot, 0, NULL, sizeof(workspace), &number));
  REFUSED(tessera_map_digest(robot, 0, (uint8_t*)workspace + 1, 64, &number));
  REFUSED(tessera_map_digest(robot, 2, workspace, sizeof(workspace), &number));
  REFUSED(tessera_map_digest(robot, 0, workspace, sizeof(workspace), NULL));
  REFUSED(tessera_save_map(robot, 0, NULL, sizeof(workspace), take_all, NULL));
  REFUSED(tessera_save_map(robot, 2, workspace, sizeof(workspace), take_all, NULL));
  REFUSED(tessera_save_map(robot, 0, workspace, sizeof(workspace), NULL, NULL));
  REFUSED(tessera_load_map(robot, NULL, NULL));
  CHECK_STATUS(TESSERA_TRUNCATED, tessera_load_map(robot, give_none, NULL));
  CHECK_STATUS(TESSERA_TRUNCATED, tessera_load_map(robot, give_too_much, NULL));
}

/// Times with which a sum would overflow, and the last ones that will do.
static void test_times(tessera_robot* robot) {
  const int64_t most = TESSERA_MOST_TIME_US;
  const int64_t times[7] = {INT64_MIN, -most - 1, most + 1, INT64_MAX, -most, 0, most};
  uint8_t datagram[TESSERA_MOST_DATAGRAM_BYTES] = {0};
  size_t size = 0;
  tessera_scan scan = {.struct_bytes = sizeof(scan), .stride_floats = 3};
  for (int i = 0; i < 7; ++i) {
    const tessera_status expected = i < 4 ? TESSERA_INVALID_ARGUMENT : TESSERA_OK;
    scan.now_us = times[i];
    CHECK_STATUS(expected, tessera_integrate(robot, &scan, NULL));
    CHECK_STATUS(expected, tessera_tick(robot, times[i], NULL));
    CHECK_STATUS(expected, tessera_receive(robot, datagram, sizeof(datagram), times[i]));
    CHECK_STATUS(expected, tessera_send(robot, times[i], datagram, sizeof(datagram), &size));
  }
}

static void passed(const char* what) {
  if (failures == 0) printf("PASS %s\n", what);
}

int main(void) {
  const tessera_config config = small_config(1);
  tessera_robot* robot = small_robot(0, &config, NULL);
  test_sharing(robot);
  passed("sharing");
  test_handles(robot);
  passed("handles");
  test_asking(robot);
  passed("asking");
  test_scans(robot);
  passed("scans");
  test_times(small_robot(1, &config, NULL));
  passed("times");
  passed("all");
  return failures == 0 ? 0 : 1;
}
