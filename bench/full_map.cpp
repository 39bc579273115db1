// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What do scans cost a map that has no room for them? For full_map.py, which counts instructions.
#include "worst/full_map.hpp"

#include <algorithm>
#include <cstdio>
#include <string>

int main(int argc, char** argv) {
  using namespace tessera;
  using namespace tessera::bench;
  if (argc != 4) {
    std::fprintf(stderr, "use: %s DATASET OUT.json REPETITIONS\n", argv[0]);
    return 1;
  }
  const Outcome<Scene> scene = load_scene(argv[1], {.first = 0, .last = 5});
  if (!scene.ok()) {
    std::fprintf(stderr, "%s\n", scene.failure().text().c_str());
    return 1;
  }
  Meter meter(std::atoi(argv[3]));
  Json found = Json::object();
  struct Size {
    const char* name;
    bool exactly;
    std::size_t bytes;
  };
  constexpr std::array<Size, 5> kSizes{{{"512_MiB", false, 0},
                                        {"6_MiB", false, std::size_t{6} << 20U},
                                        {"12_MiB", false, std::size_t{12} << 20U},
                                        {"24_MiB", false, std::size_t{24} << 20U},
                                        {"exactly_full", true, 0}}};
  for (const bool free_space : {false, true}) {
    for (const Size& size : kSizes) {
      const std::string name = std::string(free_space ? "free_space_" : "labels_") + size.name;
      const FullMapCase full{
          {name.c_str(), "Integrator::integrate", "", ""}, free_space, size.exactly, size.bytes};
      const Outcome<Json> done = measure_full_map(meter, *scene, full);
      if (!done.ok()) {
        std::fprintf(stderr, "%s\n", done.failure().text().c_str());
        return 2;
      }
      found[name] = *done;
      found[name]["free_space"] = free_space;
      found[name]["ms"] = meter.cases()[name]["ns"].get<double>() * 1e-6;
    }
  }
  return write_json(found, argv[2]).ok() ? 0 : 2;
}
