// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Whom to believe, in C: with two robots it is said how often they differ, and both count.
#include <math.h>

#include "support.h"

enum { kPoints = 400 };
static int64_t now_us = 1000000;

/// A floor of one class.
static void look(tessera_robot* robot, uint8_t component) {
  static float points[3 * kPoints];
  static uint8_t components[kPoints];
  for (int i = 0; i < kPoints; ++i) {
    points[3 * i] = 1.05F + 0.1F * (float)(i % 20);
    points[3 * i + 1] = 0.05F + 0.1F * (float)(i / 20);
    points[3 * i + 2] = 0.05F;
    components[i] = component;
  }
  const tessera_scan scan = {.struct_bytes = sizeof(scan),
                             .stride_floats = 3,
                             .points = points,
                             .components = components,
                             .count = kPoints,
                             .T_map_sensor = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1},
                             .now_us = now_us};
  tessera_scan_report report = {.struct_bytes = sizeof(report)};
  CHECK_STATUS(TESSERA_OK, tessera_integrate(robot, &scan, &report));
}

static tessera_reliability_report reliability_of(const tessera_robot* robot, uint32_t of_robot,
                                                 uint32_t label) {
  tessera_reliability_report report = {.struct_bytes = sizeof(report)};
  CHECK_STATUS(TESSERA_OK, tessera_reliability(robot, of_robot, label, &report));
  return report;
}

static void test_two_that_differ(void) {
  tessera_config config = small_config(0);
  CHECK(config.weigh_robots == 1 && config.reliability_alarm == 0.7F);
  config.free_space = 0;
  config.mode = TESSERA_COUNTING;
  tessera_robot* const zero = small_robot(0, &config, NULL);
  config.robot = 1;
  tessera_robot* const one = small_robot(1, &config, NULL);
  look(zero, 1);
  look(one, 2);
  CHECK(exchange_until_equal(zero, one, &now_us, 500, 0));
  for (uint32_t robot = 0; robot < 2; ++robot) {
    const tessera_reliability_report whole = reliability_of(zero, robot, 0);
    CHECK(whole.shared > 50 && whole.differing == whole.shared);
    CHECK(whole.judged == 0 && whole.named == 0 && whole.reliability == 1.0F);
    const tessera_reliability_report first = reliability_of(zero, robot, 1);
    CHECK(first.judged == 0 && first.reliability == 1.0F && first.named == 0);
  }
}

static void test_bad_arguments(void) {
  tessera_config config = small_config(0);
  tessera_robot* const robot = small_robot(0, &config, NULL);
  tessera_reliability_report report = {.struct_bytes = sizeof(report)};
  CHECK_STATUS(TESSERA_OUT_OF_RANGE, tessera_reliability(robot, 7, 0, &report));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_reliability(NULL, 0, 0, &report));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_reliability(robot, 0, 0, NULL));
  look(robot, 1);
  uint64_t bytes = 0;
  const float alarms[3] = {-0.1F, 1.1F, (float)NAN};
  for (int i = 0; i < 3; ++i) {
    config.reliability_alarm = alarms[i];
    CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_required_bytes(&config, 2, &bytes));
  }
  config.reliability_alarm = 0.0F;
  config.weigh_robots = 2;
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_required_bytes(&config, 2, &bytes));
}

int main(void) {
  test_two_that_differ();
  test_bad_arguments();
  if (failures == 0) printf("PASS all\n");
  return failures == 0 ? 0 : 1;
}
