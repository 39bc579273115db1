// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A robot with a window, whose archive is an array of the program's: its map is that of a robot
// without a window, and so is what it has published.
#define _POSIX_C_SOURCE 200112L
#include <stdlib.h>
#include <string.h>

#include "support.h"

enum { kMostBlocks = 4096, kBlockBytes = 1 << 14, kStations = 30 };

typedef struct stored_block {
  uint64_t key;
  size_t count;  // 0: free
  uint8_t bytes[kBlockBytes];
} stored_block;

typedef struct store {
  stored_block* blocks;
  int kept;
} store;

static stored_block* find(store* in, uint64_t key) {
  for (int i = 0; i < kMostBlocks; ++i) {
    if (in->blocks[i].count != 0 && in->blocks[i].key == key) return &in->blocks[i];
  }
  return NULL;
}

static int32_t put_block(void* context, uint64_t key, const uint8_t* bytes, size_t count) {
  store* in = context;
  stored_block* at = find(in, key);
  for (int i = 0; at == NULL && i < kMostBlocks; ++i) {
    if (in->blocks[i].count == 0) at = &in->blocks[i];
  }
  if (at == NULL || count > kBlockBytes) return 0;
  in->kept += at->count == 0;
  at->key = key;
  at->count = count;
  memcpy(at->bytes, bytes, count);
  return 1;
}

static size_t get_block(void* context, uint64_t key, uint8_t* into, size_t capacity) {
  const stored_block* at = find(context, key);
  if (at == NULL || at->count > capacity) return 0;
  memcpy(into, at->bytes, at->count);
  return at->count;
}

static void drop_block(void* context, uint64_t key) {
  store* in = context;
  stored_block* at = find(in, key);
  CHECK(at != NULL);
  if (at == NULL) return;
  at->count = 0;
  --in->kept;
}

static void clear_blocks(void* context) {
  store* in = context;
  for (int i = 0; i < kMostBlocks; ++i) in->blocks[i].count = 0;
  in->kept = 0;
}

static void drive(tessera_robot* robot, int64_t* now_us) {
  for (int i = 0; i < kStations; ++i) {
    // There and half of the way back.
    integrate_street(robot, 2.0 * (i < 20 ? i : 40 - i), 0.0);
    for (int tick = 0; tick < 6; ++tick)
      CHECK_STATUS(TESSERA_OK, tessera_tick(robot, *now_us += 50000, NULL));
  }
}

static uint8_t file_of[2][1 << 22];
static size_t file_bytes[2];

static int32_t write_file(void* context, const uint8_t* bytes, size_t count) {
  const int number = *(const int*)context;
  if (file_bytes[number] + count > sizeof(file_of[number])) return 0;
  memcpy(file_of[number] + file_bytes[number], bytes, count);
  file_bytes[number] += count;
  return 1;
}

static void save(tessera_robot* robot, int number) {
  uint64_t bytes = 0;
  CHECK_STATUS(TESSERA_OK, tessera_workspace_bytes(robot, TESSERA_LOCAL_MAP, &bytes));
  void* workspace = malloc(bytes);
  CHECK_STATUS(TESSERA_OK,
               tessera_save_map(robot, TESSERA_LOCAL_MAP, workspace, bytes, write_file, &number));
  free(workspace);
}

static size_t read_nothing(void* context, uint8_t* into, size_t capacity) {
  (void)context;
  (void)into;
  (void)capacity;
  return 0;
}

static void test_window(void) {
  store archive = {.blocks = calloc(kMostBlocks, sizeof(stored_block))};
  const tessera_callbacks callbacks = {.struct_bytes = sizeof(callbacks),
                                       .archive_context = &archive,
                                       .put_block = put_block,
                                       .get_block = get_block,
                                       .drop_block = drop_block,
                                       .clear_blocks = clear_blocks};
  tessera_config config = small_config(0);
  int64_t now_us = 0;
  tessera_robot* whole = small_robot(0, &config, NULL);
  drive(whole, &now_us);
  config.window_radius_m = 16.0;
  config.archived_blocks = kMostBlocks;
  tessera_robot* robot = small_robot(1, &config, &callbacks);
  now_us = 0;
  drive(robot, &now_us);

  tessera_window_report window = {.struct_bytes = sizeof(window)};
  CHECK_STATUS(TESSERA_OK, tessera_window(robot, &window));
  CHECK(window.evicted > 100 && window.reloaded > 50);
  CHECK(window.unpublished_blocks == 0 && window.reloads_failed == 0);
  CHECK(window.archived_blocks > 0 && (int)window.archived_blocks == archive.kept);
  tessera_map_usage usage = {.struct_bytes = sizeof(usage)};
  tessera_map_usage usage_whole = {.struct_bytes = sizeof(usage)};
  CHECK_STATUS(TESSERA_OK, tessera_map_usage_of(robot, TESSERA_LOCAL_MAP, &usage));
  CHECK_STATUS(TESSERA_OK, tessera_map_usage_of(whole, TESSERA_LOCAL_MAP, &usage_whole));
  CHECK(usage.blocks < usage_whole.blocks);
  CHECK(map_digest_of(robot, TESSERA_LOCAL_MAP) == map_digest_of(whole, TESSERA_LOCAL_MAP));
  save(whole, 0);
  save(robot, 1);
  CHECK(file_bytes[0] > 10000 && file_bytes[0] == file_bytes[1]);
  CHECK(memcmp(file_of[0], file_of[1], file_bytes[0]) == 0);
  CHECK_STATUS(TESSERA_MISMATCH, tessera_load_map(robot, read_nothing, NULL));

  // A map with a window has no submaps.
  const double T[12] = {1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0};
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_new_submap(robot, T));
  free(archive.blocks);
}

static void test_refusals(void) {
  static uint8_t memory[64] __attribute__((aligned(TESSERA_ALIGNMENT)));
  tessera_config config = small_config(0);
  tessera_robot* robot = NULL;
  uint64_t bytes = 0;
  config.window_radius_m = 10.0;
  // A window needs an archive, and that all of its functions.
  CHECK_STATUS(TESSERA_OK, tessera_required_bytes(&config, 2, &bytes));
  CHECK_STATUS(TESSERA_RESOURCE_EXHAUSTED,
               tessera_robot_make(&config, classes, 2, NULL, memory, sizeof(memory), &robot));
  const tessera_callbacks half = {.struct_bytes = sizeof(half), .put_block = put_block};
  tessera_robot* made = NULL;
  void* room = NULL;
  CHECK(posix_memalign(&room, TESSERA_ALIGNMENT, bytes) == 0);
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT,
               tessera_robot_make(&config, classes, 2, NULL, room, bytes, &made));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT,
               tessera_robot_make(&config, classes, 2, &half, room, bytes, &made));
  free(room);
  for (int i = 0; i < 4; ++i) {
    tessera_config wrong = config;
    if (i == 0) wrong.window_radius_m = -1.0;
    if (i == 1) wrong.window_radius_m = 1e9;
    if (i == 2) wrong.window_hysteresis_m = -1.0;
    if (i == 3) wrong.archived_blocks = 0;
    CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_required_bytes(&wrong, 2, &bytes));
  }
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_window(NULL, NULL));
}

int main(void) {
  test_window();
  test_refusals();
  if (failures == 0) printf("PASS all\n");
  return failures == 0 ? 0 : 1;
}
