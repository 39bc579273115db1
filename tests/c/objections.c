// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The team clears together, in C: what one robot has and another one sees through later.
#include <math.h>

#include "support.h"

enum { kRows = 26, kColumns = 108, kPoints = kRows * kColumns };
static int64_t now_us = 1000000;

/// A building 12 m ahead, and before it, 8 m ahead, a box of the same class or none.
static void look(tessera_robot* robot, int has_box) {
  static float points[3 * kPoints];
  static uint8_t components[kPoints];
  const double kRadian = 3.14159265358979323846 / 180.0;
  int n = 0;
  for (int i = 0; i < kRows; ++i) {
    for (int j = 0; j < kColumns; ++j, ++n) {
      const double z = tan(kRadian * (0.4 * i - 5.0));
      const double y = tan(kRadian * (0.15 * j - 8.0));
      const int is_box = has_box && fabs(8.0 * y) < 0.5 && fabs(8.0 * z) < 0.5;
      const double x = is_box ? 8.0 : 12.0;
      points[3 * n] = (float)x;
      points[3 * n + 1] = (float)(x * y);
      points[3 * n + 2] = (float)(x * z);
      components[n] = 2;
    }
  }
  const tessera_scan scan = {.struct_bytes = sizeof(scan),
                             .stride_floats = 3,
                             .points = points,
                             .components = components,
                             .count = kPoints,
                             .T_map_sensor = {1, 0, 0, 0.1, 0, 1, 0, 0.1, 0, 0, 1, 0},
                             .now_us = now_us};
  tessera_scan_report report = {.struct_bytes = sizeof(report)};
  CHECK_STATUS(TESSERA_OK, tessera_integrate(robot, &scan, &report));
  CHECK(report.left_out == 0);
}

static void talk(tessera_robot* zero, tessera_robot* one, int ticks) {
  for (; ticks > 0; --ticks) (void)exchange_until_equal(zero, one, &now_us, 1, 0);
}

static int is_occupied(const tessera_robot* robot, float x, float y) {
  const float p[3] = {x, y, 0.1F};
  tessera_estimate estimate;
  CHECK_STATUS(TESSERA_OK, tessera_query(robot, TESSERA_GLOBAL_MAP, p, &estimate));
  return estimate.state == TESSERA_OCCUPIED;
}

static tessera_objections_report objections_of(const tessera_robot* robot) {
  tessera_objections_report report = {.struct_bytes = sizeof(report)};
  CHECK_STATUS(TESSERA_OK, tessera_objections(robot, &report));
  return report;
}

static void test_clearing(uint32_t objections) {
  tessera_config config = small_config(0);
  CHECK(config.objections == 256 && config.teammate_margin_m == 0.2);
  config.thinning_m = 0.0;
  config.mode = TESSERA_COUNTING;
  tessera_robot* const zero = small_robot(0, &config, NULL);
  config.robot = 1;
  config.objections = objections;
  tessera_robot* const one = small_robot(1, &config, NULL);
  for (int i = 0; i < 4; ++i) look(zero, 1);
  talk(zero, one, 60);
  CHECK(is_occupied(one, 8.1F, 0.1F) && is_occupied(one, 12.1F, 1.3F));
  for (int i = 0; i < 30; ++i) {
    look(one, 0);
    talk(zero, one, 2);
  }
  talk(zero, one, 60);
  const tessera_objections_report report = objections_of(one);
  const int is_cleared = objections != 0;
  CHECK(is_occupied(zero, 8.1F, 0.1F) != is_cleared && is_occupied(one, 8.1F, 0.1F) != is_cleared);
  CHECK(is_occupied(zero, 12.1F, 1.3F) && is_occupied(one, 12.1F, 1.3F));
  CHECK((report.objections > 0) == is_cleared && (report.objected_voxels > 0) == is_cleared);
  CHECK(objections_of(zero).objected_voxels == 0);
  tessera_global_report global = {.struct_bytes = sizeof(global)};
  CHECK_STATUS(TESSERA_OK, tessera_global(zero, &global));
  CHECK((global.objected_voxels > 0) == is_cleared);
}

static void test_bad_arguments(void) {
  tessera_config config = small_config(0);
  tessera_robot* robot = small_robot(0, &config, NULL);
  tessera_objections_report report = {.struct_bytes = 0};
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_objections(robot, &report));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_objections(robot, NULL));
  report.struct_bytes = sizeof(report);
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_objections(NULL, &report));
  uint64_t bytes = 0;
  config.objections = 16385;
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_required_bytes(&config, 2, &bytes));
  config.objections = 16384;
  CHECK_STATUS(TESSERA_OK, tessera_required_bytes(&config, 2, &bytes));
  const double margins[3] = {-0.1, 2.1, (double)NAN};
  for (int i = 0; i < 3; ++i) {
    config.teammate_margin_m = margins[i];
    CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_required_bytes(&config, 2, &bytes));
  }
}

int main(void) {
  test_clearing(256);
  test_clearing(0);
  test_bad_arguments();
  if (failures == 0) printf("PASS all\n");
  return failures == 0 ? 0 : 1;
}
