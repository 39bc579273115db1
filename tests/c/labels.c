// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Labels with weights in C.
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "support.h"

static void test_weights(void) {
  const float probabilities[4] = {0.6F, 0.2F, 0.1F, 0.1F};
  uint8_t weights[4] = {7, 7, 7, 7};
  CHECK_STATUS(TESSERA_OK, tessera_label_weights(probabilities, 3, weights));
  CHECK(weights[0] == 153 && weights[1] == 51 && weights[2] == 26 && weights[3] == 7);
  CHECK_STATUS(TESSERA_OK, tessera_label_weights(NULL, 0, NULL));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_label_weights(probabilities, 4, weights));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_label_weights(NULL, 1, weights));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_label_weights(probabilities, 1, NULL));
  const float wrong[3][2] = {{0.6F, 0.5F}, {-0.1F, 0.5F}, {NAN, 0.5F}};
  for (int i = 0; i < 3; ++i)
    CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_label_weights(wrong[i], 2, weights));
}

static void test_scans(void) {
  const tessera_config config = small_config(1);
  const float points[6] = {5, 0, 0, 0, 5, 0};
  const uint8_t components[6] = {1, 2, 0, 2, 1, 0};
  const uint8_t weights[6] = {55, 200, 0, 200, 100, 0};
  tessera_scan scan = {.struct_bytes = sizeof(scan),
                       .stride_floats = 3,
                       .points = points,
                       .components = components,
                       .count = 2,
                       .T_map_sensor = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
                       .label_weights = weights,
                       .labels_per_point = 3};
  tessera_robot* const robot = small_robot(0, &config, NULL);
  tessera_scan_report report = {.struct_bytes = sizeof(report)};
  CHECK_STATUS(TESSERA_OK, tessera_integrate(robot, &scan, &report));
  // The second point's weights sum to 300.
  CHECK(report.in_range == 2 && report.weighted_labels == 1 && report.wrong_labels == 1);
  CHECK(report.unlabelled == 1);
  tessera_estimate estimate;
  CHECK_STATUS(TESSERA_OK, tessera_query(robot, TESSERA_LOCAL_MAP, points, &estimate));
  CHECK(estimate.state == TESSERA_OCCUPIED && estimate.label == 2);
  CHECK(estimate.probability > 0.3 && estimate.probability < 0.95);

  scan.labels_per_point = 4;
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_integrate(robot, &scan, &report));
  scan.labels_per_point = 2;
  scan.label_weights = NULL;
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_integrate(robot, &scan, &report));
  scan.label_weights = weights;
  scan.components = NULL;
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_integrate(robot, &scan, &report));
  scan.components = components;
  scan.reserved = 1;
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_integrate(robot, &scan, &report));
  // As of an older program, whose struct ends before.
  scan.struct_bytes = (uint32_t)offsetof(tessera_scan, label_weights);
  CHECK_STATUS(TESSERA_OK, tessera_integrate(robot, &scan, &report));
  CHECK(report.weighted_labels == 0 && report.unlabelled == 0);
}

/* Which class a place has that is in doubt: one point of class 1, and three of class 2 in the cell
   beside it, 0.8 m away. */
static uint32_t label_with(const tessera_config* config) {
  static const float points[12] = {5.1F, 0.1F, 0.1F, 5.9F, 0.1F, 0.1F,
                                   6.1F, 0.1F, 0.1F, 6.3F, 0.1F, 0.1F};
  static const uint8_t components[4] = {1, 2, 2, 2};
  const tessera_scan scan = {.struct_bytes = sizeof(scan),
                             .stride_floats = 3,
                             .points = points,
                             .components = components,
                             .count = 4,
                             .T_map_sensor = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
  tessera_robot* const robot = small_robot(0, config, NULL);
  CHECK_STATUS(TESSERA_OK, tessera_integrate(robot, &scan, NULL));
  tessera_estimate estimate;
  CHECK_STATUS(TESSERA_OK, tessera_query(robot, TESSERA_LOCAL_MAP, points, &estimate));
  CHECK(estimate.state == TESSERA_OCCUPIED);
  return estimate.label;
}

static void test_kernels(void) {
  tessera_config config = small_config(1);
  config.mode = TESSERA_LATTICE;
  CHECK(config.lattice_reach_m == 0);
  CHECK(config.class_reach_m[0] == 0 && config.class_height_m[61] == 0);
  config.class_reach_m[1] = 2.2F;
  config.class_height_m[1] = 0.24F;
  CHECK(label_with(&config) == 2);
  config.class_reach_m[1] = 0.3F;
  CHECK(label_with(&config) == 1);
  config.lattice_reach_m = 2.2F; /* of all classes */
  CHECK(label_with(&config) == 2);
}

int main(void) {
  test_weights();
  test_scans();
  test_kernels();
  if (failures == 0) printf("PASS all\n");
  return failures == 0 ? 0 : 1;
}
