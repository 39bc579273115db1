// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a robot is made with: settings out of their range; structs of older and newer programs;
// functions of the program for time, tags and signatures.
#include <math.h>
#include <string.h>

#include "support.h"

#define REFUSED(call) CHECK((call) == TESSERA_INVALID_ARGUMENT)

static union {
  uint8_t bytes[ROBOT_BYTES];
  uint64_t alignment;
} memory __attribute__((aligned(TESSERA_ALIGNMENT)));

static void test_versions(void) {
  CHECK(tessera_api_version() == TESSERA_API_VERSION);
  CHECK(tessera_abi_version() == TESSERA_ABI_VERSION);
  CHECK(strlen(tessera_version()) >= 5);
  CHECK(strcmp(tessera_status_text(TESSERA_OK), "ok") == 0);
  CHECK(strcmp(tessera_status_text(TESSERA_BUSY), "busy") == 0);
  CHECK(strcmp(tessera_status_text(77), "unknown status") == 0);
  CHECK(strcmp(tessera_status_text(256), "unknown status") == 0);
}

static void test_making(void) {
  tessera_config config = small_config(1);
  tessera_robot* robot = NULL;
  uint64_t bytes = 0;
  REFUSED(tessera_config_init(NULL, sizeof(config)));
  REFUSED(tessera_config_init(&config, 0));
  REFUSED(tessera_config_init(&config, sizeof(config) - 1));
  CHECK_STATUS(TESSERA_UNSUPPORTED, tessera_config_init(&config, sizeof(config) + 8));
  REFUSED(tessera_required_bytes(NULL, 2, &bytes));
  REFUSED(tessera_required_bytes(&config, 0, &bytes));
  REFUSED(tessera_required_bytes(&config, TESSERA_MOST_CLASSES + 1, &bytes));
  REFUSED(tessera_required_bytes(&config, 2, NULL));
  CHECK_STATUS(TESSERA_OK, tessera_required_bytes(&config, 2, &bytes));

  REFUSED(tessera_robot_make(NULL, classes, 2, NULL, memory.bytes, bytes, &robot));
  REFUSED(tessera_robot_make(&config, NULL, 2, NULL, memory.bytes, bytes, &robot));
  REFUSED(tessera_robot_make(&config, classes, 0, NULL, memory.bytes, bytes, &robot));
  REFUSED(tessera_robot_make(&config, classes, 63, NULL, memory.bytes, bytes, &robot));
  REFUSED(tessera_robot_make(&config, classes, 2, NULL, NULL, bytes, &robot));
  REFUSED(tessera_robot_make(&config, classes, 2, NULL, memory.bytes + 8, bytes, &robot));
  REFUSED(tessera_robot_make(&config, classes, 2, NULL, memory.bytes, bytes, NULL));
  const float wrong[4] = {-1.0F, 1e-4F, 2000.0F, NAN};
  for (int i = 0; i < 4; ++i) {
    tessera_config kernels = config;
    kernels.class_reach_m[1] = wrong[i];
    kernels.class_height_m[1] = 0.24F;
    REFUSED(tessera_robot_make(&kernels, classes, 2, NULL, memory.bytes, bytes, &robot));
    kernels.class_reach_m[1] = i == 0 ? 0.0F : 0.24F; /* a height alone */
    kernels.class_height_m[1] = i == 0 ? 0.24F : wrong[i];
    REFUSED(tessera_robot_make(&kernels, classes, 2, NULL, memory.bytes, bytes, &robot));
  }
  const uint64_t too_few[4] = {0, 64, bytes / 2, bytes - 64};
  for (int i = 0; i < 4; ++i) {
    CHECK_STATUS(TESSERA_RESOURCE_EXHAUSTED,
                 tessera_robot_make(&config, classes, 2, NULL, memory.bytes, too_few[i], &robot));
  }
  CHECK(robot == NULL);
  config.deadline_us = 1000;
  REFUSED(tessera_robot_make(&config, classes, 2, NULL, memory.bytes, bytes, &robot));
}

/// Each setting out of its range is refused, wherever memory is counted or a robot is made.
static void test_settings(void) {
  const uint32_t kinds[8] = {
      offsetof(tessera_config, local_tuple), offsetof(tessera_config, global_tuple),
      offsetof(tessera_config, mode),        offsetof(tessera_config, thinning_weight),
      offsetof(tessera_config, free_space),  offsetof(tessera_config, diffusion),
      offsetof(tessera_config, edge),        offsetof(tessera_config, reserved)};
  const uint32_t numbers[12] = {offsetof(tessera_config, scan_points),
                                offsetof(tessera_config, scan_tiles),
                                offsetof(tessera_config, scan_ray_blocks),
                                offsetof(tessera_config, block_edge),
                                offsetof(tessera_config, publisher_blocks),
                                offsetof(tessera_config, publisher_candidates),
                                offsetof(tessera_config, few_voxels),
                                offsetof(tessera_config, contributions),
                                offsetof(tessera_config, peers),
                                offsetof(tessera_config, answers),
                                offsetof(tessera_config, bytes_per_s),
                                offsetof(tessera_config, submap_ticks)};
  uint64_t bytes = 0;
  tessera_robot* robot = NULL;
  for (int i = 0; i < 8; ++i) {
    tessera_config config = small_config(1);
    const uint32_t too_large = 256;  // 0 in a byte
    memcpy((uint8_t*)&config + kinds[i], &too_large, sizeof(too_large));
    REFUSED(tessera_required_bytes(&config, 2, &bytes));
  }
  for (int i = 0; i < 12; ++i) {
    tessera_config config = small_config(1);
    memset((uint8_t*)&config + numbers[i], 0, sizeof(uint32_t));
    REFUSED(tessera_robot_make(&config, classes, 2, NULL, memory.bytes, ROBOT_BYTES, &robot));
  }
  const double resolutions[4] = {0.0, -1.0, (double)INFINITY, (double)NAN};
  for (int i = 0; i < 4; ++i) {
    tessera_config config = small_config(1);
    config.resolution_m = resolutions[i];
    REFUSED(tessera_required_bytes(&config, 2, &bytes));
  }
  tessera_config config = small_config(1);
  config.iterations = INT32_MAX;
  REFUSED(tessera_required_bytes(&config, 2, &bytes));
  config = small_config(1);
  config.length_m = NAN;
  REFUSED(tessera_required_bytes(&config, 2, &bytes));
  config = small_config(1);
  config.deadline_us = INT64_MAX;
  REFUSED(tessera_required_bytes(&config, 2, &bytes));
  config = small_config(1);
  config.local_bytes = UINT64_MAX;
  REFUSED(tessera_required_bytes(&config, 2, &bytes));
  CHECK(robot == NULL);
}

/// A program that was compiled with a shorter config: what it does not know has its default.
static void test_older_programs(void) {
  tessera_config whole = small_config(1);
  CHECK_STATUS(TESSERA_OK, tessera_config_init(&whole, sizeof(whole)));
  uint64_t of_whole = 0;
  uint64_t of_older = 0;
  CHECK_STATUS(TESSERA_OK, tessera_required_bytes(&whole, 2, &of_whole));
  uint8_t older[TESSERA_CONFIG_LEAST_BYTES + 8];
  memset(older, 0xa5, sizeof(older));
  CHECK_STATUS(TESSERA_OK,
               tessera_config_init((tessera_config*)(void*)older, TESSERA_CONFIG_LEAST_BYTES));
  for (size_t i = TESSERA_CONFIG_LEAST_BYTES; i < sizeof(older); ++i) CHECK(older[i] == 0xa5);
  CHECK_STATUS(TESSERA_OK,
               tessera_required_bytes((const tessera_config*)(const void*)older, 2, &of_older));
  CHECK(of_older == of_whole);
  whole.publisher_blocks *= 2;
  CHECK_STATUS(TESSERA_OK, tessera_required_bytes(&whole, 2, &of_whole));
  CHECK(of_older < of_whole);
  whole.struct_bytes = TESSERA_CONFIG_LEAST_BYTES;
  CHECK_STATUS(TESSERA_OK, tessera_required_bytes(&whole, 2, &of_whole));
  CHECK(of_older == of_whole);
  whole.struct_bytes = TESSERA_CONFIG_LEAST_BYTES - 8;
  REFUSED(tessera_required_bytes(&whole, 2, &of_whole));
  whole.struct_bytes = sizeof(whole) + 8;
  CHECK_STATUS(TESSERA_UNSUPPORTED, tessera_required_bytes(&whole, 2, &of_whole));
}

// --- Functions of the program ------------------------------------------------------------------

static uint32_t key;
static int64_t clock_us;
static int clock_readings;

static int64_t read_clock(void* context) {
  CHECK(context == &clock_us);
  ++clock_readings;
  return clock_us;
}
static uint32_t mix(const uint8_t* bytes, size_t count, uint32_t seed) {
  uint32_t sum = seed + 2166136261u;
  for (size_t i = 0; i < count; ++i) sum = (sum ^ bytes[i]) * 16777619u;
  return sum;
}
static void repeat(uint32_t sum, uint8_t* into, size_t count) {
  for (size_t i = 0; i < count; ++i) into[i] = (uint8_t)(sum >> (8 * (i % 4)));
}
static void tag_message(void* context, const uint8_t* message, size_t bytes, uint8_t* tag) {
  repeat(mix(message, bytes, *(const uint32_t*)context), tag, TESSERA_TAG_BYTES);
}
static int32_t check_tag(void* context, const uint8_t* message, size_t bytes, const uint8_t* tag) {
  uint8_t wanted[TESSERA_TAG_BYTES];
  tag_message(context, message, bytes, wanted);
  return memcmp(wanted, tag, sizeof(wanted)) == 0;
}
static void sign(void* context, const uint8_t* message, size_t bytes, uint8_t* signature) {
  repeat(mix(message, bytes, *(const uint32_t*)context), signature, TESSERA_SIGNATURE_BYTES);
}
static int32_t check_signature(void* context, uint32_t robot, const uint8_t* message, size_t bytes,
                               const uint8_t* signature) {
  uint8_t wanted[TESSERA_SIGNATURE_BYTES];
  (void)context;
  sign(&robot, message, bytes, wanted);
  return memcmp(wanted, signature, sizeof(wanted)) == 0;
}
static void hash(void* context, const uint8_t* message, size_t bytes, uint8_t* into) {
  (void)context;
  repeat(mix(message, bytes, 0), into, TESSERA_HASH_BYTES);
}

static tessera_status integrate_point(tessera_robot* robot, int64_t now_us, int64_t due_us) {
  const float point[3] = {5, 0, 0};
  const tessera_scan scan = {.struct_bytes = sizeof(scan),
                             .stride_floats = 3,
                             .points = point,
                             .count = 1,
                             .T_map_sensor = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
                             .now_us = now_us,
                             .due_us = due_us};
  return tessera_integrate(robot, &scan, NULL);
}

static void test_callbacks(void) {
  static const uint32_t numbers[2] = {1, 2};
  tessera_callbacks callbacks[2];
  tessera_robot* robots[2];
  int64_t now_us = 0;
  for (uint32_t i = 0; i < 2; ++i) {
    const tessera_callbacks all = {.struct_bytes = sizeof(all),
                                   .clock_context = &clock_us,
                                   .now_us = read_clock,
                                   .tag_context = &key,
                                   .tag_message = tag_message,
                                   .check_tag = check_tag,
                                   .signature_context = (void*)(uintptr_t)&numbers[i],
                                   .sign = sign,
                                   .check_signature = check_signature,
                                   .hash = hash};
    callbacks[i] = all;
    tessera_config config = small_config(i + 1);
    config.deadline_us = 1000000;
    robots[i] = small_robot(i, &config, &callbacks[i]);
    integrate_street(robots[i], 0.0, 2.0 * i);
  }
  CHECK(clock_readings > 0);
  CHECK(exchange_until_equal(robots[0], robots[1], &now_us, 400, 0) <= 400);
  tessera_exchange_report report = {.struct_bytes = sizeof(report)};
  CHECK_STATUS(TESSERA_OK, tessera_exchange(robots[1], &report));
  CHECK(report.records_taken > 0 && report.refused_tag == 0 && report.refused_signature == 0);
  // One without the key is not heard.
  key = 1;
  uint8_t datagram[TESSERA_MOST_DATAGRAM_BYTES];
  size_t bytes = 0;
  CHECK_STATUS(TESSERA_OK, tessera_leave(robots[0]));
  CHECK_STATUS(TESSERA_OK, tessera_send(robots[0], now_us, datagram, sizeof(datagram), &bytes));
  CHECK(bytes > 0);
  key = 0;
  CHECK_STATUS(TESSERA_OK, tessera_receive(robots[1], datagram, bytes, now_us));
  CHECK_STATUS(TESSERA_OK, tessera_exchange(robots[1], &report));
  CHECK(report.refused_tag == 1);

  // Half of a group is none.
  const tessera_config config = small_config(3);
  tessera_robot* robot = NULL;
  for (int i = 0; i < 5; ++i) {
    tessera_callbacks half = callbacks[0];
    if (i == 0) half.tag_message = NULL;
    if (i == 1) half.check_tag = NULL;
    if (i == 2) half.sign = NULL;
    if (i == 3) half.check_signature = NULL;
    if (i == 4) half.hash = NULL;
    REFUSED(tessera_robot_make(&config, classes, 2, &half, memory.bytes, ROBOT_BYTES, &robot));
  }
  // A clock of any numbers is no overflow.
  static const int64_t readings[4] = {INT64_MIN, -1, 1, INT64_MAX};
  for (int i = 0; i < 4; ++i) {
    clock_us = readings[i];
    CHECK_STATUS(TESSERA_OK, integrate_point(robots[0], -TESSERA_MOST_TIME_US, 0));
    CHECK_STATUS(TESSERA_OK, integrate_point(robots[0], TESSERA_MOST_TIME_US, 0));
    CHECK_STATUS(TESSERA_OK, integrate_point(robots[0], 0, -TESSERA_MOST_TIME_US));
  }
  REFUSED(integrate_point(robots[0], 0, INT64_MIN));
  REFUSED(integrate_point(robots[0], 0, INT64_MAX));
  callbacks[0].struct_bytes = 8;
  REFUSED(
      tessera_robot_make(&config, classes, 2, &callbacks[0], memory.bytes, ROBOT_BYTES, &robot));
}

static void passed(const char* what) {
  if (failures == 0) printf("PASS %s\n", what);
}

int main(void) {
  test_versions();
  passed("versions");
  test_making();
  passed("making");
  test_settings();
  passed("settings");
  test_older_programs();
  passed("structs of older and newer programs");
  test_callbacks();
  passed("callbacks");
  passed("all");
  return failures == 0 ? 0 : 1;
}
