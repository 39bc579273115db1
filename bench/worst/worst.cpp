// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What does each public call of the core cost on the input that costs it most?
#include <cstdio>

#include "meter.hpp"

int main(int argc, char** argv) {
  using namespace tessera;
  using namespace tessera::bench;
  if (argc != 3) {
    std::fprintf(stderr, "use: %s OUT.json REPETITIONS\n", argv[0]);
    return 1;
  }
  Meter meter(std::atoi(argv[2]));
  measure_integrate(meter);
  measure_full_maps(meter);
  measure_map(meter);
  measure_voxels(meter);
  measure_reading(meter);
  measure_blocks(meter);
  measure_registration(meter);
  measure_fusion(meter);
  measure_reliability(meter);
  measure_exchange(meter);
  measure_frames(meter);
  if (!write_json(meter.cases(), argv[1]).ok()) return 2;
  for (const std::string& name : meter.beyond())
    std::fprintf(stderr, "%s: more operations than its formula says\n", name.c_str());
  return meter.beyond().empty() ? 0 : 3;
}
