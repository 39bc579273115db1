// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A robot in firmware: all memory is static and its size known at compile time, time is injected,
// and a fixed cycle maps, publishes, sends, receives and queries. Radio and sensor are
// placeholders.
#include <cstdio>

#include "tessera/map/cast_ray.hpp"
#include "tessera/robot/robot.hpp"

using namespace tessera;

namespace {

constexpr MapConfig kMap{.resolution_m = 0.2, .storage_bytes = std::size_t{4} << 20U};
constexpr RobotSettings kSettings{
    .map = kMap,
    // Along rays: the images of a scan, by which the default carves, would take 16 MB.
    .inference = {.free_space = {.carving = Carving::kRays},
                  .max_range_m = 20.0F,
                  .thinning_m = 0.2},
    .scan = {.points = 2048, .tiles = 1024, .ray_blocks = 1024},
    .publisher = {.blocks = 4096, .candidates = 1024},
    .exchange = {.robot = 1, .resolution_m = 0.2, .contributions = 8, .peers = 4, .fresh = 256},
    .global = {.map = {.resolution_m = 0.2, .max_evidence = 0.0F, .storage_bytes = 4U << 20U},
               .replicas = {.segments = 8192, .blocks = 2048, .contributions = 8},
               .diffusion = {.iterations = 2, .length_m = 0.4F},
               .blocks = 4096,
               .sum_segments = 4096,
               .staged_bytes = 1U << 20U},
    .deadline_us = 60'000};
constexpr int kClasses = 2;
constexpr std::size_t kBytes = Robot::required_bytes(kSettings, kClasses + 2);
static_assert(kBytes <= std::size_t{24} << 20U, "more than this board has");
alignas(kArenaAlignment) std::byte memory[kBytes];
std::byte datagram[kMostDatagramBytes];
std::int64_t timer_us = 0;  // a timer's register, on a board

}  // namespace

int main() {
  ClassTable classes;
  if (classes.add("road", {}) != Status::kOk || classes.add("wall", {}) != Status::kOk) return 1;
  Arena arena(memory);
  const Clock clock{&timer_us, [](void* at) { return *static_cast<std::int64_t*>(at); }};
  const auto robot = Robot::make(arena, RobotConfig{kSettings}, classes, {}, clock);
  if (!robot.ok()) return 1;
  std::size_t sent = 0;
  for (int cycle = 0; cycle < 40; ++cycle, timer_us += 100'000) {
    const float wall[] = {5.0F, 0.1F * static_cast<float>(cycle % 5), 0.5F};  // from the sensor
    const std::uint8_t label[] = {2};
    const ScanView scan{.points = wall, .stride_floats = 3, .count = 1, .components = label};
    if ((*robot)->integrate(scan, timer_us).left_out() != 0) return 1;
    static_cast<void>((*robot)->tick(timer_us));
    while (const std::size_t bytes = (*robot)->send(timer_us, datagram)) {
      sent += bytes;                                                  // to the radio
      (*robot)->receive(std::span(datagram).first(bytes), timer_us);  // and from it
    }
  }
  const RayHit hit = cast_ray((*robot)->global().map(), {0.1F, 0.1F, 0.5F}, {1, 0, 0}, 10.0);
  std::printf("%zu bytes of memory, %zu sent; a wall at %.1f m\n", kBytes, sent, hit.distance_m);
  return hit.estimate.label == 2 ? 0 : 1;
}
