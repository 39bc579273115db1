// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The transform between the maps of two robots, in C: found without a guess and near one, or
// refused.
#include <math.h>
#include <string.h>

#include "support.h"

enum { kBeams = 600, kRows = 24, kMostPoints = kBeams * kRows };

static uint8_t memory[17u << 20] __attribute__((aligned(TESSERA_ALIGNMENT)));
static const double T_a_b[12] = {0.6, -0.8, 0, 2, 0.8, 0.6, 0, -1, 0, 0, 1, 0.4};

/// Walls of a yard without a symmetry, and of things in it: x y to x y, metres.
static const double walls[][4] = {
    {-9, -6, 10, -6}, {10, -6, 10, 2}, {10, 2, 7, 2},   {7, 2, 7, 8},   {7, 8, -4, 8},
    {-4, 8, -4, 5},   {-4, 5, -9, 5},  {-9, 5, -9, -6}, {4, -3, 5, -3}, {5, -3, 5, -2},
    {5, -2, 4, -3},   {-6, 1, -5, 1},  {-5, 1, -5, 3},  {-5, 3, -6, 1}, {1, 4, 2, 4.5},
    {2, 4.5, 1, 5.5}, {1, 5.5, 1, 4}};

/// Along a direction to the next wall.
static double distance_m(double x, double y, double dx, double dy) {
  double nearest = 100.0;
  for (size_t i = 0; i < sizeof(walls) / sizeof(walls[0]); ++i) {
    const double ex = walls[i][2] - walls[i][0];
    const double ey = walls[i][3] - walls[i][1];
    const double ox = walls[i][0] - x;
    const double oy = walls[i][1] - y;
    const double across = dx * ey - dy * ex;
    if (fabs(across) < 1e-9) continue;
    const double along = (ox * ey - oy * ex) / across;
    const double share = (ox * dy - oy * dx) / across;
    if (along > 0.0 && share >= 0.0 && share <= 1.0 && along < nearest) nearest = along;
  }
  return nearest;
}

/// A scan from a place of the yard, 1.5 m above its ground, into a map that T_map_yard [R | t] is
/// the frame of.
static void look(tessera_robot* robot, double x, double y, const double* T_map_yard) {
  static float points[3 * kMostPoints];
  static uint8_t components[kMostPoints];
  uint64_t n = 0;
  for (int beam = 0; beam < kBeams; ++beam) {
    const double azimuth = 6.283185307179586 * beam / kBeams;
    const double wall_m = distance_m(x, y, cos(azimuth), sin(azimuth));
    for (int row = 0; row < kRows; ++row) {
      const double slope = -0.6 + 0.05 * row;
      const double r = slope * wall_m < -1.5 ? -1.5 / slope : wall_m;
      if (r * slope > 1.5) continue;
      points[3 * n] = (float)(r * cos(azimuth));
      points[3 * n + 1] = (float)(r * sin(azimuth));
      points[3 * n + 2] = (float)(r * slope);
      components[n++] = r < wall_m ? 1 : 2;
    }
  }
  const double* const T = T_map_yard;
  const tessera_scan scan = {
      .struct_bytes = sizeof(scan),
      .stride_floats = 3,
      .points = points,
      .components = components,
      .count = n,
      .T_map_sensor = {T[0], T[1], T[2], T[0] * x + T[1] * y + T[2] * 1.5 + T[3],  //
                       T[4], T[5], T[6], T[4] * x + T[5] * y + T[6] * 1.5 + T[7],  //
                       T[8], T[9], T[10], T[8] * x + T[9] * y + T[10] * 1.5 + T[11]}};
  tessera_scan_report report = {.struct_bytes = sizeof(report)};
  CHECK_STATUS(TESSERA_OK, tessera_integrate(robot, &scan, &report));
  CHECK(report.pose == TESSERA_OK && report.left_out == 0);
}

static void invert(const double* T, double* inverse) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) inverse[4 * row + column] = T[4 * column + row];
    inverse[4 * row + 3] = -(T[row] * T[3] + T[4 + row] * T[7] + T[8 + row] * T[11]);
  }
}

static tessera_config yard_config(uint32_t robot) {
  tessera_config config = small_config(robot);
  config.local_bytes = 8u << 20;
  config.staged_bytes = 1u << 19;
  config.scan_points = kMostPoints;
  config.scan_tiles = 2048;
  config.scan_ray_blocks = 2048;
  return config;
}

static tessera_frame_answer answer_of(tessera_frame_finder* finder) {
  uint32_t state = TESSERA_FRAME_READING;
  uint32_t before = TESSERA_FRAME_READING;
  tessera_frame_answer answer = {.struct_bytes = sizeof(answer)};
  CHECK_STATUS(TESSERA_BUSY, tessera_frame_finder_answer(finder, &answer));
  for (uint32_t step = 0; step < 100000 && state != TESSERA_FRAME_DONE; ++step) {
    CHECK_STATUS(TESSERA_OK, tessera_frame_finder_step(finder, &state));
    CHECK(state >= before && state <= TESSERA_FRAME_DONE);
    before = state;
  }
  CHECK_STATUS(TESSERA_OK, tessera_frame_finder_answer(finder, &answer));
  CHECK(answer.struct_bytes == sizeof(answer));
  return answer;
}

static void check_found(const tessera_frame_answer* answer) {
  CHECK(answer->verdict == TESSERA_FRAME_FOUND);
  for (int i = 0; i < 12; ++i) CHECK(fabs(answer->T_a_b[i] - T_a_b[i]) < (i % 4 == 3 ? 0.1 : 0.01));
  for (int i = 0; i < 6; ++i) CHECK(answer->covariance[7 * i] > 0.0);
  CHECK(answer->sigma_m > 0.0 && answer->sigma_m < 0.1 && answer->sigma_rad > 0.0);
  CHECK(answer->support > 1000.0 && answer->pairs > 100 && answer->steps > 10);
  CHECK(answer->agreement.agreed >= 19 * answer->agreement.contradicted);
  CHECK(answer->agreement.same_label > 9 * (answer->agreement.labelled / 10));
}

static void test_search(tessera_frame_finder* finder) {
  const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  double T_b_a[12];
  invert(T_a_b, T_b_a);
  tessera_config config = yard_config(0);
  tessera_robot* const a = small_robot(0, &config, NULL);
  config.robot = 1;
  tessera_robot* const b = small_robot(1, &config, NULL);
  look(a, 0, 0, identity);
  look(b, -1, -2, T_b_a);

  CHECK_STATUS(TESSERA_OK, tessera_frame_finder_begin(finder, a, 0, b, 0, NULL));
  const tessera_frame_answer found = answer_of(finder);
  check_found(&found);
  CHECK(found.agreement_guess.agreed < found.agreement.agreed);
  // Another search in the same memory, near a guess.
  double guess[12];
  memcpy(guess, T_a_b, sizeof(guess));
  guess[3] += 1.0;
  CHECK_STATUS(TESSERA_OK, tessera_frame_finder_begin(finder, a, 0, b, 0, guess));
  tessera_frame_answer near_guess = answer_of(finder);
  check_found(&near_guess);
  CHECK(near_guess.steps < found.steps);
  // The same question has the same answer, to the bit, also while robots go on after the reading.
  CHECK_STATUS(TESSERA_OK, tessera_frame_finder_begin(finder, a, 0, b, 0, guess));
  uint32_t state = TESSERA_FRAME_READING;
  while (state == TESSERA_FRAME_READING)
    CHECK_STATUS(TESSERA_OK, tessera_frame_finder_step(finder, &state));
  look(a, 1, 1, identity);
  const tessera_frame_answer again = answer_of(finder);
  CHECK(memcmp(&again, &near_guess, sizeof(again)) == 0);

  // What fails leaves the search as it is.
  CHECK_STATUS(TESSERA_OK, tessera_frame_finder_begin(finder, b, 0, b, 0, NULL));
  guess[0] = 2.0;
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_frame_finder_begin(finder, a, 0, b, 0, guess));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_frame_finder_begin(finder, a, 2, b, 0, NULL));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_frame_finder_begin(finder, a, 0, NULL, 0, NULL));
  const tessera_frame_answer itself = answer_of(finder);
  CHECK(itself.verdict == TESSERA_FRAME_FOUND && fabs(itself.T_a_b[0] - 1.0) < 1e-4);

  // Global maps are empty, as nothing was published.
  CHECK_STATUS(TESSERA_OK, tessera_frame_finder_begin(finder, a, 0, b, TESSERA_GLOBAL_MAP, NULL));
  CHECK(answer_of(finder).verdict == TESSERA_FRAME_TOO_LITTLE);

  // The search begins where the robots' frames put their maps.
  tessera_submap_report submap = {.struct_bytes = sizeof(submap)};
  CHECK_STATUS(TESSERA_OK, tessera_submap(b, &submap));
  CHECK_STATUS(TESSERA_OK, tessera_set_frame(b, submap.submap, T_a_b));
  CHECK_STATUS(TESSERA_OK, tessera_frame_finder_begin(finder, a, 0, b, 0, NULL));
  const tessera_frame_answer placed = answer_of(finder);
  check_found(&placed);
  CHECK(placed.agreement_guess.agreed > 9 * (placed.agreement.agreed / 10));
}

static tessera_frame_finder* test_making(void) {
  uint64_t bytes = 0;
  tessera_frame_finder* finder = NULL;
  tessera_frame_answer answer = {.struct_bytes = sizeof(answer)};
  uint32_t state = 0;
  memset(memory, 0xaa, sizeof(memory));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_frame_finder_bytes(NULL));
  CHECK_STATUS(TESSERA_OK, tessera_frame_finder_bytes(&bytes));
  CHECK(bytes > (1u << 20) && bytes <= (16u << 20));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_frame_finder_make(NULL, bytes, &finder));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_frame_finder_make(memory, bytes, NULL));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_frame_finder_make(memory + 8, bytes, &finder));
  CHECK_STATUS(TESSERA_RESOURCE_EXHAUSTED, tessera_frame_finder_make(memory, bytes - 1, &finder));
  CHECK(finder == NULL);
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT,
               tessera_frame_finder_step((tessera_frame_finder*)(void*)memory, &state));
  CHECK_STATUS(TESSERA_OK, tessera_frame_finder_make(memory, bytes, &finder));
  CHECK(memory[bytes] == 0xaa);
  // No search was begun.
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_frame_finder_step(finder, &state));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_frame_finder_answer(finder, &answer));
  return finder;
}

static void test_reports(tessera_frame_finder* finder) {
  tessera_frame_answer answer = {.struct_bytes = 8, .T_a_b = {7.0}};
  uint32_t state = 0;
  CHECK_STATUS(TESSERA_OK, tessera_frame_finder_answer(finder, &answer));
  CHECK(answer.struct_bytes == 8 && answer.T_a_b[0] == 7.0);
  answer.struct_bytes = 4;
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_frame_finder_answer(finder, &answer));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_frame_finder_answer(finder, NULL));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_frame_finder_step(finder, NULL));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_frame_finder_step(NULL, &state));
  for (uint32_t verdict = 0; verdict <= TESSERA_FRAME_OUT_OF_REACH; ++verdict)
    CHECK(strcmp(tessera_frame_verdict_text(verdict), "invalid") != 0);
  CHECK(strcmp(tessera_frame_verdict_text(TESSERA_FRAME_OUT_OF_REACH + 1), "invalid") == 0);
  CHECK(strcmp(tessera_frame_verdict_text(256), "invalid") == 0);
}

/// Memory of a robot that finds frames.
static uint8_t team_memory[2][80u << 20] __attribute__((aligned(TESSERA_ALIGNMENT)));

static tessera_robot* team_robot(uint32_t number) {
  const tessera_class classes[2] = {{.name = "ground"}, {.name = "wall"}};
  tessera_config config = yard_config(number);
  uint64_t given = 0;
  uint64_t bytes = 0;
  tessera_robot* robot = NULL;
  config.tick_label_bytes = config.tick_free_bytes = 200000;
  config.bytes_per_s = 20000000;
  config.replica_segments = config.robot_segments = 1u << 17;
  CHECK_STATUS(TESSERA_OK, tessera_required_bytes(&config, 2, &given));
  config.frames = TESSERA_FRAMES_FOUND;
  CHECK_STATUS(TESSERA_OK, tessera_required_bytes(&config, 2, &bytes));
  CHECK(bytes > given + (15u << 20) && bytes < given + (18u << 20));
  CHECK(bytes <= sizeof(team_memory[number]));
  CHECK_STATUS(TESSERA_OK,
               tessera_robot_make(&config, classes, 2, NULL, team_memory[number], bytes, &robot));
  return robot;
}

static size_t read_nothing(void* context, uint8_t* into, size_t capacity) {
  (void)context;
  (void)into;
  (void)capacity;
  CHECK(0);
  return 0;
}

/// Robots that know nothing of each other's frame find it while they tick.
static void test_team(void) {
  static uint8_t datagram[TESSERA_MOST_DATAGRAM_BYTES];
  const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  double T_b_a[12];
  invert(T_a_b, T_b_a);
  tessera_robot* const robots[2] = {team_robot(0), team_robot(1)};
  tessera_placed_robot placed = {.struct_bytes = sizeof(placed)};
  look(robots[0], 0, 0, identity);
  look(robots[1], -1, -2, T_b_a);
  int64_t now_us = 1000000;
  for (int tick = 0; tick < 2000; ++tick, now_us += 50000) {
    for (int from = 0; from < 2; ++from) {
      size_t bytes = 0;
      CHECK_STATUS(TESSERA_OK, tessera_tick(robots[from], now_us, NULL));
      do {
        CHECK_STATUS(TESSERA_OK,
                     tessera_send(robots[from], now_us, datagram, sizeof(datagram), &bytes));
        if (bytes != 0)
          CHECK_STATUS(TESSERA_OK, tessera_receive(robots[1 - from], datagram, bytes, now_us));
      } while (bytes != 0);
    }
  }
  for (int i = 0; i < 2; ++i) {
    CHECK_STATUS(TESSERA_OK, tessera_placed_robot_at(robots[i], 0, &placed));
    CHECK(placed.robot == 0 && placed.in_use == 1 && placed.T_team_map[0] == 1.0);
    CHECK_STATUS(TESSERA_OK, tessera_placed_robot_at(robots[i], 1, &placed));
    CHECK(placed.robot == 1 && placed.in_use == 1 && placed.arrived == 1 && placed.anchor == 0);
    CHECK(placed.state == TESSERA_PLACED_BY_LINKS && placed.suspected == 0);
    CHECK(placed.sigma_m > 0.0 && placed.sigma_m < 0.2);
    for (int k = 0; k < 12; ++k)
      CHECK(fabs(placed.T_team_map[k] - T_a_b[k]) < (k % 4 == 3 ? 0.1 : 0.01));
    CHECK_STATUS(TESSERA_OUT_OF_RANGE, tessera_placed_robot_at(robots[i], 2, &placed));
  }
  // A map of an earlier day would have no certain place: its file is not even read.
  uint32_t session = 0;
  CHECK_STATUS(TESSERA_UNSUPPORTED, tessera_open_session(robots[0], read_nothing, NULL, memory,
                                                         sizeof(memory), 0.5, 0, NULL, &session));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_placed_robot_at(robots[0], 0, NULL));
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_placed_robot_at(NULL, 0, &placed));
  // Frames that are given have nothing to tell.
  tessera_config config = yard_config(0);
  CHECK_STATUS(TESSERA_OUT_OF_RANGE,
               tessera_placed_robot_at(small_robot(0, &config, NULL), 0, &placed));
  config.frames = TESSERA_FRAMES_REFINED;
  config.frame_sigma_m = 0.0;  // and the rotation's is above 0
  uint64_t bytes = 0;
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_required_bytes(&config, 2, &bytes));
  config.frames = TESSERA_FRAMES_FOUND + 1;
  CHECK_STATUS(TESSERA_INVALID_ARGUMENT, tessera_required_bytes(&config, 2, &bytes));
}

int main(void) {
  tessera_frame_finder* const finder = test_making();
  test_search(finder);
  test_reports(finder);
  test_team();
  if (failures == 0) printf("PASS all\n");
  return failures == 0 ? 0 : 1;
}
