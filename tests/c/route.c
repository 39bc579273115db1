// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Places of a route in C: what another robot has published there is held before the robot is there.
#include <math.h>

#include "support.h"

enum { kStations = 7 };
static const double kBetween_m = 40.0;

static void exchange(tessera_robot* a, tessera_robot* b, int64_t* now_us, int ticks) {
  uint64_t done = 0;
  for (int i = 0; i < ticks; ++i) exchange_until_equal(a, b, now_us, 1, 0);
  do {
    CHECK_STATUS(TESSERA_OK, tessera_fuse(b, 1000000, &done));
  } while (done != 0);
}

static int is_known(const tessera_robot* robot, int station) {
  const float place[3] = {(float)(kBetween_m * station + 3.1), 0.1F, 0.1F};
  tessera_estimate estimate;
  CHECK_STATUS(TESSERA_OK, tessera_query(robot, TESSERA_GLOBAL_MAP, place, &estimate));
  return estimate.state != TESSERA_UNKNOWN;
}

static int known_stations(const tessera_robot* robot) {
  int known = 0;
  for (int i = 0; i < kStations; ++i) known += is_known(robot, i);
  return known;
}

/// One robot has been to all stations, each a submap; the other is at the first, and has fewer
/// places.
static void test_route(void) {
  tessera_config config = small_config(1);
  config.contributions = 16;
  config.own_contributions = config.most_submaps = 10;
  config.submap_jump_m = 10.0;
  tessera_robot* const driver = small_robot(0, &config, NULL);
  config = small_config(2);
  config.contributions = config.contributions_per_robot = 6;
  config.own_contributions = 1;
  config.reach_m = 10.0;
  config.far_contributions = 16;
  tessera_robot* const other = small_robot(1, &config, NULL);
  int64_t now_us = 0;
  integrate_street(other, 0.0, 0.0);
  for (int i = 0; i < kStations; ++i) {
    integrate_street(driver, kBetween_m * i, 0.0);
    exchange(driver, other, &now_us, 200);
  }
  exchange(driver, other, &now_us, 200);
  CHECK(is_known(other, 0));
  CHECK(known_stations(other) < kStations);
  int far = kStations - 1;
  while (far > 0 && is_known(other, far)) --far;
  CHECK(far > 0);
  tessera_exchange_report report = {.struct_bytes = sizeof(report)};
  CHECK_STATUS(TESSERA_OK, tessera_exchange(other, &report));
  CHECK(report.far_contributions > 0);

  const double route[3] = {kBetween_m * far + 3.0, 0.0, 0.0};
  const double none[3] = {1.0, NAN, 0.0};
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_set_route(NULL, 1, route));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_set_route(other, 1, NULL));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_set_route(other, 1, none));
  exchange(driver, other, &now_us, 200);
  CHECK(!is_known(other, far));
  CHECK_STATUS(TESSERA_OK, tessera_set_route(other, 1, route));
  exchange(driver, other, &now_us, 100);
  CHECK(is_known(other, far));
  CHECK(is_known(other, 0));
  CHECK_STATUS(TESSERA_OK, tessera_set_route(other, 0, NULL));
}

int main(void) {
  test_route();
  if (failures == 0) printf("PASS all\n");
  return failures == 0 ? 0 : 1;
}
