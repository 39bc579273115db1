// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Clocks that tests move.
#pragma once

#include <cstdint>

#include "tessera/inference/deadline.hpp"
#include "tessera/map/local_map.hpp"

namespace tessera::oracle {

/// Advances by a step with every reading.
struct StepClock {
  std::int64_t step_us = 1;
  std::int64_t time_us = 0;
  [[nodiscard]] Clock clock() {
    return {this, [](void* self) {
              auto* const own = static_cast<StepClock*>(self);
              return own->time_us += own->step_us;
            }};
  }
};

/// Shows how much evidence a map holds: time that only writing takes.
struct WritingClock {
  const LocalMap* map = nullptr;
  [[nodiscard]] std::int64_t now() const {
    return static_cast<std::int64_t>(map->usage().label_voxels + map->count_free_voxels());
  }
  [[nodiscard]] Clock clock() {
    return {this, [](void* self) { return static_cast<WritingClock*>(self)->now(); }};
  }
};

}  // namespace tessera::oracle
