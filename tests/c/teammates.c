// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Two robots that meet, in C: where each says that it is, and that neither maps the other.
#include <stddef.h>
#include <string.h>

#include "support.h"

static int64_t now_us = 1000000;

static tessera_robot* robot_with_body(uint32_t number, float length, double margin_m) {
  const float box[6] = {-0.5F * length, -0.5F, -0.4F, 0.5F * length, 0.5F, -0.1F};
  tessera_config config = small_config(number);
  config.body_boxes = 1;
  memcpy(config.body[0], box, sizeof(box));
  config.teammate_margin_m = margin_m;
  return small_robot(number, &config, NULL);
}

/// Each robot says what is due to the other.
static void exchange(tessera_robot* from, tessera_robot* to) {
  static uint8_t datagram[TESSERA_MOST_DATAGRAM_BYTES];
  size_t bytes = 0;
  CHECK_STATUS(TESSERA_OK, tessera_tick(from, now_us, NULL));
  do {
    CHECK_STATUS(TESSERA_OK, tessera_send(from, now_us, datagram, sizeof(datagram), &bytes));
    if (bytes != 0) CHECK_STATUS(TESSERA_OK, tessera_receive(to, datagram, bytes, now_us));
  } while (bytes != 0);
}

/// Seen from x_m, 4.6 m ahead: the other one's side, if it is 5 m ahead.
static tessera_scan_report scan_from(tessera_robot* robot, double x_m) {
  const float points[6] = {4.6F, 0.1F, -0.2F, 9.0F, 3.0F, 0.0F};
  tessera_scan scan = {.struct_bytes = sizeof(scan),
                       .stride_floats = 3,
                       .points = points,
                       .count = 2,
                       .T_map_sensor = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
                       .now_us = now_us};
  tessera_scan_report report = {.struct_bytes = sizeof(report)};
  scan.T_map_sensor[3] = x_m;
  CHECK_STATUS(TESSERA_OK, tessera_integrate(robot, &scan, &report));
  return report;
}

static void test_meeting(void) {
  tessera_robot* const zero = robot_with_body(0, 1.0F, 0.5);
  tessera_robot* const one = robot_with_body(1, 1.0F, 0.2);
  tessera_teammate other = {.struct_bytes = sizeof(other)};
  CHECK_STATUS(TESSERA_OUT_OF_RANGE, tessera_teammate_at(zero, 0, now_us, &other));
  for (int i = 0; i < 10; ++i, now_us += 100000) {
    (void)scan_from(one, 5.0);
    exchange(one, zero);
  }
  const tessera_scan_report report = scan_from(zero, 0.0);
  CHECK(report.teammates == 1 && report.on_teammate == 1 && report.in_range == 1);
  CHECK_STATUS(TESSERA_OK, tessera_teammate_at(zero, 0, now_us, &other));
  CHECK(other.robot == 1 && other.speed_m_per_s == 0.0 && other.velocity[0] == 0.0);
  CHECK(other.T_global_body[3] > 4.99 && other.T_global_body[3] < 5.01);
  CHECK(other.low[0] == -0.5F && other.high[0] == 0.5F && other.margin_m > 0.49);
  CHECK(other.until_us > now_us && other.until_us <= now_us + 3000000);
  CHECK_STATUS(TESSERA_OUT_OF_RANGE, tessera_teammate_at(zero, 1, now_us, &other));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_teammate_at(zero, 0, now_us, NULL));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_teammate_at(NULL, 0, now_us, &other));
  other.struct_bytes = 0;
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_teammate_at(zero, 0, now_us, &other));
  other.struct_bytes = sizeof(other);
  // Once it is not heard any more, it is met as anything else is.
  now_us = other.until_us + 1;
  CHECK_STATUS(TESSERA_OUT_OF_RANGE, tessera_teammate_at(zero, 0, now_us, &other));
  CHECK(scan_from(zero, 0.0).in_range == 2);
  tessera_exchange_report counts = {.struct_bytes = sizeof(counts)};
  CHECK_STATUS(TESSERA_OK, tessera_exchange(zero, &counts));
  CHECK(counts.presences_taken > 0 && counts.refused_presences == 0);
}

/// One that is too large to be sent says nothing.
static void test_too_large(void) {
  tessera_robot* const zero = robot_with_body(0, 1.0F, 0.2);
  tessera_robot* const one = robot_with_body(1, 30.0F, 0.2);
  tessera_teammate other = {.struct_bytes = sizeof(other)};
  for (int i = 0; i < 10; ++i, now_us += 100000) {
    (void)scan_from(one, 5.0);
    exchange(one, zero);
  }
  CHECK_STATUS(TESSERA_OUT_OF_RANGE, tessera_teammate_at(zero, 0, now_us, &other));
}

int main(void) {
  test_meeting();
  test_too_large();
  if (failures == 0) printf("PASS all\n");
  return failures == 0 ? 0 : 1;
}
