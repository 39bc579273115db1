// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The library in a C program: static memory; integrates a scan, queries the class of a voxel, and
// gets the bytes to send.
#include <stdio.h>

#include "tessera/tessera.h"

static uint8_t memory[28u << 20] __attribute__((aligned(TESSERA_ALIGNMENT)));
static uint8_t datagram[TESSERA_MOST_DATAGRAM_BYTES];

static int failed(tessera_status status) {
  if (status != TESSERA_OK) printf("tessera: %s\n", tessera_status_text(status));
  return status != TESSERA_OK;
}

int main(void) {
  tessera_config config;
  if (failed(tessera_config_init(&config, sizeof(config)))) return 1;
  config.robot = 1;
  config.resolution_m = 0.2;
  config.thinning_m = 0.2;
  config.local_bytes = config.global_bytes = 4u << 20;
  config.staged_bytes = 1u << 20;
  config.carving = TESSERA_CARVING_RAYS;  // the default, by images of a scan, takes 16 MB more
  config.scan_points = 2048;
  config.scan_tiles = config.scan_ray_blocks = 1024;
  config.publisher_blocks = config.global_blocks = config.sum_segments = 4096;
  config.publisher_candidates = config.replica_blocks = 2048;
  config.replica_segments = 8192;
  config.iterations = 2;
  config.length_m = 0.4F;

  const tessera_class classes[] = {{.name = "road", .red = 255, .blue = 255}};
  tessera_robot* robot = NULL;
  if (failed(tessera_robot_make(&config, classes, 1, NULL, memory, sizeof(memory), &robot)))
    return 1;

  const float points[] = {5.0F, 0.0F, -1.7F, 6.0F, 0.5F, -1.7F};  // x y z, metres, sensor frame
  const uint8_t labels[] = {1, 1};                                // both are road
  const tessera_scan scan = {.struct_bytes = sizeof(scan),
                             .stride_floats = 3,
                             .points = points,
                             .components = labels,
                             .count = 2,
                             .T_map_sensor = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
  tessera_scan_report report = {.struct_bytes = sizeof(report)};
  if (failed(tessera_integrate(robot, &scan, &report))) return 1;

  size_t sent = 0;
  for (int64_t now_us = 0; now_us < 2000000; now_us += 50000) {
    size_t bytes = 1;
    if (failed(tessera_tick(robot, now_us, NULL))) return 1;
    while (bytes != 0) {
      if (failed(tessera_send(robot, now_us, datagram, sizeof(datagram), &bytes))) return 1;
      sent += bytes;  // to the network; what arrives goes to tessera_receive
    }
  }
  tessera_estimate here;
  if (failed(tessera_query(robot, TESSERA_GLOBAL_MAP, points, &here))) return 1;
  printf("%u points; the voxel's label is %d, with probability %.3f; %zu bytes to send\n",
         (unsigned)report.admitted, (int)here.label, here.probability, sent);
  return here.label == 1 ? 0 : 1;
}
