// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What the C programs that use the library share: a small robot, and checks that print.
#pragma once

#include <stdint.h>
#include <stdio.h>

#include "tessera/tessera.h"

/// Memory of one robot of small_config().
#define ROBOT_BYTES (50u << 20)

extern int failures;

void check(int holds, const char* what, const char* file, int line);
#define CHECK(condition) check((condition), #condition, __FILE__, __LINE__)
#define CHECK_STATUS(status, call) CHECK((call) == (status))

/// Settings that fit ROBOT_BYTES: voxels of 0.2 m, two peers.
tessera_config small_config(uint32_t robot);
/// Road and building.
extern const tessera_class classes[2];
/// A robot in static memory of its own, numbered from 0; callbacks: may be NULL.
tessera_robot* small_robot(uint32_t number, const tessera_config* config,
                           const tessera_callbacks* callbacks);
/// A square of road and a wall in front of the robot, seen from x_m, y_m.
tessera_scan_report integrate_street(tessera_robot* robot, double x_m, double y_m);
/// Hands datagrams of each to the other and ticks both, period_us apart, until both are idle and
/// have the same digest, or for so many ticks; each datagram of drop is lost (0: none). Returns
/// ticks.
int exchange_until_equal(tessera_robot* a, tessera_robot* b, int64_t* now_us, int most_ticks,
                         int drop);
uint64_t digest_of(const tessera_robot* robot);
uint64_t map_digest_of(const tessera_robot* robot, uint32_t map);

/// A file in memory, for callbacks that get it as their context; room: bytes that it takes.
extern struct memory_file {
  uint8_t bytes[4u << 20];
  size_t written;
  size_t read;
  size_t room;
} file;
int32_t write_to_file(void* context, const uint8_t* bytes, size_t count);
size_t read_from_file(void* context, uint8_t* into, size_t capacity);
