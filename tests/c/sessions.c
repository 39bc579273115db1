// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map of an earlier day in C: from a file into memory of the program's, shared by two robots, and
// removed again.
#include <string.h>

#include "support.h"

static uint64_t workspace[1u << 17];
static uint8_t memory[8u << 20] __attribute__((aligned(TESSERA_ALIGNMENT)));

static tessera_status open_session(tessera_robot* robot, uint64_t bytes, double weight,
                                   uint32_t* number) {
  file.read = 0;
  return tessera_open_session(robot, read_from_file, &file, memory, bytes, weight, 1764115200, NULL,
                              number);
}

static uint32_t load(tessera_robot* robot) {
  uint32_t number = 77;
  uint32_t left = 1;
  uint32_t before = 1u << 30;
  CHECK_STATUS(TESSERA_OK, open_session(robot, sizeof(memory), 0.5, &number));
  CHECK_STATUS(TESSERA_BUSY, open_session(robot, sizeof(memory), 0.5, &number));
  while (left != 0) {
    CHECK_STATUS(TESSERA_OK, tessera_publish_session(robot, 5, &left));
    CHECK(left < before);
    before = left;
  }
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_publish_session(robot, 5, &left));
  memset(memory, 0xaa, sizeof(memory));  // nothing of it is used any more
  return number;
}

static void finish(tessera_robot* robot) {
  uint64_t done = 0;
  do {
    CHECK_STATUS(TESSERA_OK, tessera_fuse(robot, 1000000, &done));
  } while (done != 0);
}

/// Yesterday's map: another place than what the robots see today.
static void test_sessions(void) {
  tessera_config config = small_config(7);
  tessera_robot* const yesterday = small_robot(0, &config, NULL);
  integrate_street(yesterday, 20.0, 0.0);
  const uint64_t digest = map_digest_of(yesterday, TESSERA_LOCAL_MAP);
  CHECK_STATUS(TESSERA_OK, tessera_save_map(yesterday, TESSERA_LOCAL_MAP, workspace,
                                            sizeof(workspace), write_to_file, &file));
  tessera_robot* robots[2];
  for (uint32_t i = 0; i < 2; ++i) {
    config = small_config(i + 1);
    robots[i] = small_robot(i, &config, NULL);
    integrate_street(robots[i], 0.0, 0.0);
  }
  const float place[3] = {23.1F, 0.1F, 0.1F};
  tessera_estimate estimate;
  int64_t now_us = 0;
  CHECK(exchange_until_equal(robots[0], robots[1], &now_us, 2000, 0) < 2000);
  finish(robots[0]);
  finish(robots[1]);
  const uint64_t without = map_digest_of(robots[0], TESSERA_GLOBAL_MAP);
  CHECK_STATUS(TESSERA_OK, tessera_query(robots[1], TESSERA_GLOBAL_MAP, place, &estimate));
  CHECK(estimate.state == TESSERA_UNKNOWN);

  uint64_t bytes = 0;
  uint32_t number = 0;
  file.read = 0;
  CHECK_STATUS(TESSERA_OK, tessera_session_bytes(robots[0], read_from_file, &file, &bytes));
  CHECK(bytes > 10000 && bytes <= sizeof(memory));
  CHECK_STATUS(TESSERA_RESOURCE_EXHAUSTED, open_session(robots[0], bytes - 1, 0.5, &number));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, open_session(robots[0], bytes, 0.0, &number));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, open_session(robots[0], bytes, 1.5, &number));
  file.bytes[1000] ^= 1;
  CHECK_STATUS(TESSERA_CORRUPT, open_session(robots[0], bytes, 0.5, &number));
  file.bytes[1000] ^= 1;
  number = load(robots[0]);
  CHECK(load(robots[1]) == 0);
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, open_session(robots[0], sizeof(memory), 0.5, &number));
  tessera_session session = {.struct_bytes = sizeof(session)};
  CHECK_STATUS(TESSERA_OUT_OF_RANGE, tessera_session_at(robots[0], 1, &session));
  CHECK_STATUS(TESSERA_OK, tessera_session_at(robots[0], 0, &session));
  CHECK(session.number == number && session.state == TESSERA_SESSION_SHARED);
  CHECK(session.digest == digest && session.date_s == 1764115200 && session.blocks > 0);
  CHECK(session.weight > 0.499 && session.weight < 0.501 && session.refused_blocks == 0);

  CHECK(exchange_until_equal(robots[0], robots[1], &now_us, 2000, 0) < 2000);
  finish(robots[0]);
  finish(robots[1]);
  const uint64_t with_session = map_digest_of(robots[0], TESSERA_GLOBAL_MAP);
  CHECK(with_session != without);
  CHECK(map_digest_of(robots[1], TESSERA_GLOBAL_MAP) == with_session);
  CHECK_STATUS(TESSERA_OK, tessera_query(robots[1], TESSERA_GLOBAL_MAP, place, &estimate));
  CHECK(estimate.state == TESSERA_OCCUPIED && estimate.label == 1);

  // Once the one has removed it, it is the other's that counts.
  CHECK_STATUS(TESSERA_OK, tessera_remove_session(robots[0], number));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_remove_session(robots[0], number));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_remove_session(robots[0], 0xffffffffu));
  CHECK(exchange_until_equal(robots[0], robots[1], &now_us, 2000, 0) < 2000);
  finish(robots[0]);
  finish(robots[1]);
  CHECK(map_digest_of(robots[0], TESSERA_GLOBAL_MAP) == with_session);
  CHECK_STATUS(TESSERA_OK, tessera_remove_session(robots[1], 0));
  CHECK(exchange_until_equal(robots[0], robots[1], &now_us, 2000, 0) < 2000);
  finish(robots[0]);
  finish(robots[1]);
  CHECK(map_digest_of(robots[0], TESSERA_GLOBAL_MAP) == without);
  CHECK(map_digest_of(robots[1], TESSERA_GLOBAL_MAP) == without);
}

int main(void) {
  file.room = sizeof(file.bytes);
  test_sessions();
  if (failures == 0) printf("PASS all\n");
  return failures == 0 ? 0 : 1;
}
