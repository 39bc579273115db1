// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "support.h"

#include <string.h>

enum { kMostRobots = 6, kWidth = 48, kPoints = kWidth * kWidth + kWidth * 16 };

int failures = 0;

const tessera_class classes[2] = {{.name = "road", .red = 255, .blue = 255},
                                  {.name = "building", .red = 255, .green = 200}};

static union {
  uint8_t bytes[kMostRobots][ROBOT_BYTES];
  uint64_t alignment;
} memory __attribute__((aligned(TESSERA_ALIGNMENT)));
static uint64_t workspace[1u << 17];

void check(int holds, const char* what, const char* file, int line) {
  if (holds) return;
  ++failures;
  printf("FAIL %s:%d: %s\n", file, line, what);
}

tessera_config small_config(uint32_t robot) {
  tessera_config config;
  CHECK_STATUS(TESSERA_OK, tessera_config_init(&config, sizeof(config)));
  config.robot = robot;
  config.resolution_m = 0.2;
  config.local_tuple = TESSERA_COMPACT;
  config.local_bytes = 4u << 20;
  config.global_bytes = 4u << 20;
  config.staged_bytes = 1u << 20;
  config.scan_points = 4096;
  config.scan_tiles = 1024;
  config.scan_ray_blocks = 1024;
  config.thinning_m = 0.2;
  config.publisher_blocks = 4096;
  config.publisher_candidates = 2048;
  config.contributions = 8;
  config.own_contributions = 3;
  config.peers = 4;
  config.answers = 16;
  config.fresh = 512;
  config.global_blocks = 4096;
  config.sum_segments = 4096;
  config.replica_segments = 16384;
  config.replica_blocks = 4096;
  config.robot_segments = 16384;
  config.robot_blocks = 4096;
  config.iterations = 2;
  config.length_m = 0.4F;
  return config;
}

tessera_robot* small_robot(uint32_t number, const tessera_config* config,
                           const tessera_callbacks* callbacks) {
  tessera_robot* robot = NULL;
  uint64_t bytes = 0;
  CHECK_STATUS(TESSERA_OK, tessera_required_bytes(config, 2, &bytes));
  CHECK(bytes <= ROBOT_BYTES);
  CHECK_STATUS(TESSERA_OK, tessera_robot_make(config, classes, 2, callbacks, memory.bytes[number],
                                              bytes, &robot));
  return robot;
}

tessera_scan_report integrate_street(tessera_robot* robot, double x_m, double y_m) {
  static float points[3 * kPoints];
  static uint8_t components[kPoints];
  const double height_m = 1.5;
  int n = 0;
  for (int i = 0; i < kWidth; ++i) {
    for (int j = 0; j < kWidth; ++j, ++n) {
      points[3 * n] = (float)(1.0 + 0.2 * i);
      points[3 * n + 1] = (float)(0.2 * (j - kWidth / 2));
      points[3 * n + 2] = (float)-height_m;
      components[n] = 1;
    }
  }
  for (int j = 0; j < kWidth; ++j) {
    for (int k = 0; k < 16; ++k, ++n) {
      points[3 * n] = (float)(1.0 + 0.2 * kWidth);
      points[3 * n + 1] = (float)(0.2 * (j - kWidth / 2));
      points[3 * n + 2] = (float)(0.2 * k - height_m);
      components[n] = 2;
    }
  }
  const tessera_scan scan = {.struct_bytes = sizeof(scan),
                             .stride_floats = 3,
                             .points = points,
                             .components = components,
                             .count = (uint64_t)n,
                             .T_map_sensor = {1, 0, 0, x_m, 0, 1, 0, y_m, 0, 0, 1, height_m}};
  tessera_scan_report report = {.struct_bytes = sizeof(report)};
  CHECK_STATUS(TESSERA_OK, tessera_integrate(robot, &scan, &report));
  CHECK(report.pose == TESSERA_OK && report.points == (uint32_t)n);
  CHECK(report.left_out == 0);
  return report;
}

uint64_t digest_of(const tessera_robot* robot) {
  tessera_exchange_report report = {.struct_bytes = sizeof(report)};
  CHECK_STATUS(TESSERA_OK, tessera_exchange(robot, &report));
  return report.digest;
}

uint64_t map_digest_of(const tessera_robot* robot, uint32_t map) {
  uint64_t bytes = 0;
  uint64_t digest = 0;
  CHECK_STATUS(TESSERA_OK, tessera_workspace_bytes(robot, map, &bytes));
  CHECK(bytes <= sizeof(workspace));
  CHECK_STATUS(TESSERA_OK, tessera_map_digest(robot, map, workspace, sizeof(workspace), &digest));
  return digest;
}

static void hand_over(tessera_robot* from, tessera_robot* to, int64_t now_us, int drop) {
  static int sent = 0;
  uint8_t datagram[TESSERA_MOST_DATAGRAM_BYTES];
  size_t bytes = 0;
  for (;;) {
    CHECK_STATUS(TESSERA_OK, tessera_send(from, now_us, datagram, sizeof(datagram), &bytes));
    if (bytes == 0) return;
    if (drop != 0 && ++sent % drop == 0) continue;
    CHECK_STATUS(TESSERA_OK, tessera_receive(to, datagram, bytes, now_us));
  }
}

int exchange_until_equal(tessera_robot* a, tessera_robot* b, int64_t* now_us, int most_ticks,
                         int drop) {
  enum { kPeriod_us = 50000 };
  for (int tick = 1; tick <= most_ticks; ++tick) {
    uint32_t a_idle = 0;
    uint32_t b_idle = 0;
    *now_us += kPeriod_us;
    CHECK_STATUS(TESSERA_OK, tessera_tick(a, *now_us, NULL));
    CHECK_STATUS(TESSERA_OK, tessera_tick(b, *now_us, NULL));
    hand_over(a, b, *now_us, drop);
    hand_over(b, a, *now_us, drop);
    CHECK_STATUS(TESSERA_OK, tessera_is_idle(a, &a_idle));
    CHECK_STATUS(TESSERA_OK, tessera_is_idle(b, &b_idle));
    if (a_idle == 1 && b_idle == 1 && digest_of(a) == digest_of(b)) return tick;
  }
  return most_ticks + 1;
}

struct memory_file file;

int32_t write_to_file(void* context, const uint8_t* bytes, size_t count) {
  CHECK(context == &file);
  if (file.written + count > file.room) return 0;
  memcpy(file.bytes + file.written, bytes, count);
  file.written += count;
  return 1;
}

size_t read_from_file(void* context, uint8_t* into, size_t capacity) {
  const size_t left = file.written - file.read;
  const size_t count = left < capacity ? left : capacity;
  CHECK(context == &file);
  memcpy(into, file.bytes + file.read, count);
  file.read += count;
  return count;
}
