// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The robot's own body in C, and directions from which nothing came back.
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "support.h"

static const double above[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1.5};

static void test_settings(void) {
  uint64_t bytes = 0;
  tessera_config config = small_config(1);
  CHECK_STATUS(TESSERA_OK, tessera_required_bytes(&config, 2, &bytes));
  config.body_boxes = TESSERA_MOST_BODY_BOXES + 1;
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_required_bytes(&config, 2, &bytes));
  static uint8_t memory[ROBOT_BYTES] __attribute__((aligned(TESSERA_ALIGNMENT)));
  tessera_robot* robot = NULL;
  for (int i = 0; i < 7; ++i) {
    config = small_config(1);
    config.body_boxes = 1;
    for (int k = 3; k < 6; ++k) config.body[0][k] = 1.0F;
    if (i < 6) config.body[0][i] = NAN;
    if (i == 6) config.no_return_range_m = NAN;
    CHECK_STATUS(TESSERA_INVALID_ARGUMENT,
                 tessera_robot_make(&config, classes, 2, NULL, memory, ROBOT_BYTES, &robot));
    CHECK(robot == NULL);
  }
}

/// Returns in a box of the body are counted apart, and a scan of a sensor in one is refused.
static void test_body(void) {
  tessera_config config = small_config(1);
  const float box[6] = {4, -1, 0, 6, 1, 3};
  config.body_boxes = 1;
  memcpy(config.body[0], box, sizeof(box));
  config.no_return_range_m = 10;
  tessera_robot* const robot = small_robot(0, &config, NULL);
  const float points[9] = {5, 0, 0, 5, 0, 2, 0, 1, 0};
  const uint8_t no_return[3] = {0, 0, 1};
  tessera_scan scan = {.struct_bytes = sizeof(scan),
                       .stride_floats = 3,
                       .points = points,
                       .count = 3,
                       .T_map_sensor = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
                       .no_return = no_return};
  tessera_scan_report report = {.struct_bytes = sizeof(report)};
  CHECK_STATUS(TESSERA_OK, tessera_integrate(robot, &scan, &report));
  CHECK(report.on_body == 2 && report.in_range == 0 && report.no_return == 1 && report.rays == 1);
  memcpy(scan.T_body_sensor, above, sizeof(above));
  CHECK_STATUS(TESSERA_OK, tessera_integrate(robot, &scan, &report));
  CHECK(report.on_body == 1 && report.in_range == 1);
  scan.T_body_sensor[3] = 5;
  CHECK_STATUS(TESSERA_OK, tessera_integrate(robot, &scan, &report));
  CHECK(report.pose == TESSERA_INVALID_ARGUMENT && report.in_range == 0);
  scan.struct_bytes = TESSERA_SCAN_LEAST_BYTES;  // of an older program
  CHECK_STATUS(TESSERA_OK, tessera_integrate(robot, &scan, &report));
  CHECK(report.pose == TESSERA_OK && report.on_body == 2 && report.no_return == 0);
}

int main(void) {
  test_settings();
  test_body();
  if (failures == 0) printf("PASS all\n");
  return failures == 0 ? 0 : 1;
}
