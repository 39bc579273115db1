// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What does each public call of the core cost on the input that costs it most?
#include <cstdio>

#include "meter.hpp"
#include "posix/atomic_file.hpp"

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
  measure_exchange(meter);
  Outcome<AtomicFile> file = AtomicFile::open(argv[1]);
  if (!file.ok()) return 2;
  const std::string text = meter.cases().dump(1) + "\n";
  file->write(std::as_bytes(std::span(text)));
  if (!file->commit().ok()) return 2;
  for (const std::string& name : meter.beyond())
    std::fprintf(stderr, "%s: more operations than its formula says\n", name.c_str());
  return meter.beyond().empty() ? 0 : 3;
}
